"""Slow tests at constant speed: 1 in/s to and fro, nine and a half cycles, as catalogues of dampers are measured."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.random import Generator
from scipy.ndimage import gaussian_filter1d

from pzd.artefacts import MeasureRow
from pzd.damper.element import element_force
from pzd.identification.strokes_and_loops import measures
from pzd.record import Array, Record
from pzd.signals.cycles import cycles
from pzd.signals.kinematics import kinematics

INCH_A_SECOND = 0.0254
AMPLITUDE = 0.0186
FREQUENCY = INCH_A_SECOND / (4.0 * AMPLITUDE)
RATE = 500.0
TURN = 0.01
"""Standard deviation of the time that the stand takes to turn [s]."""


def to_and_fro(rng: Generator, *, noise: float, resolution: float, hum: float, count: float = 9.5) -> Record:
    """A triangle with a rest on either side, as a sensor of that noise, resolution and mains hum [m] shows it."""
    time = np.arange(0.0, count / FREQUENCY + 1.0, 1.0 / RATE)
    phase = np.clip(time - 0.5, 0.0, count / FREQUENCY) * FREQUENCY
    course = 1.0 - 4.0 * np.abs((phase + 0.25) % 1.0 - 0.5)
    x = gaussian_filter1d(AMPLITUDE * course, TURN * RATE)
    seen = x + 0.03 + hum * np.sin(2.0 * np.pi * 50.03 * time) + noise * rng.standard_normal(time.size)
    return recorded(time, resolution * np.round(seen / resolution), x)


def recorded(time: Array, seen: Array, x: Array) -> Record:
    clean = kinematics(time, seen, cycles(time, seen))
    force = element_force(x, float(time[1] - time[0]), 100.0, 2000.0, 3e5)
    return Record("slow", None, time, seen, clean.velocity, clean.acceleration, force)


def measured(record: Record) -> MeasureRow:
    return measures([record])[0]


@pytest.mark.parametrize(
    "sensor",
    [
        {"noise": 1e-5, "resolution": 1e-6, "hum": 0.0},
        {"noise": 1e-4, "resolution": 1e-5, "hum": 0.0},
        {"noise": 1e-5, "resolution": 1e-4, "hum": 0.0},
        {"noise": 1e-5, "resolution": 1e-5, "hum": 1e-4},
    ],
    ids=["good", "noisy", "coarse", "humming"],
)
def test_a_slow_test_has_its_frequency_and_its_speed(sensor: dict[str, float], rng: Generator) -> None:
    found = measured(to_and_fro(rng, **sensor))
    assert found.frequency_Hz == pytest.approx(FREQUENCY, rel=1e-3)
    assert found.peak_velocity_m_per_s == pytest.approx(INCH_A_SECOND, rel=0.02)


def test_few_slow_cycles_have_a_frequency_and_a_speed(rng: Generator) -> None:
    found = measured(to_and_fro(rng, noise=1e-5, resolution=1e-5, hum=0.0, count=2.5))
    assert found.peak_velocity_m_per_s == pytest.approx(INCH_A_SECOND, rel=0.02)


def test_the_peak_speed_of_a_sine_with_a_tenth_of_its_size_at_ten_times_its_frequency_is_that_of_both() -> None:
    time = np.arange(0.0, 9.5, 1.0 / RATE)
    x = 0.02 * np.sin(2.0 * np.pi * time) + 0.002 * np.sin(2.0 * np.pi * 10.0 * time)
    assert measured(recorded(time, x, x)).peak_velocity_m_per_s == pytest.approx(2.0 * np.pi * 0.04, rel=0.01)


def test_a_second_tone_of_the_size_of_mains_hum_is_motion(rng: Generator) -> None:
    """Averaging takes away what is in step with the mains, and nothing else."""
    time = np.arange(0.0, 28.0, 1.0 / RATE)
    x = AMPLITUDE * np.sin(2.0 * np.pi * FREQUENCY * time) + 1e-4 * np.sin(2.0 * np.pi * 20.1 * time)
    assert cycles(time, x + 1e-6 * rng.standard_normal(time.size)) is None
