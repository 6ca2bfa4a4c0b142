"""The motions of the virtual stand: exact derivatives, bands, amplitudes, and a start from rest."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from pzd.rig.stand.recording import draw_for
from pzd.rig.stand.waveforms import Course, Waveform, started, waveforms
from pzd.schema.errors import ConfigError, DataError
from pzd.signals.harmonics import FourierSum

SIZES: dict[str, dict[str, object]] = {
    "sine": {"frequency_Hz": 2.0, "amplitude_m": 0.03},
    "triangle": {"frequency_Hz": 1.5, "amplitude_m": 0.02, "bandwidth_Hz": 30.0},
    "sweep": {"low_Hz": 0.5, "high_Hz": 6.0, "amplitude_m": 0.02, "amplitude_at_high_m": 0.005},
    "random": {"low_Hz": 0.5, "high_Hz": 10.0, "rms_m": 0.006},
    "road": {"road_class": "C", "vehicle_speed_km_per_h": 72.0},
    "tones": {"frequencies_Hz": (1.0, 2.5), "amplitudes_m": (0.02, 0.005)},
    "file": {"path": "motion.csv"},
}
REPEATING = sorted(set(SIZES) - {"file", "tones"})


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    time = np.arange(0.0, 4.0, 0.01)
    rows = [f"{t!r},{0.02 * math.sin(5.0 * t + 0.3)!r}" for t in time.tolist()]
    (tmp_path / "motion.csv").write_text("\n".join(["time_s,displacement_m", *rows]) + "\n")
    return tmp_path


def made(kind: str, **changes: object) -> Waveform:
    return waveforms()[kind](**{**SIZES[kind], **changes})


def course(waveform: Waveform, seed: int = 1, folder: Path = Path()) -> Course:
    return waveform.course(draw_for(seed, "test"), folder)


def one_cycle(waveform: Waveform, points: int = 2**14, seed: int = 1) -> tuple[np.ndarray, ...]:
    time = waveform.cycle(Path()) * np.arange(points) / points
    return course(waveform, seed)(time)


def test_every_waveform_of_the_library_is_tested_here() -> None:
    assert set(waveforms()) == set(SIZES)


@pytest.mark.parametrize("kind", sorted(SIZES))
def test_velocity_and_acceleration_are_the_derivatives_of_the_displacement(kind: str, folder: Path) -> None:
    motion = course(made(kind), folder=folder)
    time = np.linspace(0.1053, 3.7041, 777)
    for order in (0, 1):
        errors = []
        for step in (1e-3, 5e-4):
            slope = (motion(time + step)[order] - motion(time - step)[order]) / (2.0 * step)
            errors.append(np.abs(slope - motion(time)[order + 1]).max() / np.abs(motion(time)[order + 1]).max())
        assert errors[0] < 0.03
        assert errors[1] < max(0.3 * errors[0], 1e-4)


@pytest.mark.parametrize("kind", REPEATING)
def test_motion_repeats_with_all_its_derivatives_after_one_cycle(kind: str, seed: int) -> None:
    waveform = made(kind)
    time = np.linspace(0.0, 1.0, 501)
    motion = course(waveform, seed)
    for now, later in zip(motion(time), motion(time + waveform.cycle(Path())), strict=True):
        np.testing.assert_allclose(later, now, atol=1e-9 * np.abs(now).max())


def test_sums_on_an_even_grid_equal_the_sums_at_single_places(seed: int) -> None:
    draw = draw_for(seed, "test")
    motion = FourierSum(2.5, draw.normal(size=40) + 1j * draw.normal(size=40))
    even = -0.7 + np.arange(5000) * 2.5 / 2000
    some = draw.permutation(5000)[:300]
    for fast, single in zip(motion(even), motion(even[some]), strict=True):
        np.testing.assert_allclose(fast[some], single, atol=1e-11 * np.abs(fast).max())


def test_a_sum_with_more_lines_than_the_grid_carries_is_still_exact() -> None:
    motion = FourierSum(1.0, np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]))
    time = np.arange(20) / 10.0
    np.testing.assert_allclose(motion(time)[0], np.cos(12.0 * np.pi * time), atol=1e-13)


def test_sine_reaches_its_amplitude_and_speed() -> None:
    x, v, a = one_cycle(made("sine"))
    assert x.max() == pytest.approx(0.03, rel=1e-6)
    assert v.max() == pytest.approx(2.0 * np.pi * 2.0 * 0.03, rel=1e-12)
    assert a.max() == pytest.approx((4.0 * np.pi) ** 2 * 0.03, rel=1e-6)


def test_triangle_keeps_its_speed_between_the_corners_and_never_exceeds_it() -> None:
    x, v, _ = one_cycle(made("triangle"))
    speed = 4.0 * 0.02 * 1.5
    assert np.mean(np.abs(np.abs(v) - speed) < 1e-3 * speed) > 0.8
    assert np.abs(v).max() < speed * (1.0 + 1e-6)
    assert 0.95 * 0.02 < x.max() < 0.02


def test_triangle_has_half_its_power_left_at_the_bandwidth() -> None:
    wide = course(made("triangle", frequency_Hz=2.0, bandwidth_Hz=1e3))
    narrow = course(made("triangle", frequency_Hz=2.0, bandwidth_Hz=30.0))
    assert isinstance(wide, FourierSum)
    assert isinstance(narrow, FourierSum)
    ratio = np.abs(narrow.coefficients[1::2] / wide.coefficients[1 : narrow.coefficients.size : 2]) ** 2
    frequency = 2.0 * np.arange(1, narrow.coefficients.size, 2)
    at_band = np.exp(np.interp(30.0**2, frequency**2, np.log(ratio)))
    assert at_band == pytest.approx(0.5, rel=2e-3)


@pytest.mark.parametrize(("kind", "low", "high"), [("random", 0.5, 10.0), ("road", 0.5, 15.0)])
def test_nothing_lies_outside_the_band(kind: str, low: float, high: float, seed: int) -> None:
    waveform = made(kind)
    spectrum = np.abs(np.fft.rfft(one_cycle(waveform, seed=seed)[0]))
    frequency = np.arange(spectrum.size) / waveform.cycle(Path())
    outside = (frequency < low - 1e-9) | (frequency > high + 1e-9)
    assert spectrum[outside].max() < 1e-12 * spectrum.max()
    assert spectrum[np.isclose(frequency, high)] > 1e-9 * spectrum.max()


@pytest.mark.parametrize("slope", [0.0, 2.0])
def test_random_motion_has_the_rms_and_the_slope_asked_for(seed: int, slope: float) -> None:
    x, _, _ = one_cycle(made("random", slope=slope), seed=seed)
    assert np.sqrt(np.mean(x**2)) == pytest.approx(0.006, rel=1e-9)
    power = np.abs(np.fft.rfft(x))[5:101] ** 2
    np.testing.assert_allclose(power * np.arange(5, 101) ** slope, power[0] * 5.0**slope, rtol=1e-6)


def test_random_motion_differs_by_seed_and_not_otherwise() -> None:
    first, again, other = (one_cycle(made("random"), seed=seed)[0] for seed in (5, 5, 6))
    np.testing.assert_array_equal(first, again)
    assert np.corrcoef(first, other)[0, 1] < 0.9


def test_sweep_goes_from_low_to_high_and_back() -> None:
    waveform = made("sweep", amplitude_at_high_m=None)
    x, v, a = one_cycle(waveform)
    frequency = np.sqrt(np.abs(v**2 - x * a)) / 0.02 / (2.0 * np.pi)
    assert frequency[0] == pytest.approx(0.5, rel=0.01)
    assert frequency[frequency.size // 2] == pytest.approx(6.0, rel=0.01)
    assert np.abs(x).max() <= 0.02


def test_two_tones_are_the_sum_of_their_sines() -> None:
    time = np.linspace(-1.0, 9.0, 777)
    alone = [course(made("sine", frequency_Hz=f, amplitude_m=a))(time) for f, a in ((1.0, 0.02), (2.5, 0.005))]
    for together, first, second in zip(course(made("tones"))(time), *alone, strict=True):
        np.testing.assert_allclose(together, first + second, rtol=0, atol=1e-14 * np.abs(together).max())


def test_road_scaled_to_a_peak_reaches_it(seed: int) -> None:
    x, _, _ = one_cycle(made("road", peak_m=0.015), seed=seed)
    assert np.abs(x).max() == pytest.approx(0.015, rel=1e-3)


def test_file_motion_passes_through_its_samples(folder: Path) -> None:
    time = np.arange(0.0, 4.0, 0.01)
    x, v, _ = course(made("file"), folder=folder)(time)
    np.testing.assert_allclose(x, 0.02 * np.sin(5.0 * time + 0.3), atol=1e-16)
    np.testing.assert_allclose(v[5:-5], 0.1 * np.cos(5.0 * time + 0.3)[5:-5], atol=1e-6)


def test_file_motion_is_approached_from_rest_without_a_jump(folder: Path) -> None:
    waveform = made("file")
    motion = course(waveform, folder=folder)
    start = motion(np.array([-waveform.settling_time]))
    assert abs(start[1][0]) < 1e-12
    assert abs(start[2][0]) < 1e-12
    before, after = motion(np.array([-1e-9])), motion(np.array([1e-9]))
    for left, right in zip(before, after, strict=True):
        np.testing.assert_allclose(left, right, atol=1e-6)


def test_a_missing_or_backward_file_is_the_users_fault(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"missing"):
        course(made("file"), folder=tmp_path)
    (tmp_path / "motion.csv").write_text("time_s,displacement_m\n0,0\n1,1\n0.5,2\n2,3\n")
    with pytest.raises(DataError, match=r"motion.csv:4: time does not increase"):
        course(made("file"), folder=tmp_path)


@pytest.mark.parametrize("kind", sorted(set(SIZES) - {"file"}))
def test_a_test_starts_from_rest_and_is_untouched_when_recording_begins(kind: str) -> None:
    waveform = made(kind)
    lead = waveform.settling_time
    plain, soft = course(waveform), started(course(waveform), lead)
    for value in soft(np.array([-lead])):
        assert value[0] == 0.0
    late = np.linspace(-0.5 * lead, 1.0, 300)
    for expected, value in zip(plain(late), soft(late), strict=True):
        np.testing.assert_array_equal(value, expected)
    early, step = np.linspace(-0.99 * lead, -0.51 * lead, 300), 1e-5
    for order in (0, 1):
        slope = (soft(early + step)[order] - soft(early - step)[order]) / (2.0 * step)
        exact = soft(early)[order + 1]
        np.testing.assert_allclose(slope, exact, atol=1e-5 * np.abs(exact).max())


@pytest.mark.parametrize(
    ("kind", "changes", "message"),
    [
        ("sine", {"frequency_Hz": 0.0}, "frequency_Hz"),
        ("sweep", {"high_Hz": 0.1}, "high_Hz must be at least low_Hz"),
        ("random", {"high_Hz": 0.1}, "no multiple"),
        ("road", {"road_class": "Z"}, "a road class is one of A, B"),
        ("sine", {"label": "a b"}, "label"),
        ("tones", {"amplitudes_m": (0.01, 0.01, 0.01)}, "a frequency and an amplitude .got 2 and 3"),
        ("tones", {"frequencies_Hz": (0.0, 1.0)}, "above 0"),
        ("tones", {"frequencies_Hz": (1.0, 1.0)}, "no two tones"),
    ],
)
def test_impossible_motions_are_refused(kind: str, changes: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        made(kind, **changes)
