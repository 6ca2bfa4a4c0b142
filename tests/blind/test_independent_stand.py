"""The second generator's stand and sensors do what laboratories see: overshoot, drift, hum, a recorded spectrum."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.blind.independent.case import gap_after_refit
from pzd.blind.independent.kernel import BinghamTable, Parameters, integrated
from pzd.blind.independent.stand import (
    CAMPAIGNS,
    SPECTRUM,
    Actuator,
    Chain,
    Driven,
    ErrorsOfTest,
    LaboratoryCampaign,
    LaboratoryTest,
    campaign,
    coloured,
    driven,
    sensed_force,
    stamped,
    warmed,
)
from pzd.record import Array

EXACT = Actuator(natural_frequency=40.0, damping_ratio=0.7, even=0.0, odd=0.0, wander=0.0)
BASE = BinghamTable((0.0,), (200.0,), (2000.0,), (4e5,))
NO_ERRORS = ErrorsOfTest(gain=0.0, offset=0.0, drift=0.0, delay=0.0, position=0.0)
QUIET = Chain(
    white=0.0, recorded=0.0, hum=0.0, mains=50.0, displacement_noise=0.0, displacement_zero=0.0, force_step=1e-6,
    displacement_step=1e-9, clock=1e-4,
)  # fmt: skip


def one(test: LaboratoryTest, actuator: Actuator, rng: np.random.Generator) -> Driven:
    return driven(LaboratoryCampaign((test,), (0.0,), 1000.0), test, actuator, rng)


def test_a_campaign_is_sampled_within_its_bounds(rng: np.random.Generator) -> None:
    for name in CAMPAIGNS:
        for draw in rng.spawn(5):
            run = campaign(name, draw)
            assert run.rate == 500.0 or run.rate * sum(t.seconds for t in run.tests) <= 40_000
            assert run.one_frequency == (name == "one_frequency")
            assert {t.value for t in run.tests if t.signal == "constant"} == set(run.values)


def test_velocity_and_acceleration_are_those_of_the_displacement(rng: np.random.Generator) -> None:
    motion = one(LaboratoryTest("sine", 0.02, 2.0, 4), EXACT, rng)
    late, omega = motion.time > 0.0, 4.0 * np.pi
    x = motion.displacement[late]
    assert np.max(np.abs(motion.acceleration[late] + omega**2 * x)[2:-2]) < 1e-3 * omega**2 * 0.02
    assert np.max(np.abs(motion.velocity[late])) == pytest.approx(omega * np.max(np.abs(x)), rel=1e-3)
    assert np.all(np.diff(motion.time[motion.recorded]) == pytest.approx(1e-3))


def test_a_loop_of_little_damping_overshoots_the_corner_of_a_triangle(rng: np.random.Generator) -> None:
    """A ramp that turns round: the error of a loop of second order swings by exp(-pi z/sqrt(1 - z^2)) of itself."""
    asked = LaboratoryTest("triangle", 0.02, 1.0, 4)
    speeds = {
        z: np.abs(one(asked, Actuator(15.0, z, 0.0, 0.0, 0.0), rng).velocity[-8000:]).max() / 0.08 for z in (0.35, 1.0)
    }
    swing = np.exp(-np.pi * 0.35 / np.sqrt(1.0 - 0.35**2))
    assert speeds[0.35] == pytest.approx(1.0 + 2.0 * swing, abs=0.02)  # the speed steps by twice itself
    assert speeds[1.0] == pytest.approx(1.0, abs=0.01)


def test_a_sweep_ends_at_its_frequency(rng: np.random.Generator) -> None:
    motion = one(LaboratoryTest("sweep", 0.01, 5.0, 12), EXACT, rng)
    end = motion.time > 11.0
    crossings = np.count_nonzero(np.diff(np.sign(motion.displacement[end])) != 0)
    assert crossings == pytest.approx(2 * 4.55, abs=1)  # a second before its end it swings at 5 Hz x 10^(-1/12)


def test_noise_has_the_recorded_spectrum(rng: np.random.Generator) -> None:
    from scipy.signal import welch

    frequency, density = welch(coloured(400_000, 1e-3, rng), 1000.0, nperseg=8000)
    for wanted, level in SPECTRUM[1:]:
        near = np.abs(np.log(frequency[1:] / wanted)) < 0.1
        assert np.mean(density[1:][near]) == pytest.approx(level, rel=0.25)


def test_hum_gain_offset_and_drift_are_what_they_say(rng: np.random.Generator) -> None:
    t = np.arange(4000) / 1000.0
    force = 500.0 * np.sin(2.0 * np.pi * t)
    errors = ErrorsOfTest(gain=0.01, offset=3.0, drift=4.0, delay=0.0, position=0.0)
    assert np.allclose(sensed_force(t, force, 500.0, QUIET, NO_ERRORS, rng), force, atol=1e-6)
    shown = sensed_force(t, force, 500.0, QUIET, errors, rng) - 1.01 * force
    assert shown[[0, -1]] == pytest.approx([3.0, 7.0])
    humming = Chain(**{**QUIET.__dict__, "hum": 0.002})
    line = np.abs(np.fft.rfft(sensed_force(t, force, 500.0, humming, NO_ERRORS, rng) - force)) / t.size * 2.0
    assert line[200] == pytest.approx(1.0, rel=1e-3)  # 0.2 % of 500 N at 50 Hz
    assert np.all(np.diff(stamped(t + 3.7e-5, QUIET)) > 0.0)


def test_heat_is_the_work_that_has_not_gone_off_yet(rng: np.random.Generator) -> None:
    motion = one(LaboratoryTest("sine", 0.02, 2.0, 20), EXACT, rng)
    force = 2000.0 * motion.velocity[::2]
    (temperature,) = warmed([motion], [force], 20.0, 100.0)
    work = float(np.sum(force * motion.velocity[::2]) * (motion.time[2] - motion.time[0]))
    assert 0.9 * work / 100.0 < temperature[-1] - 20.0 < work / 100.0
    assert np.all(np.diff(temperature) > -1e-4)


def forces_of(motion: Driven, factor: float = 1.0, **laws: float) -> Array:
    base = tuple(factor * np.full_like(motion.time, row[0]) for row in (BASE.T0, BASE.C, BASE.k))
    return integrated(motion.time, motion.kinematics, base, Parameters(**laws))


def test_a_damper_with_other_parameters_leaves_no_gap(rng: np.random.Generator) -> None:
    motion = one(LaboratoryTest("sine", 0.02, 2.0, 3), EXACT, rng)
    force = forces_of(motion, 1.3)
    assert gap_after_refit([motion], [force], BASE) < 1e-4
    ripple = force + 0.02 * np.max(force) * np.sin(600.0 * motion.time[::2])
    assert gap_after_refit([motion], [ripple], BASE) == pytest.approx(0.02 / np.sqrt(2.0), rel=0.1)


def test_what_parameters_of_every_temperature_follow_is_no_gap(rng: np.random.Generator) -> None:
    """As identify gives T0, C and k by voltage and temperature, a drift between tests is no missing effect."""
    motion = one(LaboratoryTest("sine", 0.02, 2.0, 3), EXACT, rng)
    motions, forces = [motion, motion], [forces_of(motion), forces_of(motion, 0.8)]
    assert gap_after_refit(motions, forces, BASE) > 0.03
    assert gap_after_refit(motions, forces, BASE, temperatures=[21.0, 22.5]) > 0.03
    assert gap_after_refit(motions, forces, BASE, temperatures=[21.0, 25.0]) < 1e-4


def test_a_relief_valve_that_is_always_open_is_no_gap(rng: np.random.Generator) -> None:
    """From T0 on the oil flows through it alone: a Bingham element with C_r, a twentieth of C."""
    motion = one(LaboratoryTest("sine", 0.02, 2.0, 3), EXACT, rng)
    force = forces_of(motion, F_r=float(BASE.T0[0]), C_r=0.05 * float(BASE.C[0]))
    assert np.max(np.abs(force - forces_of(motion))) > 0.2 * np.max(force)
    assert gap_after_refit([motion], [force], BASE) < 1e-4
