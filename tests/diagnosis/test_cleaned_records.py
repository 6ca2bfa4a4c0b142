"""Preparation of records: cleaned displacement and temperature, and the split into roles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.random import Generator
from synthetic import damper_of, sine, sines

from pzd.blind.independent import stand
from pzd.blind.independent.stand import Actuator, LaboratoryCampaign, LaboratoryTest, MotionKind
from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.cleaned_records import clean
from pzd.diagnosis.fit.prediction import displacement_variance, predict, predicted_force
from pzd.diagnosis.gap import check_residual, visible_gap
from pzd.diagnosis.roles import HELD_OUT, TRAINING, split
from pzd.record import Array, Record
from pzd.signals.noise import pure_error
from pzd.signals.nuisance import NuisanceConfig
from tests.studies.plain_damper import plain_force


@pytest.mark.parametrize("channel", ["force", "velocity", "displacement"])
def test_something_of_the_largest_force_speed_and_displacement_is_fitted(
    rng: np.random.Generator, channel: str
) -> None:
    # Two tests: the fast one holds the largest force and speed, the slow one the largest displacement.
    tests = ((0.5, 0.03), (2.5, 0.02))
    cleaned = clean(sines(damper_of((0.0,)), rng, (0.0,), tests=tests, cycles=4))
    roles = split(cleaned, None, 2.0).roles
    peaks = [float(np.max(np.abs(getattr(p.record, channel)))) for p in cleaned]
    fitted = [peak for peak, role in zip(peaks, roles, strict=True) if np.any(role == TRAINING)]
    assert max(fitted) > 0.95 * max(peaks)
    assert any(np.any(role == HELD_OUT) for role in roles)


# --- Corners of a triangle: sharper than any harmonic that stands clear of the noise


RATE, FINER, FREQUENCY, CYCLES = 500.0, 16, 0.25, 4
STIFF = Damper(base=(BaseRow(voltage_V=0.0, T0_N=240.0, C_Ns_per_m=1200.0, k_N_per_m=1.1e6),))


def triangle(noise: float, rng: np.random.Generator) -> tuple[Record, Array]:
    """A slow triangle of an actuator whose loop has 25 Hz, its displacement noisy; and the force without noise."""
    from scipy.signal import bilinear, lfilter

    step, w = 1.0 / (RATE * FINER), 2 * np.pi * 25.0
    fine = np.arange(-2.0 / FREQUENCY, CYCLES / FREQUENCY, step)
    x = lfilter(*bilinear([w * w], [1.0, 1.2 * w, w * w], 1.0 / step), 0.04 / np.pi * np.arcsin(
        np.sin(2 * np.pi * FREQUENCY * fine)))  # fmt: skip
    v = np.gradient(x, step)
    motion = Motion(fine, x, v, np.gradient(v, step), np.zeros_like(fine))
    t, x, v, a, force = (c[::FINER] for c in (fine, x, v, motion.acceleration, respond(STIFF, motion)))
    keep = t >= 0.0
    t, x, v, a, force = t[keep], x[keep], v[keep], a[keep], force[keep]
    seen = x + noise * rng.standard_normal(t.size)
    return Record("triangle", None, t, seen, v, a, force + 0.5 * rng.standard_normal(t.size), np.zeros(t.size)), force


def test_the_force_reverses_at_the_corners_of_a_triangle(rng: np.random.Generator) -> None:
    """13 um of noise in four cycles through 1.1 kN/mm are 7 N, of 300 N, and the harmonics that stand clear miss 40."""
    record, force = triangle(13e-6, rng)
    (cleaned,) = clean((record,))
    cycle = cleaned.cycles
    assert cycle is not None
    inside = cycle.inside(record.time)
    missed = cycle.fold(record.time[inside], force[inside]).mean(axis=0)
    missed = cycle.fold(cleaned.record.time, predicted_force(STIFF, cleaned)).mean(axis=0) - missed
    assert np.std(missed) < 2.0  # 3.2 where only harmonics of the whole cycle are kept


def test_what_the_acceleration_has_beyond_the_sampling_rate_does_not_fold_into_its_harmonics(
    rng: np.random.Generator,
) -> None:
    # Of the inertia of a rod: at a corner it has as much at every order, and the noise of a triangle was 90 times that.
    (cleaned,) = clean((triangle(1e-6, rng)[0],))
    known, *others = cleaned.draws
    points = known.time.size // 2
    odd = np.arange(1, 40, 2)
    own, *drawn = (np.fft.rfft(each.acceleration[points:])[odd] / points for each in (known, *others))
    error = np.sqrt(np.mean(np.abs(np.array(drawn) - own) ** 2, axis=0))
    assert np.all(error < 0.01 * np.abs(own))


def test_a_triangle_without_noise_is_predicted_exactly(rng: np.random.Generator) -> None:
    record, force = triangle(1e-9, rng)
    (cleaned,) = clean((record,))
    cycle = cleaned.cycles
    assert cycle is not None
    assert predicted_force(STIFF, cleaned)[:100] == pytest.approx(force[cycle.inside(record.time)][:100], abs=0.5)


# --- Temperature of the fluid in a test over which it warms by less than a kelvin


WARMS_BY = 0.45
"""Over the test [K]."""
NOISE = 0.05
"""Of the sensor [K], a sample."""


def warming(rng: Generator) -> tuple[Record, Array]:
    """A sine at 0 V in which the damper of Table 2 warms, without noise of the force; and its true temperature."""
    still = sine(damper_of((0.0,)), 0.0, 1.0, 0.02, rng, noise=0.0, cycles=8)
    truth = 22.0 + WARMS_BY * still.time / still.time[-1]
    motion = Motion(still.time, still.displacement, still.velocity, still.acceleration, still.voltage, truth)
    record = replace(
        still,
        force=respond(drifting(), motion, float(still.force[0])),
        temperature=truth + NOISE * rng.standard_normal(truth.size),
    )
    return record, truth


def drifting() -> Damper:
    """The damper of Table 2 at 0 V, whose oil loses 6 % a kelvin."""
    betas = {"temperature_drift": {"beta_T0": 0.06, "beta_C": 0.06}}
    return Damper(base=damper_of((0.0,)).base, effects=betas, reference_temperature_degC=22.0)


def test_the_temperature_is_that_of_the_oil_at_the_ends_too(rng: Generator) -> None:
    """Each end is one noisy sample; a smoothing that goes through it is wrong there for a second."""
    for _ in range(8):
        record, truth = warming(rng)
        (cleaned,) = clean((record,))
        temperature = cleaned.record.temperature
        assert temperature is not None
        away = np.abs(temperature - np.interp(cleaned.record.time, record.time, truth))
        assert float(np.max(away)) < 0.4 * NOISE


def test_the_predicted_force_falls_as_the_oil_warms(rng: Generator) -> None:
    record, _ = warming(rng)
    (cleaned,) = clean((record,))
    assert cleaned.cycles is not None
    forces = cleaned.record.force, predicted_force(drifting(), cleaned)
    measured, predicted = (
        np.abs(np.fft.rfft(cleaned.cycles.fold(cleaned.record.time, force), axis=1)[:, 1]) for force in forces
    )
    assert measured[-1] / measured[0] == pytest.approx(1.0 - 0.06 * WARMS_BY * 7 / 8, abs=0.004)
    np.testing.assert_allclose(predicted, measured, rtol=2e-3)


@pytest.mark.parametrize(
    ("rate", "frequency", "left"), [(1000.0, 0.5, 250.0), (1000.0, 2.0, 500.0), (400.0, 0.5, 400.0)]
)
def test_a_test_in_which_the_damper_warms_has_as_many_samples_a_cycle_as_its_law_needs(
    rate: float, frequency: float, left: float, rng: Generator
) -> None:
    """Each counts by itself there: of five tests at 1 kHz no diagnosis came within five minutes."""
    still = sine(damper_of((0.0,)), 0.0, frequency, 0.02, rng, noise=0.0, cycles=6, rate=rate)
    still = replace(still, temperature=np.full(still.time.size, 22.0))
    warm = replace(still, temperature=22.0 + 2.0 * still.time / still.time[-1])
    (alike,), (warming_up,) = clean((still,)), clean((warm,))
    assert alike.record.rate == pytest.approx(rate)
    assert warming_up.record.rate == pytest.approx(left)
    at = warming_up.record.time
    assert clean((warm,), every_sample=True)[0].record.rate == pytest.approx(rate)
    predicted = [predicted_force(damper_of((0.0,)), each) for each in (alike, warming_up)]
    peak = float(np.max(np.abs(predicted[0])))
    both = (at >= alike.record.time[0]) & (at <= alike.record.time[-1])  # either may leave out a cycle that settles
    same = np.interp(at[both], alike.record.time, predicted[0])
    np.testing.assert_allclose(predicted[1][both], same, atol=2e-3 * peak)


def test_hum_of_the_mains_folds_into_no_force_of_a_test_that_is_thinned(rng: Generator) -> None:
    """Every fourth sample of 1 kHz made of 5 N at 250 Hz, a harmonic of 50 Hz, a preload of 4.8 N."""
    still = sine(damper_of((0.0,)), 0.0, 0.5, 0.02, rng, noise=0.0, cycles=6)
    hum = 5.0 * np.cos(2.0 * np.pi * 250.0 * still.time)
    warm = replace(still, force=still.force + hum, temperature=22.0 + 2.0 * still.time / still.time[-1])
    (cleaned,) = clean((warm,))
    assert cleaned.record.rate == pytest.approx(250.0)
    assert cleaned.cycles is not None
    left = cleaned.cycles.mean(cleaned.record.time, cleaned.record.force)
    assert abs(float(np.mean(left)) - float(np.mean(still.force[: still.time.size // 2000 * 2000]))) < 0.5


# --- Steps and noise of a displacement that does not repeat, or repeats with its steps


SWEEP_RATE = 1000.0


def swept(step: float, noise: float, rng: Generator) -> tuple[Record, Array]:
    """A sweep from 0.5 to 3 Hz, read in steps [m] and with noise [m]; and its true velocity."""
    t = np.arange(0.0, 10.0, 1.0 / SWEEP_RATE)
    phase = 2.0 * np.pi * (0.5 * t + 0.125 * t**2)
    x, rate = 0.003 * np.sin(phase), 2.0 * np.pi * (0.5 + 0.25 * t)
    seen = x + noise * rng.standard_normal(t.size)
    seen = np.round(seen / step) * step if step else seen
    v = 0.003 * rate * np.cos(phase)
    return Record("sweep", None, t, seen, v, np.gradient(v, t), v, None), v


@pytest.mark.parametrize(("step", "noise"), [(1.1e-4, 0.0), (1.1e-4, 2e-6), (0.0, 1e-5), (2e-5, 5e-6)])
def test_the_error_of_a_sweep_is_as_large_as_that_of_the_others_drawn(
    step: float, noise: float, rng: Generator
) -> None:
    """Read in 55 steps a stroke: the error of a step is no white noise, and its lines were once taken for motion."""
    record, true = swept(step, noise, rng)
    (cleaned,) = clean((record,))
    assert cleaned.cycles is None
    kept, others = cleaned.draws[0], cleaned.draws[1:]
    inside = slice(500, -500)
    own = np.std((kept.velocity - true)[inside])
    drawn = np.mean([np.std((each.velocity - kept.velocity)[inside]) for each in others])
    assert own < 0.02 * np.max(true)
    assert 0.3 < own / drawn < 3.0


# --- What noise of the displacement makes of the force: no gap, whatever the motion


@pytest.mark.parametrize("kind", ["sweep", "random"])
def test_noise_of_the_displacement_is_no_gap_in_motions_that_do_not_repeat(kind: MotionKind, rng: Generator) -> None:
    """Ten micrometres on a viscous damper at 200 Hz."""
    test = LaboratoryTest(kind, 0.008, 1.5, 12)
    campaign = LaboratoryCampaign((test,), (0.0,), 200.0)
    motion = stand.driven(campaign, test, Actuator.drawn(rng), rng)
    at = motion.recorded
    force = plain_force(motion.time, motion.displacement, 0.0, 7000.0, 1e-8)
    reading = np.interp(motion.time[at], motion.time[::2], force)
    reading = reading + 1e-3 * np.max(np.abs(reading)) * rng.standard_normal(at.size)
    x = motion.displacement[at] + 1e-5 * rng.standard_normal(at.size)
    v = np.gradient(x, motion.time[at])
    record = Record(kind, None, motion.time[at], x, v, np.gradient(v, motion.time[at]), reading, None)
    (cleaned,) = clean((record,))
    plain = Damper(base=(BaseRow(T0_N=0.0, C_Ns_per_m=7000.0, k_N_per_m=1e8),))
    wanted = np.ones(cleaned.record.time.size, dtype=np.bool_)
    check = check_residual(predict(plain, cleaned, 5e-4), cleaned, wanted, NuisanceConfig())
    assert check.probability["smooth"][0] > 1e-4
    assert visible_gap([check]) < 0.0025


@pytest.mark.parametrize("rate", [200.0, 1000.0, 5000.0])
def test_steps_that_each_cycle_meets_at_the_same_places_are_no_motion(rate: float, rng: Generator) -> None:
    """Averaging removes nothing of their error of 0.29 steps r.m.s.; only its share in a few harmonics may stay.

    Those are the motion's own, and the first ones that a drive may have added as much to.
    """
    kept = []
    for one in rng.spawn(10):
        frequency, steps = float(one.choice([0.5, 1.0, 2.0])), one.uniform(25.0, 400.0)
        t = np.arange(0.0, 6.0 / frequency, 1.0 / rate)
        x, step = 0.02 * np.sin(2.0 * np.pi * frequency * t), 0.04 / steps
        (cleaned,) = clean((Record("steps", None, t, step * np.round(x / step), x, x, x),))
        assert cleaned.cycles is not None
        true = 0.02 * np.sin(2.0 * np.pi * frequency * cleaned.record.time)
        kept.append(float(np.std(cleaned.record.displacement - true)) / (step / np.sqrt(12.0)))
    assert np.median(kept) < 0.3
    assert np.mean(np.array(kept) < 0.5) >= 0.9


# --- An uneven clock


@pytest.mark.parametrize("draw", range(6))
def test_a_clock_that_is_uneven_and_says_so_is_no_gap(draw: int, rng: Generator) -> None:
    """Parts of a record have not quite the same usual step, and so not the same number of points a cycle."""
    from scipy.interpolate import CubicSpline

    damper = damper_of((0.0,))
    even = sine(damper, 0.0, 1.0 + 0.1 * draw, 0.02, rng, noise=1e-3, colour=0.0, rate=2000.0, displacement_noise=1e-6)
    stamps = even.time[::4]
    time = np.unique(np.round(stamps + 5e-4 * rng.standard_normal(stamps.size), 5))
    time = time[(time > even.time[0]) & (time < even.time[-1])]
    channels = CubicSpline(even.time, np.stack([even.displacement, even.velocity, even.acceleration, even.force]).T)
    x, v, a, force = channels(time).T
    (cleaned,) = clean((Record("uneven", None, time, x, v, a, force, np.zeros(time.size)),))
    everything = np.ones(cleaned.record.time.size, dtype=np.bool_)
    check = check_residual(predict(damper, cleaned, 5e-4), cleaned, everything, NuisanceConfig())
    assert np.sqrt(max(check.power, 0.0)) < 0.0025 * check.peak
    assert cleaned.average is not None
    # As for the fit, which folds a part of the record: its step may be another one.
    fewer = replace(cleaned.average.run, count=2)
    part = replace(cleaned, cycles=replace(fewer, period=fewer.period * (1.0 - 2.0 / cleaned.average.points)))
    assert np.size(displacement_variance(damper, part)) == pure_error(part.folded).single.size
