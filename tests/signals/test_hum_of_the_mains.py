"""Hum of the mains is found where its line is prominent, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.record import Array
from pzd.signals.harmonics import hum, hum_variance, mains_amplitudes

RATE = 1000.0
TIME = np.arange(8000) / RATE
ALL = np.ones(TIME.size, dtype=np.bool_)


def wave(frequency: float, amplitude: float) -> Array:
    phase = 2.0 * np.pi * frequency * TIME + 0.7
    return np.asarray(amplitude * (np.sin(phase) + 0.3 * np.sin(3.0 * phase)))


@pytest.mark.parametrize("frequency", [49.93, 50.0, 60.007])
@pytest.mark.parametrize("share", [1.0, 0.5])
def test_mains_hum_is_estimated_to_a_percent_also_from_part_of_the_samples(
    rng: np.random.Generator, frequency: float, share: float
) -> None:
    made = wave(frequency, 5.0)
    others = 20.0 * np.sin(2.0 * np.pi * TIME) + rng.standard_normal(TIME.size)
    wanted = np.floor(TIME) % 2.0 < 2.0 * share
    found = hum(TIME, made + others, wanted, 1.0, 0.5)
    # Of 8000 samples with noise of 1, each of four coefficients has an error of sqrt(2/8000) = 0.016.
    assert float(np.sqrt(np.mean((found - made) ** 2))) < 0.01 * 5.0 + 0.03 / np.sqrt(share)


def test_a_channel_without_a_prominent_line_has_no_hum(rng: np.random.Generator) -> None:
    friction = 300.0 * np.sign(np.sin(2.0 * np.pi * TIME))  # harmonics 47, 49, 51, 53 beside 50 Hz
    for values in (rng.standard_normal(TIME.size), friction + rng.standard_normal(TIME.size), np.zeros(TIME.size)):
        assert not hum(TIME, values, ALL, 1.0, 1e-3).any()


def test_a_line_below_the_least_amplitude_is_no_hum(rng: np.random.Generator) -> None:
    values = wave(50.0, 0.4) + 0.1 * rng.standard_normal(TIME.size)
    assert hum(TIME, values, ALL, 1.0, 0.3).any()
    assert not hum(TIME, values, ALL, 1.0, 0.5).any()


@pytest.mark.parametrize("cycle", [50.0 / 3.0, 10.0, 60.0 / 7.0])
def test_a_low_harmonic_of_the_motion_at_the_mains_frequency_is_no_hum(cycle: float) -> None:
    order = round(50.0 / cycle) if cycle != 60.0 / 7.0 else 7
    values = 5.0 * np.sin(2.0 * np.pi * order * cycle * TIME)
    assert not hum(TIME, values, ALL, cycle, 0.1).any()
    assert hum(TIME, values, ALL, 1.0, 0.1).any()


def test_a_hum_in_step_with_a_motion_has_the_power_of_its_line_in_that_harmonic_alone() -> None:
    cycle = TIME[:200]  # one of 5 Hz
    harmonics = np.abs(np.fft.rfft(wave(50.0, 5.0)[: cycle.size]) / cycle.size) ** 2
    found = hum_variance({(1, 50.0): 5.0, (3, 50.0): 1.5}, 5.0, 80, 5.0 / 40.0)
    assert np.flatnonzero(found).tolist() == [10, 30]
    np.testing.assert_allclose(found, harmonics[:81], atol=1e-20)


def test_the_lines_of_the_mains_are_told_from_a_low_harmonic_of_the_motion(rng: np.random.Generator) -> None:
    values = wave(50.0, 5.0) + rng.standard_normal(TIME.size)
    found = mains_amplitudes(values, RATE, 1.0, 0.5)
    assert found == {(1, 50.0): pytest.approx(5.0, rel=0.05), (3, 50.0): pytest.approx(1.5, rel=0.05)}
    assert mains_amplitudes(values, RATE, 10.0, 0.5) == {(3, 50.0): pytest.approx(1.5, rel=0.05)}
