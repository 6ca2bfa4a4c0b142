"""Exposure times of 1978: the rows of the table, an independent report, and the edges of the chart."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.comfort.iso2631_1978 import chart, exposure, shortest
from pzd.comfort.spectrum import Components, harmonics, third_octaves

RATE = 500.0
TIME = np.arange(8000) / RATE


def tone(amplitude: float, frequency: float) -> np.ndarray:
    return amplitude * np.sin(2.0 * np.pi * frequency * TIME + 0.3)


@pytest.mark.parametrize(
    ("boundary", "factor"),
    [("reduced_comfort", 1.0 / 3.15), ("fatigue_decreased_proficiency", 1.0), ("exposure_limit", 2.0)],
)
def test_every_cell_of_the_table_gives_its_own_time(boundary: str, factor: float) -> None:
    table = chart()
    for frequency, row in zip(table.frequency, table.level, strict=True):
        for minutes, level in zip(table.minutes, row, strict=True):
            assert exposure(factor * level, float(frequency), boundary).minutes == pytest.approx(minutes, rel=1e-9)


def test_the_table_is_one_base_value_a_time_over_a_slope_law() -> None:
    table = chart()
    f = table.frequency
    slope = np.where(f < 4.0, np.sqrt(4.0 / f), np.where(f > 8.0, f / 8.0, 1.0))
    base = np.array([0.140, 0.212, 0.315, 0.53, 0.71, 1.18, 1.80, 2.12, 2.80])
    assert np.abs(table.level / np.outer(slope, base) - 1.0).max() < 0.035


@pytest.mark.parametrize(("boundary", "minutes"), [("fatigue_decreased_proficiency", 58.0), ("exposure_limit", 197.0)])
def test_two_times_of_an_independent_report_are_found(boundary: str, minutes: float) -> None:
    assert exposure(1.2, 5.0, boundary).minutes == pytest.approx(minutes, abs=0.5)


@pytest.mark.parametrize(("frequency", "top"), [(2.25, 1.19), (4.5, 0.89)])
def test_top_of_reduced_comfort_at_the_papers_frequencies(frequency: float, top: float) -> None:
    exact = chart().levels_at(frequency)[-1] / 3.15
    assert exact == pytest.approx(top, abs=0.005)
    assert exposure(float(exact), frequency, "reduced_comfort").remark == "4 min or less"
    assert exposure(1.001 * exact, frequency, "reduced_comfort").minutes == 0.0
    assert exposure(0.999 * exact, frequency, "reduced_comfort").minutes == pytest.approx(4.0, rel=0.04)


@pytest.mark.parametrize(("level", "frequency"), [(1.56, 2.25), (2.55, 4.5)])
def test_the_papers_constant_c_rides_are_over_the_chart(level: float, frequency: float) -> None:
    found = exposure(level, frequency, "reduced_comfort")
    assert (found.minutes, found.remark) == (0.0, "over the chart")


def test_below_the_last_line_the_time_is_more_than_a_day() -> None:
    found = exposure(0.01, 5.0, "reduced_comfort")
    assert found.minutes == 1440.0
    assert "beyond the chart" in found.remark
    assert exposure(0.0, 5.0, "reduced_comfort").minutes == 1440.0


@pytest.mark.parametrize("frequency", [0.5, 0.99, 81.0])
def test_outside_of_1_to_80_hz_no_time_is_given(frequency: float) -> None:
    found = exposure(1.0, frequency, "exposure_limit")
    assert found.minutes is None
    assert found.remark == "not covered: the chart begins at 1 Hz and ends at 80 Hz"


def test_a_vibration_that_is_strongest_outside_of_the_chart_is_not_covered() -> None:
    """5 m/s2 at 0.9 Hz: its harmonics alone are next to nothing, and say nothing about it."""
    ride = tone(5.0, 0.9)
    for parts in (harmonics(ride, RATE, 0.9), third_octaves(ride, RATE)):
        found = shortest(parts, "reduced_comfort")
        assert found.minutes is None
        assert found.remark.startswith("not covered")
    assert shortest(harmonics(tone(5.0, 90.0), RATE, 90.0), "exposure_limit").minutes is None


def test_what_lies_outside_of_the_chart_and_would_not_govern_leaves_the_time_as_it_is() -> None:
    parts = Components(np.array([0.9, 5.0, 100.0]), np.array([0.1, 1.0, 0.5]), 1.0)
    alone = exposure(1.0, 5.0, "fatigue_decreased_proficiency")
    assert shortest(parts, "fatigue_decreased_proficiency") == alone


def test_less_vibration_never_shortens_the_time() -> None:
    for boundary in ("reduced_comfort", "fatigue_decreased_proficiency", "exposure_limit"):
        for frequency in np.geomspace(1.0, 80.0, 23):
            times = [exposure(float(a), float(frequency), boundary).minutes for a in np.geomspace(0.01, 100.0, 200)]
            assert np.all(np.diff(times) <= 0.0)


def test_interpolation_is_log_log() -> None:
    middle = float(np.sqrt(1.18 * 0.71))
    assert exposure(middle, 5.0, "fatigue_decreased_proficiency").minutes == pytest.approx(np.sqrt(60.0 * 150.0))


def test_a_tone_is_rated_at_its_own_frequency_and_not_at_the_centre_of_a_band() -> None:
    parts = harmonics(tone(1.0, 2.25), RATE, 2.25)
    assert parts.rms[0] == pytest.approx(1.0 / np.sqrt(2.0), rel=1e-9)
    assert parts.share == pytest.approx(1.0, abs=1e-12)
    own = shortest(parts, "fatigue_decreased_proficiency")
    assert own.minutes == pytest.approx(exposure(0.5**0.5, 2.25, "fatigue_decreased_proficiency").minutes, rel=1e-9)
    assert own.frequency == 2.25
    bands = third_octaves(tone(1.0, 2.25), RATE)
    assert shortest(bands, "fatigue_decreased_proficiency").frequency == 2.5


def test_harmonics_are_exact_for_a_fractional_number_of_periods() -> None:
    ride = tone(1.0, 2.25)[:7777] + 0.3 * np.cos(2.0 * np.pi * 6.75 * TIME[:7777]) + 0.5
    parts = harmonics(ride, RATE, 2.25)
    assert parts.rms[:4] * np.sqrt(2.0) == pytest.approx([1.0, 0.0, 0.3, 0.0], abs=1e-9)


def test_the_worst_harmonic_governs() -> None:
    parts = Components(np.array([2.25, 4.5, 6.75]), np.array([0.3, 0.4, 0.1]), 1.0)
    found = shortest(parts, "fatigue_decreased_proficiency")
    assert found.frequency == 4.5
    assert found.minutes == exposure(0.4, 4.5, "fatigue_decreased_proficiency").minutes


def test_the_bands_add_up_to_the_whole_mean_square(rng: np.random.Generator) -> None:
    ride = rng.normal(size=8000)
    bands = third_octaves(ride, RATE)
    low, high = 10.0 ** (-0.05), 10.0**1.95
    charted = np.isin(bands.frequency, chart().frequency)
    assert np.sum(charted) == chart().frequency.size
    assert float(np.sum(bands.rms[charted] ** 2)) == pytest.approx((high - low) / (RATE / 2.0), rel=0.1)
    assert float(np.sum(bands.rms**2)) == pytest.approx(np.var(ride), rel=1e-9)
    assert bands.share == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize("frequency", [1.0, 1.6, 5.0, 31.5, 80.0])
def test_a_tone_at_a_centre_falls_into_its_own_band(frequency: float) -> None:
    bands = third_octaves(tone(1.0, frequency), RATE)
    assert bands.frequency[int(np.argmax(bands.rms))] == frequency
    assert bands.rms.max() == pytest.approx(1.0 / np.sqrt(2.0), rel=0.04)
