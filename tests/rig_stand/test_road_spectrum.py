"""Roads by ISO 8608: the right class value, the right reference, the right amplitude, and reproducible phases."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest

from pzd.rig.stand.recording import draw_for
from pzd.rig.stand.waveforms import waveforms
from pzd.signals.iso8608 import classes, height_density, profile

BAND = (0.02, 2.0)


def heights(density: float, seed: int, length: float = 2000.0, spacing: float = 0.1) -> np.ndarray:
    road = profile(density, length, draw_for(seed, "test"), BAND)
    return road(np.arange(round(length / spacing)) * spacing)[0]


def welch(x: np.ndarray, spacing: float, points: int) -> tuple[np.ndarray, np.ndarray]:
    """One-sided spectral density by Welch's method, Hann window, half overlap."""
    window = np.hanning(points)
    pieces = [x[start : start + points] * window for start in range(0, x.size - points + 1, points // 2)]
    power = np.mean([np.abs(np.fft.rfft(piece)) ** 2 for piece in pieces], axis=0)
    return np.fft.rfftfreq(points, spacing), 2.0 * power * spacing / np.sum(window**2)


def test_a_class_stands_for_the_geometric_mean_of_its_range() -> None:
    assert classes() == pytest.approx({name: 16e-6 * 4.0**k for k, name in enumerate("ABCDEFGH")})


def test_density_at_the_reference_wavenumber_is_that_of_the_class_and_falls_with_its_square() -> None:
    assert height_density(np.array([0.1]), classes()["C"]) == pytest.approx(256e-6)
    assert height_density(np.array([1.0]), classes()["C"]) == pytest.approx(2.56e-6)


@pytest.mark.parametrize("name", ["A", "C", "E"])
def test_spectrum_of_a_drawn_road_is_that_of_its_class(name: str, seed: int) -> None:
    wavenumber, density = welch(heights(classes()[name], seed), 0.1, 1000)
    inside = (wavenumber > 0.05) & (wavenumber < 1.5)
    ratio = density[inside] / height_density(wavenumber[inside], classes()[name])
    # 39 pieces of half overlap and 145 wavenumbers: the mean is known to about 2 %.
    assert np.mean(ratio) == pytest.approx(1.0, abs=0.08)
    thirds = [np.mean(part) for part in np.array_split(ratio, 3)]
    np.testing.assert_allclose(thirds, 1.0, atol=0.15)


def test_variance_of_the_height_is_the_integral_of_the_density(seed: int) -> None:
    density = classes()["B"]
    exact = density * 0.1**2 * (1.0 / BAND[0] - 1.0 / BAND[1])
    assert np.var(heights(density, seed)) == pytest.approx(exact, rel=0.02)


def test_one_seed_is_one_road_and_another_seed_another(seed: int) -> None:
    road = heights(classes()["C"], seed)
    np.testing.assert_array_equal(road, heights(classes()["C"], seed))
    assert abs(np.corrcoef(road, heights(classes()["C"], seed + 1))[0, 1]) < 0.9


def test_a_rougher_class_is_the_same_road_scaled_by_two() -> None:
    np.testing.assert_allclose(heights(classes()["D"], 7), 2.0 * heights(classes()["C"], 7), rtol=1e-9, atol=1e-15)


def test_a_wider_band_leaves_the_lines_inside_as_they_were(rng: np.random.Generator) -> None:
    again = deepcopy(rng)
    narrow = profile(classes()["C"], 100.0, rng, (0.05, 1.0))
    wide = profile(classes()["C"], 100.0, again, (0.02, 2.0))
    np.testing.assert_array_equal(narrow.coefficients[5:], wide.coefficients[5 : narrow.coefficients.size])


def test_slope_and_curvature_are_exact(rng: np.random.Generator) -> None:
    road = profile(classes()["C"], 50.0, rng, BAND)
    place, step = np.linspace(0.0, 50.0, 333), 1e-4
    for order in (0, 1):
        slope = (road(place + step)[order] - road(place - step)[order]) / (2.0 * step)
        exact = road(place)[order + 1]
        np.testing.assert_allclose(slope, exact, atol=1e-6 * np.abs(exact).max())


def test_a_road_too_short_for_its_band_is_refused(rng: np.random.Generator) -> None:
    with pytest.raises(ValueError, match="no wavenumber between"):
        profile(classes()["C"], 1.0, rng, (0.1, 0.5))


def test_a_damper_that_follows_the_height_meets_the_density_over_the_vehicle_speed(seed: int) -> None:
    speed, period = 20.0, 500.0
    waveform = waveforms()["road"](
        road_class="C", vehicle_speed_km_per_h=72.0, period_s=period, body_frequency_Hz=None, low_Hz=0.5, high_Hz=10.0
    )
    x = waveform.course(draw_for(seed, "test"), Path())(np.arange(25_000) * period / 25_000)[0]
    frequency, density = welch(x, period / 25_000, 500)
    inside = (frequency > 1.0) & (frequency < 9.0)
    exact = height_density(frequency[inside] / speed, classes()["C"]) / speed
    assert np.mean(density[inside] / exact) == pytest.approx(1.0, abs=0.08)


def test_a_suspension_deflects_like_the_road_above_its_body_frequency_and_hardly_below(
    rng: np.random.Generator,
) -> None:
    again = deepcopy(rng)
    sizes = {"low_Hz": 0.1, "high_Hz": 20.0, "period_s": 20.0}
    height = waveforms()["road"](body_frequency_Hz=None, **sizes).course(rng, Path())
    deflection = waveforms()["road"](body_frequency_Hz=1.4, body_damping=0.3, **sizes).course(again, Path())
    frequency = np.arange(height.coefficients.size) / 20.0
    passed = np.abs(deflection.coefficients[2:] / height.coefficients[2:])
    assert passed[-1] == pytest.approx(1.0, abs=0.01)
    assert passed[0] == pytest.approx((0.1 / 1.4) ** 2, rel=0.02)
    at_resonance = np.interp(1.4, frequency[2:], passed)
    assert at_resonance == pytest.approx(1.0 / 0.6, rel=1e-6)
