"""Misfit of a record that does not repeat is told from noise, whatever the colour of the noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.random import Generator
from scipy.signal import lfilter

from pzd.record import Array, Record
from pzd.signals.lack_of_fit import fit_smooth_residual

RATE, DURATION, DRAWS = 500.0, 12.0, 40
SIZE = 20.0
"""Standard deviation of the noise [N]."""


def sweep() -> tuple[Record, Array]:
    """A sweep from 0.5 to 4 Hz, and a force with friction for it."""
    t = np.arange(round(DURATION * RATE)) / RATE
    phase = 2.0 * np.pi * (0.5 * t + 0.5 * 3.5 / DURATION * t**2)
    x = 0.012 * np.sin(phase)
    v = np.gradient(x, t)
    force = 500.0 * np.tanh(v / 0.01) + 2500.0 * v
    return Record("sweep", None, t, x, v, np.gradient(v, t), force, None), force


@pytest.mark.parametrize("follows", [0.0, 0.9, 0.97])
def test_the_false_alarm_rate_of_the_smooth_residual_holds_for_noise_of_any_colour(
    follows: float, rng: Generator
) -> None:
    """Of slow noise, two in three were once said to be beyond one chance in ten."""
    record, force = sweep()
    drawn = rng.standard_normal((DRAWS, force.size + 500))
    noise = lfilter([1.0], [1.0, -follows], drawn, axis=1)[:, 500:] * SIZE * np.sqrt(1.0 - follows**2)
    everything = np.ones(force.size, dtype=np.bool_)
    found = np.array([fit_smooth_residual(each, record, force, everything).probability for each in noise])
    assert np.mean(found < 0.1) < 0.1 + 4.0 * np.sqrt(0.1 * 0.9 / DRAWS)
    assert np.min(found) > 1e-4


@pytest.mark.parametrize("follows", [0.0, 0.9])
def test_a_force_quadratic_in_the_speed_is_found_below_the_noise(follows: float, rng: Generator) -> None:
    """A damping that grows with the square of the speed, of half the size of the noise."""
    record, force = sweep()
    drawn = lfilter([1.0], [1.0, -follows], rng.standard_normal(force.size)) * SIZE * np.sqrt(1.0 - follows**2)
    missed = record.velocity * np.abs(record.velocity)
    missed *= 0.5 * SIZE / np.std(missed)
    everything = np.ones(force.size, dtype=np.bool_)
    found = fit_smooth_residual(drawn + missed, record, force, everything)
    assert found.probability < 1e-6
    assert np.mean(found.explained**2 - found.spread) == pytest.approx(np.mean(missed**2), rel=0.5)


@pytest.mark.parametrize("follows", [0.88, 0.9, 0.92])
def test_the_smooth_model_explains_no_more_power_than_the_noise_has(follows: float, rng: Generator) -> None:
    """Behind a ramp lags differ in the first samples alone, which say next to nothing: 2300 N were told of 20 N."""
    record, force = sweep()
    voltage = 150.0 * record.time / DURATION
    noise = lfilter([1.0], [1.0, -follows], rng.standard_normal(force.size)) * SIZE * np.sqrt(1.0 - follows**2)
    counted = record.time > 0.16
    found = fit_smooth_residual(noise[counted], replace(record, voltage=voltage), force[counted], counted)
    assert np.mean(found.explained**2) < np.mean(noise[counted] ** 2)
    assert found.noise.variance == pytest.approx(np.var(noise), rel=0.5)


def test_errors_of_the_motion_that_change_no_force_change_no_probability(rng: Generator) -> None:
    """Friction alone beside a rigid oil spring: the judgement once ended in a division by zero."""
    record, _ = sweep()
    force, everything = 500.0 * np.sign(record.velocity), np.ones(record.time.size, dtype=np.bool_)
    residual = SIZE * rng.standard_normal(force.size)
    known, drawn = (fit_smooth_residual(residual, record, force, everything, d) for d in ((), [(record, force)] * 5))
    assert drawn.probability == pytest.approx(known.probability)
    assert drawn.excess == pytest.approx(known.excess)


def test_noise_of_the_displacement_is_no_misfit_of_a_viscous_force(rng: Generator) -> None:
    """Velocities that are noisy below 10 Hz are in the force and in the terms: 10^-26 was once said of one."""
    record, _ = sweep()
    everything, damping = np.ones(record.time.size, dtype=np.bool_), 2500.0

    def noisy(amplitude: float) -> Record:
        spectrum = np.fft.rfft(amplitude * rng.standard_normal(record.time.size))
        spectrum[np.fft.rfftfreq(record.time.size, 1.0 / RATE) > 10.0] = 0.0
        v = record.velocity + np.gradient(np.fft.irfft(spectrum, record.time.size), record.time)
        return replace(record, velocity=v, acceleration=np.gradient(v, record.time))

    found = []
    for _ in range(12):
        seen = noisy(1e-5)
        drawn = [replace(seen, velocity=seen.velocity + noisy(1e-5).velocity - record.velocity) for _ in range(6)]
        measured = damping * record.velocity + 0.2 * rng.standard_normal(record.time.size)
        predicted = damping * seen.velocity
        others = [(each, damping * each.velocity) for each in drawn]
        found.append(fit_smooth_residual(measured - predicted, seen, predicted, everything, others))
    assert min(each.probability for each in found) > 1e-4
    assert np.median([np.mean(each.explained**2 - each.spread) for each in found]) < 0.2**2

    missed = 0.01 * damping * record.velocity * np.abs(record.velocity) / np.max(record.velocity)
    seen_too = fit_smooth_residual(measured + missed - predicted, seen, predicted, everything, others)
    assert seen_too.probability < 1e-6  # the force is half a per cent of peak, that of the displacement's noise a tenth


# --- Short records: few samples of a motion that no cycle repeats


def short(samples: int) -> tuple[Record, Array]:
    """Two periods of a slow sine and a force with friction for it, in so many samples."""
    t = np.linspace(0.0, 1.9, samples)
    x = 0.018 * np.sin(2.0 * np.pi * 1.05 * t)
    v = np.gradient(x, t)
    force = 20.0 * np.tanh(v / 0.01) + 1100.0 * v
    return Record("short", None, t, x, v, np.gradient(v, t), force, None), force


@pytest.mark.parametrize("samples", [64, 142, 300, 700])
@pytest.mark.parametrize("follows", [0.0, 0.6])
def test_false_alarms_of_short_records_are_rare(samples: int, follows: float, rng: Generator) -> None:
    """With the samples for degrees of freedom, however coloured, 3 % of such noise were below one in a thousand."""
    record, force = short(samples)
    drawn = lfilter([1.0], [1.0, -follows], rng.standard_normal((400, samples + 300)), axis=1)[:, 300:] * SIZE
    everything = np.ones(samples, dtype=np.bool_)
    found = np.array([fit_smooth_residual(each, record, force, everything).probability for each in drawn])
    assert np.mean(found < 1e-3) < 0.02


@pytest.mark.parametrize("samples", [64, 142, 300])
def test_a_constant_force_that_a_short_record_misses_is_found(samples: int, rng: Generator) -> None:
    """A damper was called complete that missed 55 N of 130: too short for 33 terms, the record was not judged."""
    record, force = short(samples)
    missed = SIZE * rng.standard_normal(samples) - 10.0 * SIZE
    found = fit_smooth_residual(missed, record, force, np.ones(samples, dtype=np.bool_))
    assert found.probability < 1e-6
    assert np.mean(found.explained) == pytest.approx(-10.0 * SIZE, rel=0.05)


def test_stretches_too_short_for_the_colour_of_their_noise_are_judged_without(rng: Generator) -> None:
    """Whitening reaches over more samples than a stretch has: nothing was left, and the judgement ended in a fault."""
    record, force = short(200)
    counted = np.arange(200) % 6 < 5
    slow = np.cumsum(SIZE * rng.standard_normal(200))[counted]
    found = fit_smooth_residual(slow, record, force[counted], counted)
    assert 0.0 <= found.probability <= 1.0
