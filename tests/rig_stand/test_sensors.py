"""What the sensors add: the size and colour of the noise, its independence, and the resolution."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.rig.stand.config import ChannelNoise, DisplacementNoise, ForceNoise, TemperatureNoise, VoltageNoise
from pzd.rig.stand.recording import coloured, draw_for, sensed
from pzd.signals.noise import all_pole, recursion

COUNT = 40_000


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.9])
def test_noise_has_unit_size_and_the_correlation_asked_for(rho: float, seed: int) -> None:
    noise = coloured(COUNT, rho, draw_for(seed, "test"))
    effective = COUNT * (1.0 - rho) / (1.0 + rho)  # independent samples, so that the mean square is known to 5 s.e.
    assert np.mean(noise**2) == pytest.approx(1.0, abs=5.0 * np.sqrt(2.0 / effective) * (1.0 + rho))
    for lag in (1, 2, 5):
        assert np.mean(noise[lag:] * noise[:-lag]) == pytest.approx(rho**lag, abs=7.0 / np.sqrt(effective))


def test_noise_is_as_large_at_the_first_sample_as_later(seed: int) -> None:
    draw = draw_for(seed, "test")
    firsts = np.array([coloured(3, 0.95, draw) for _ in range(4000)])
    np.testing.assert_allclose(np.std(firsts, axis=0), 1.0, atol=0.06)


def test_recursion_equals_its_loop(seed: int) -> None:
    inputs = draw_for(seed, "test").normal(size=777)
    for memory in (0.0, 0.3, 0.99, 1.0):
        y, expected = 0.0, []
        for u in inputs:
            y = memory * y + u
            expected.append(y)
        np.testing.assert_allclose(recursion(memory, inputs), expected, atol=1e-11)


def test_a_memory_of_any_order_equals_the_filter_of_its_poles(seed: int) -> None:
    from scipy.signal import lfilter

    draw = draw_for(seed, "test")
    inputs = draw.normal(size=(500, 3))
    for order in (0, 1, 7):
        coefficients = np.real(np.poly(draw.uniform(-0.95, 0.95, order)))
        expected = lfilter([1.0], np.atleast_1d(coefficients), inputs, axis=0)
        np.testing.assert_allclose(all_pole(np.atleast_1d(coefficients), inputs), expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("noise", "size"),
    [
        (ForceNoise(sd_N=12.0), 12.0),
        (ForceNoise(share_of_peak=0.02, rho=0.5), 0.02 * 300.0),
        (DisplacementNoise(sd_m=5e-6), 5e-6),
        (VoltageNoise(sd_voltage_V=0.3), 0.3),
        (TemperatureNoise(sd_degC=0.2), 0.2),
    ],
)
def test_size_of_the_noise_is_as_configured(noise: ChannelNoise, size: float, seed: int) -> None:
    truth = 300.0 * np.sin(np.linspace(0.0, 100.0, COUNT))
    truth[100] = -300.0
    error = sensed(truth, noise, 0.0, draw_for(seed, "test")) - truth
    assert np.std(error) == pytest.approx(size, rel=0.05)


def test_without_noise_and_resolution_the_truth_is_recorded(rng: np.random.Generator) -> None:
    truth = np.linspace(-1.0, 1.0, 11)
    np.testing.assert_array_equal(sensed(truth, ForceNoise(), 0.0, rng), truth)


def test_a_channel_shows_whole_multiples_of_its_resolution_and_errs_by_half_of_it_at_most(
    rng: np.random.Generator,
) -> None:
    truth = np.linspace(-1.0, 1.0, 1001)
    shown = sensed(truth, ForceNoise(), 0.25, rng)
    assert set(np.unique(shown / 0.25)) == set(range(-4, 5))
    assert np.abs(shown - truth).max() <= 0.125
    assert np.std(shown - truth) == pytest.approx(0.25 / np.sqrt(12.0), rel=0.1)


def test_draws_depend_on_seed_and_names_alone(seed: int) -> None:
    def numbers(*key: object) -> np.ndarray:
        return draw_for(key[0], *map(str, key[1:])).normal(size=1000)

    np.testing.assert_array_equal(numbers(seed, "a", "force"), numbers(seed, "a", "force"))
    for other in ((seed + 1, "a", "force"), (seed, "b", "force"), (seed, "a", "displacement"), (seed, "aforce")):
        assert abs(np.corrcoef(numbers(seed, "a", "force"), numbers(*other))[0, 1]) < 0.2


def test_noise_said_twice_is_refused() -> None:
    with pytest.raises(ValueError, match="once"):
        ForceNoise(sd_N=1.0, share_of_peak=0.01)
