"""The gap of a record: its size, its share of noise, and what jumps and left-out samples make of it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.random import Generator
from numpy.typing import NDArray
from synthetic import TABLE_2, damper_of, sine

from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.cleaned_records import clean
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.fit.prediction import predict
from pzd.diagnosis.gap import (
    ResidualCheck,
    check_residual,
    gap_in_force,
    gap_with_nuisances,
    held_out_criterion,
    regions,
    visible_gap,
)
from pzd.diagnosis.roles import Split
from pzd.diagnosis.search.acceptance import leaves_gap
from pzd.record import Array, Record, sliced
from pzd.signals.jumps import gradient_within_stretches, has_predecessors, jumps, split_at_gaps
from pzd.signals.kinematics import kinematics
from pzd.signals.noise import autoregression
from pzd.signals.nuisance import NuisanceConfig, nuisance_columns

SOFT, HARD = 100.0, 1000.0
"""Peak forces of two tests [N]."""
BEFORE = (30.0, 100.0)
"""Gap of either, r.m.s. [N]: 30 % of the soft one's peak, 10 % of the hard one's."""


def checks(gaps: tuple[float, float]) -> list[Any]:
    """The two tests with such gaps."""
    wanted = np.ones(1000, dtype=np.bool_)
    return [SimpleNamespace(power=g**2, peak=p, wanted=wanted) for g, p in zip(gaps, (SOFT, HARD), strict=True)]


def refused(left: tuple[float, float]) -> str | None:
    """What is said of a candidate that leaves such gaps."""
    evidence = SimpleNamespace(gap_is_significant=lambda *_: True, campaign=SimpleNamespace(checks=checks))
    before, candidate = SimpleNamespace(damper=BEFORE), SimpleNamespace(fitted=SimpleNamespace(damper=left))
    return leaves_gap(cast("Any", evidence), DiagnoseConfig(), cast("Any", before), cast("Any", candidate))


def test_the_gap_counts_by_each_peak_or_by_force() -> None:
    assert visible_gap(checks(BEFORE)) == pytest.approx(np.sqrt((0.3**2 + 0.1**2) / 2.0))
    assert gap_in_force(checks(BEFORE)) == pytest.approx(np.sqrt((30.0**2 + 100.0**2) / 2.0))


@pytest.mark.parametrize("left", [(30.0, 30.0), (20.0, 100.0), (1.0, 1.0)])
def test_closing_a_fifth_by_either_count_is_enough(left: tuple[float, float]) -> None:
    assert refused(left) is None


@pytest.mark.parametrize("left", [(29.0, 98.0), (32.0, 30.0), (10.0, 110.0)])
def test_little_corrections_and_what_widens_the_gap_by_either_count_are_refused(left: tuple[float, float]) -> None:
    assert refused(left) is not None


# --- Noise floor: what counts as noise never exceeds the gap


QUIET = 0.3 / 1500.0
"""Noise of 0.3 N on a peak of 1500 N."""
NOBODY = Split((), (), "records")


def checked(
    true: Damper, assumed: Damper, rng: np.random.Generator, rate: float, cycles: float, frequency: float = 1.0
) -> ResidualCheck:
    record = sine(true, 0.0, frequency, 0.02, rng, noise=QUIET, colour=0.0, rate=rate, cycles=cycles)
    (cleaned,) = clean([record])
    given = predict(assumed, cleaned, NuisanceConfig().delay_s)
    return check_residual(given, cleaned, np.ones(cleaned.record.time.size, np.bool_), NuisanceConfig())


def rigid(friction: float, **effects: dict[str, float]) -> Damper:
    row = BaseRow(voltage_V=0.0, T0_N=friction, C_Ns_per_m=2500.0, k_N_per_m=1e8)
    return Damper(base=(row,), effects=dict(effects))


def test_octaves_hold_no_more_of_the_gap_than_the_tests_that_have_cycles(rng: np.random.Generator) -> None:
    """Their noise was divided among octaves as if it were the gap, which lay in a motion that never repeats."""
    plain, turbulent = rigid(300.0), rigid(300.0, orifice_quadratic={"q": 5000.0})
    within, outside = checked(plain, plain, rng, 500.0, 8.0), checked(turbulent, plain, rng, 500.0, 1.9)
    assert within.cleaned.cycles is not None
    assert outside.cleaned.cycles is None
    octaves = [each.share_of_gap for each in regions([within, outside], "V") if each.region.endswith("Hz in the force")]
    assert sum(octaves) < 0.1


@pytest.mark.parametrize("rate", [200.0, 1000.0])
@pytest.mark.parametrize("cycles", [2.6, 8.0])
def test_the_noise_floor_is_no_larger_than_what_is_left_by_the_damper_itself(
    rng: np.random.Generator, rate: float, cycles: float
) -> None:
    """Few cycles scatter more than they leave, and what chance does beside jumps of dry friction is no noise at all."""
    for effects in ({}, {"preload_offset": {"F_0": 300.0}}):
        true = rigid(300.0, **effects)
        for _ in range(3):
            gap = held_out_criterion([checked(true, true, rng, rate, cycles)], NOBODY)
            assert 0.5 * gap.after < gap.noise_floor <= gap.after


def test_what_the_model_misses_is_not_reported_as_noise(rng: np.random.Generator) -> None:
    judged = checked(damper_of((0.0,), preload_offset={"F_0": 300.0}), damper_of((0.0,)), rng, 1000.0, 8.0)
    gap = held_out_criterion([judged], NOBODY)
    # What remains is the offset that the test may have of its own, 3.5 times 0.5 % of its peak: a hundredth of 300 N.
    assert gap.noise_floor < 0.05 * gap.after


@pytest.mark.parametrize("gain", [0.995, 1.005, 1.02])
def test_what_a_gain_of_the_test_takes_stands_beside_the_noise(rng: np.random.Generator, gain: float) -> None:
    """Of a load cell that is off by a few per mill of a force: its square of the squares of the force."""
    true = rigid(300.0)
    record = sine(true, 0.0, 1.0, 0.02, rng, noise=QUIET, colour=0.0, rate=1000.0, cycles=8.0)
    (cleaned,) = clean([replace(record, force=gain * record.force)])
    given = predict(true, cleaned, NuisanceConfig().delay_s)
    judged = check_residual(given, cleaned, np.ones(record.time.size, np.bool_), NuisanceConfig())
    gap = held_out_criterion([judged], NOBODY)
    load = np.sqrt(np.mean(record.force**2)) / np.max(np.abs(record.force))
    assert gap_with_nuisances([judged]) == pytest.approx(abs(1.0 - 1.0 / gain) * load, rel=0.05)
    assert visible_gap([judged]) < 0.1 * gap_with_nuisances([judged])
    assert gap.tests_own == pytest.approx((1.0 - 1.0 / gain) ** 2, rel=0.05)
    noise = QUIET * np.max(np.abs(record.force))
    assert gap.noise_floor - gap.tests_own == pytest.approx(noise**2 / np.mean(record.force**2), rel=0.1)


@pytest.mark.parametrize("rate", [200.0, 1000.0])
def test_what_a_test_explains_of_itself_is_no_more_than_there_is(rng: np.random.Generator, rate: float) -> None:
    """Of a force 2 ms late; where it jumps, its slope times the delay says anything up to the jump and back."""
    for frequency in (0.5, 2.0):
        late = rigid(300.0, sensor_delay={"tau": 0.002})
        judged = checked(late, rigid(300.0), rng, rate, 8.0, frequency)
        residual, nuisances = judged.residual[judged.wanted], judged.nuisances[judged.wanted]
        left = judged.cleared[judged.wanted]
        assert left @ left < residual @ residual
        assert nuisances @ nuisances <= 1.02 * residual @ residual  # a jump lies between two samples


@pytest.mark.parametrize("rate", [200.0, 500.0])
@pytest.mark.parametrize("delay", [0.0005, 0.001])
def test_a_delay_that_any_test_may_have_is_no_gap_where_a_rigid_damper_jumps(
    rng: np.random.Generator, rate: float, delay: float
) -> None:
    judged = checked(rigid(300.0, sensor_delay={"tau": delay}), rigid(300.0), rng, rate, 8.0)
    assert judged.power < (3e-4 * judged.peak) ** 2
    assert np.min(judged.probability["harmonics"]) > 1e-4


# --- Jumps: what is recorded near one is chance, neither a gap nor evidence


def test_a_step_is_a_jump_of_its_own_size_at_the_two_samples_beside_it() -> None:
    force = np.where(np.arange(400) < 170, -250.0, 250.0) + 1e-3 * np.sin(np.arange(400))
    found = jumps(force)
    assert np.flatnonzero(found).tolist() == [169, 170]
    assert np.allclose(found[[169, 170]], 500.0, atol=0.01)


def test_a_smooth_force_under_noise_has_next_to_no_jumps(rng: np.random.Generator) -> None:
    time = np.arange(4000) / 1000.0
    found = jumps(1000.0 * np.sin(2 * np.pi * time) + 10.0 * rng.standard_normal(time.size))
    # Gaussian bends exceed six standard deviations once in 500 million samples; the scatter is known to 2 %.
    assert not np.any(found)


def test_the_true_damper_with_a_large_jump_at_every_reversal_leaves_no_gap(rng: np.random.Generator) -> None:
    friction = {"F_s": 0.4 * TABLE_2[0.0][0], "v_s": 0.015}
    damper = damper_of((0.0,), stribeck_friction=friction)
    record = sine(damper, 0.0, 1.03, 0.03, rng, noise=0.005, rate=500.0)
    (cleaned,) = clean((record,))
    wanted = np.ones(cleaned.record.time.size, dtype=np.bool_)
    with_jump, without = (predict(d, cleaned, NuisanceConfig().delay_s) for d in (damper, damper_of((0.0,))))
    assert visible_gap([check_residual(with_jump, cleaned, wanted, NuisanceConfig())]) < 0.002  # visible from 0.0025
    assert visible_gap([check_residual(without, cleaned, wanted, NuisanceConfig())]) > 0.01


def test_the_true_damper_in_a_motion_that_does_not_repeat_leaves_no_gap_at_its_jumps(rng: np.random.Generator) -> None:
    """Two tones without a common period, a hundred reversals, each between samples of 500 Hz."""
    damper = damper_of((0.0,), stribeck_friction={"F_s": 0.4 * TABLE_2[0.0][0], "v_s": 0.015})
    time = np.arange(0.0, 40.0, 1.0 / 4000.0)
    tones = tuple(zip((0.02, 0.012), 2.0 * np.pi * np.array([0.83, 1.57]), strict=True))
    x, v, a = (
        np.asarray(sum(size * rate**n * wave(rate * time + 0.3) for size, rate in tones))
        for n, wave in ((0, np.sin), (1, np.cos), (2, lambda at: -np.sin(at)))
    )
    force = respond(damper, Motion(time, x, v, a, np.zeros(time.size)))
    force += 0.002 * np.max(force) * rng.standard_normal(time.size)
    fine = Record("two-tone", None, time, x, v, a, force, np.zeros(time.size))
    (cleaned,) = clean((sliced(fine, np.arange(time.size) % 8 == 3),))
    assert cleaned.cycles is None
    assert np.count_nonzero(np.diff(np.sign(v))) > 80
    check = check_residual(
        predict(damper, cleaned, NuisanceConfig().delay_s),
        cleaned,
        np.ones(cleaned.record.time.size, dtype=np.bool_),
        NuisanceConfig(),
    )
    assert check.probability["smooth"][0] > 1e-3
    assert visible_gap([check]) < 0.001


# --- Left-out samples: nothing is differenced, filtered or whitened across them


RATE, FINER, DURATION, LEAD = 500, 16, 12.0, 2.0
LATE = 0.0005
"""Of the force [s]: one standard deviation of what a test may have of its own."""
NOISE = 10.0
"""Of the force [N]."""
DAMPER = Damper(
    base=(
        BaseRow(voltage_V=0.0, T0_N=300.0, C_Ns_per_m=2500.0, k_N_per_m=2.0e5),
        BaseRow(voltage_V=150.0, T0_N=1300.0, C_Ns_per_m=2500.0, k_N_per_m=4.0e5),
    )
)


def late_sweep(
    voltage: Array, rng: Generator, damper: Damper = DAMPER, late: float = LATE, noise: float = NOISE
) -> Record:
    """A sweep from 0.5 to 4 Hz whose force comes late, at a voltage (n,) on the fine grid."""
    fine = np.arange(-LEAD, DURATION, 1.0 / (RATE * FINER))
    x = 0.012 * np.sin(2.0 * np.pi * (0.5 * fine + 0.5 * 3.5 / DURATION * fine**2))
    v = np.gradient(x, fine)
    force = respond(damper, Motion(fine, x, v, np.gradient(v, fine), voltage))
    seen = slice(round(LEAD * RATE) * FINER, None, FINER)
    t, measured = fine[seen], np.interp(fine[seen] - late, fine, force) + noise * rng.standard_normal(fine[seen].size)
    clean = kinematics(t, x[seen], None)
    return Record("sweep", None, t, x[seen], clean.velocity, clean.acceleration, measured, voltage[seen])


def probability(record: Record, wanted: NDArray[np.bool_]) -> float:
    """That noise alone leaves what the true damper leaves of the wanted samples."""
    (cleaned,) = clean((record,))
    config = NuisanceConfig()
    found = check_residual(predict(DAMPER, cleaned, config.delay_s), cleaned, wanted, config)
    return float(np.min(found.probability["smooth"]))


def still(voltage: float) -> Array:
    """A voltage [V] that stands still, on the fine grid."""
    return np.full(round((DURATION + LEAD) * RATE * FINER), voltage)


def switching(every: float) -> Array:
    """A voltage that goes between 0 and 150 V, on the fine grid."""
    steps = np.arange(still(0.0).size) // round(every * RATE * FINER)
    return np.where(steps % 2 == 0, 0.0, 150.0)


@pytest.mark.parametrize("kept_back", [(0.3, 0.55), (0.45, 0.7)])
def test_a_test_that_comes_late_shows_no_gap_beside_what_is_kept_back(
    kept_back: tuple[float, float], rng: Generator
) -> None:
    record = late_sweep(still(150.0), rng)
    share = np.linspace(0.0, 1.0, record.time.size)
    wanted = (share < kept_back[0]) | (share > kept_back[1])
    assert probability(record, wanted) > 1e-3


@pytest.mark.parametrize("every", [0.2, 0.35])
def test_a_test_that_comes_late_shows_no_gap_beside_steps_of_the_voltage(every: float, rng: Generator) -> None:
    record = late_sweep(switching(every), rng)
    assert probability(record, np.ones(record.time.size, dtype=np.bool_)) > 1e-3


def test_a_flank_of_few_samples_that_comes_late_is_no_gap_though_the_voltage_steps(rng: Generator) -> None:
    """Behind a stiff oil spring: half a sample late, the slope of the force is another one."""
    stiff = Damper(
        base=(
            BaseRow(voltage_V=0.0, T0_N=123.0, C_Ns_per_m=5.0, k_N_per_m=4.4e6),
            BaseRow(voltage_V=150.0, T0_N=305.0, C_Ns_per_m=6.0, k_N_per_m=5.9e6),
        )
    )
    (cleaned,) = clean((late_sweep(switching(0.4), rng, stiff, late=0.0012, noise=1.5),))
    everything, config = np.ones(cleaned.record.time.size, dtype=np.bool_), NuisanceConfig()
    check = check_residual(predict(stiff, cleaned, config.delay_s), cleaned, everything, config)
    assert visible_gap([check]) < 0.0005


def test_the_force_of_a_delay_is_its_slope_on_either_side_of_what_is_left_out() -> None:
    t = np.arange(1000) / 1000.0
    force = 1000.0 * np.sin(2.0 * np.pi * t) + np.where(t < 0.5, 0.0, 500.0)
    counted = (t < 0.45) | (t > 0.55)
    whole = nuisance_columns(force, 1000.0, NuisanceConfig())[counted]
    assert nuisance_columns(force[counted], 1000.0, NuisanceConfig(), counted)[:, 2] == pytest.approx(
        whole[:, 2], abs=0.05
    )


def test_stretches_are_divided_at_every_left_out_sample() -> None:
    counted = np.array([0, 1, 1, 1, 0, 0, 1, 0, 1, 1], dtype=np.bool_)
    values = np.array([1.0, 2.0, 4.0, 9.0, 5.0, 8.0])
    assert [part.tolist() for part in split_at_gaps(values, counted)] == [[1.0, 2.0, 4.0], [9.0], [5.0, 8.0]]
    assert gradient_within_stretches(values, counted).tolist() == [1.0, 1.5, 2.0, 0.0, 3.0, 3.0]
    assert has_predecessors(counted, 1).tolist() == [True, True, False, False, True]
    assert has_predecessors(counted, 0).all()


def test_a_stretch_of_two_samples_does_not_whiten_the_others(rng: Generator) -> None:
    """A resonance takes a model of two coefficients, which two samples have no predecessors for."""
    e = np.zeros(2000)
    for i in range(2, e.size):
        e[i] = 1.6 * e[i - 1] - 0.9 * e[i - 2] + rng.standard_normal()
    found = autoregression([e, e[:2]])
    assert found.coefficients[:2] == pytest.approx([1.6, -0.9], abs=0.05)
    assert found.innovation == pytest.approx(1.0, rel=0.1)
