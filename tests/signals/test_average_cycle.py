"""The average cycle of a displacement, without its noise and its steps."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.random import Generator

from pzd.signals.average_cycle import AverageCycle, positive_mean, variance_by_steps
from pzd.signals.cycles import Cycles
from pzd.signals.measures import resolution


@pytest.mark.parametrize("points", [2000, 400, 80])
def test_the_steps_of_a_channel_fill_the_harmonics_up_to_their_teeth(points: int, rng: Generator) -> None:
    """Of 40 steps a stroke: all the power of the error is in 2 pi 20 = 126 harmonics, and little beyond."""
    step, phase = 1e-3, 2.0 * np.pi * np.arange(points) / points
    whole = np.zeros(points // 2 + 1)
    for offset in rng.uniform(-0.5, 0.5, 200) * step:
        x = 20.0 * step * np.sin(phase + 1e3 * offset) + offset
        whole += np.abs(np.fft.rfft(np.round(x / step) * step - x) / points) ** 2 / 200.0
    given = variance_by_steps(20.0 * step * np.sin(phase), step, whole.size)
    low = slice(1, min(126, points // 2))
    assert np.mean(whole[low]) == pytest.approx(np.mean(given[low]), rel=0.4)
    assert np.sum(whole) < 1.1 * np.sum(given)


def test_harmonics_that_do_not_exceed_their_scatter_are_dropped(rng: Generator) -> None:
    time = np.arange(4000) / 200.0
    cycle = np.sin(2.0 * np.pi * time) + 0.01 * np.sin(7.0 * 2.0 * np.pi * time)
    false = 0
    for _ in range(20):
        seen = cycle + 0.01 * rng.standard_normal(time.size)
        kept = AverageCycle.of(time, seen, Cycles(1.0, 0.0, 20)).clear
        assert kept[[0, 1, 7]].all()
        false += int(kept.sum()) - 3
    assert false <= 20


@pytest.mark.parametrize("samples", [1000, 977])
def test_steps_that_each_cycle_meets_alike_are_no_motion(samples: int) -> None:
    """They do not scatter at all; a hundred steps a stroke, and a speed to a hundredth of its peak.

    As recorded, it would be off by more than the peak. A drive may distort the motion by as much as the first harmonics
    of the steps, so that these are believed: up to the ninth, (sum h^2)^(1/2) of 2.3e-4 each, or 0.8 %.
    """
    time = np.arange(8 * samples) / samples
    x, v = np.sin(2.0 * np.pi * time + 0.3), 2.0 * np.pi * np.cos(2.0 * np.pi * time + 0.3)
    seen = 0.02 * np.round(x / 0.02)
    average = AverageCycle.of(time, seen, Cycles(1.0, 0.0, 8))
    assert np.max(np.abs(average.motion(average.clear_harmonics)(time)[1] - v)) < 1e-2 * np.max(v)


def test_what_a_drive_adds_below_the_steps_is_known_as_far_as_they_let_it(rng: Generator) -> None:
    """A third harmonic of 0.25 % under steps of 4 %: its error is that which is stated, and never a sure nothing."""
    points, stroke, errors, stated = 400, 4e-3, [], []
    time = np.arange(6 * points) / points
    for _ in range(40):
        phase, step = rng.uniform(0.0, 2.0 * np.pi), stroke * rng.uniform(0.02, 0.06)
        x = stroke * np.sin(2.0 * np.pi * time) + 2.5e-3 * stroke * np.sin(6.0 * np.pi * time + phase)
        zero = step * rng.uniform(-0.5, 0.5)
        average = AverageCycle.of(time, step * np.round((x + zero) / step) - zero, Cycles(1.0, 0.0, 6))
        true = np.fft.rfft(x[:points])[3] / points
        draws = [average.error(rng)[3] for _ in range(50)]
        errors.append(abs(average.clear_harmonics[3] - true) ** 2)
        stated.append(np.mean(np.abs(draws) ** 2))
    assert 0.3 < np.mean(np.array(errors) / np.array(stated)) < 2.0
    assert np.sqrt(np.mean(errors)) < 0.6 * 1.25e-3 * stroke


@pytest.mark.parametrize(
    ("noise", "step"),
    [(1e-3, 0.0), (3e-3, 0.0), (1e-4, 0.01), (1e-4, 0.03)],
    ids=["little noise", "noise", "fine steps", "coarse steps"],
)
def test_the_error_of_a_triangle_is_as_large_as_stated(noise: float, step: float, rng: Generator) -> None:
    """Of its speed, octave by octave: a corner goes on above what noise and steps let be seen of it."""
    points, cycles = 200, 6
    time = np.arange(cycles * points) / points
    order = np.arange(1, 800, 2)
    corner = 1.0 / order**2 / (1.0 + (order / 60.0) ** 2)
    x = (corner[:, None] * np.cos(2.0 * np.pi * order[:, None] * (time + 0.0013))).sum(axis=0)
    harmonics = np.fft.rfft(x[:points]) / points
    errors, stated = [], []
    for _ in range(20):
        seen = x + noise * rng.standard_normal(x.size)
        if step:
            zero = step * rng.uniform(-0.5, 0.5)
            seen = step * np.round((seen + zero) / step) - zero
        average = AverageCycle.of(time, seen, Cycles(1.0, 0.0, cycles))
        size = average.harmonics.size
        speed = (np.arange(size) + 0.0) ** 2
        errors.append(speed * np.abs(average.clear_harmonics - harmonics[:size]) ** 2)
        stated.append(np.mean([speed * np.abs(average.error(rng)[:size]) ** 2 for _ in range(10)], axis=0))
    found, said = np.mean(errors, axis=0), np.mean(stated, axis=0)
    for low in (8, 16, 32, 64):
        octave = slice(low, min(2 * low, found.size))
        assert 0.1 < np.sum(found[octave]) / np.sum(said[octave]) < 3.0, low


def test_a_motion_within_one_step_of_its_channel_has_no_harmonics(rng: Generator) -> None:
    time = np.arange(800) / 100.0
    seen = np.where(np.arange(800) % 100 < 5, 1.0, 0.0)
    average = AverageCycle.of(time, seen, Cycles(1.0, 0.0, 8))
    assert average.resolved == 0
    assert average.corner == 0.0
    assert np.all(np.isfinite(average.error(rng)))


def test_what_noise_hides_is_expected_and_what_it_shows_is_believed(rng: Generator) -> None:
    """Powers drawn from an exponential of mean 1 and seen with an error: their mean, given what was seen."""
    true = rng.exponential(1.0, 400_000)
    for error in (0.1, 1.0, 5.0):
        seen = true + error * rng.standard_normal(true.size)
        given = positive_mean(seen, np.full(true.size, error), np.ones(true.size))
        assert np.mean(given) == pytest.approx(1.0, abs=0.01)
        least = seen < np.quantile(seen, 0.1)
        assert np.mean(given[least]) == pytest.approx(np.mean(true[least]), rel=0.02)
        assert np.mean((given - true) ** 2) < np.mean((np.maximum(seen, 0.0) - true) ** 2)


def test_the_step_of_a_channel_is_that_of_its_values_now() -> None:
    """A user who converts units in place has another channel in the same array."""
    values = np.round(20.0 * np.sin(np.linspace(0.0, 9.0, 500)))
    assert resolution(values) == pytest.approx(1.0)
    values *= 1e-3
    assert resolution(values) == pytest.approx(1e-3)
