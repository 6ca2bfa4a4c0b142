"""Records prepared for a fit: fine displacement, warm-up, rest after the motion; and the criterion over them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fresh_truths import TABLE_2, sine_test

from pzd.damper.element import element_force
from pzd.identification.bingham_fit import Bingham, Objective, fit_separable
from pzd.identification.prepared_record import prepare, upsampling_factor, warm_up
from pzd.record import Array, Record
from pzd.signals.measures import reversals


def test_a_sine_reverses_twice_a_cycle() -> None:
    time = np.arange(5001) / 1000.0
    turns = reversals(0.01 * np.sin(2.0 * np.pi * time))
    np.testing.assert_allclose(time[turns], 0.25 + 0.5 * np.arange(10), atol=1e-9)


def test_small_wobbles_are_no_reversals() -> None:
    time = np.arange(5001) / 1000.0
    plain = 0.01 * np.sin(2.0 * np.pi * time)
    wobbling = plain + 2e-4 * np.sin(2.0 * np.pi * 37.0 * time)
    assert len(reversals(wobbling)) == len(reversals(plain))


def test_the_warm_up_ends_after_the_first_reversal_also_when_the_record_begins_at_rest() -> None:
    time = np.arange(4001) / 1000.0
    moving = np.where(time > 1.0, 0.01 * np.sin(2.0 * np.pi * (time - 1.0)), 0.0)
    ends = time[warm_up(moving)]
    assert 1.25 < ends < 1.5


def test_a_record_without_reversal_still_counts_half_of_its_samples() -> None:
    assert warm_up(np.linspace(0.0, 0.1, 100)) == 50


def at_rest_after(record: Record, seconds: float, truth: Bingham, creep: float) -> Record:
    """The record with a rest behind its motion, where the oil relaxes and then the seals creep."""
    since = np.arange(1, int(seconds * record.rate) + 1) / record.rate
    relaxing = (record.force[-1] - truth.friction) * np.exp(-since * truth.stiffness / truth.damping)
    resting = truth.friction + relaxing - creep * (1.0 - np.exp(-since))
    held, still = np.full(since.size, record.displacement[-1]), np.zeros(since.size)
    behind = (record.time[-1] + since, held, still, still, resting)
    return Record("resting", None, *(np.concatenate(pair) for pair in zip(_channels(record), behind, strict=True)))


def _channels(record: Record) -> tuple[Array, ...]:
    return record.time, record.displacement, record.velocity, record.acceleration, record.force


def test_rest_after_the_motion_does_not_move_the_fit() -> None:
    truth = TABLE_2[0.0]
    record = sine_test(truth, 2.0, 0.03, cycles=3)
    resting = at_rest_after(record, 3.0, truth, 0.5 * truth.friction)
    counted = prepare(resting).counted
    assert not counted[resting.time > record.time[-1] + 0.1].any()
    assert counted[(resting.time > 0.5) & (resting.time <= record.time[-1])].all()
    np.testing.assert_allclose(fit_separable(Objective((prepare(resting),))).parameters, truth, rtol=0.01)


def test_a_hold_between_two_motions_counts() -> None:
    truth = TABLE_2[0.0]
    record = sine_test(truth, 2.0, 0.03, cycles=3)
    resting = at_rest_after(record, 1.0, truth, 0.0)
    later = replace(record, time=record.time + resting.time[-1] + 1.0 / record.rate)
    twice = Record(
        "twice", None, *(np.concatenate(pair) for pair in zip(*map(_channels, (resting, later)), strict=True))
    )
    assert prepare(twice).counted[resting.time.size // 2 :][: resting.time.size // 2].all()


@pytest.mark.parametrize("phase", [0.0, 1.0, 1.4, 2.5, 4.0, 5.5])
def test_a_wrong_force_at_the_first_sample_is_forgotten(phase) -> None:
    truth = TABLE_2[0.0]
    record = sine_test(truth, 2.0, 0.03, phase=phase)
    wrong = record.force.copy()
    wrong[0] -= 500.0
    trial = prepare(replace(record, force=wrong))
    everything = replace(trial, counted=np.ones_like(trial.counted))
    assert Objective((everything,)).criterion(truth) > 100.0 * Objective((trial,)).criterion(truth)
    np.testing.assert_allclose(fit_separable(Objective((trial,))).parameters, truth, rtol=2e-4)


def test_fine_displacement_removes_the_bias_of_reading_a_sine_as_a_polygon() -> None:
    truth = TABLE_2[0.0]
    record = sine_test(truth, 2.0, 0.03, rate=200)
    trial = prepare(record)
    polygon = replace(trial, displacement=record.displacement, step=1.0 / record.rate, factor=1)
    assert abs(fit_separable(Objective((polygon,))).parameters.stiffness / truth.stiffness - 1.0) > 3e-3
    assert abs(fit_separable(Objective((trial,))).parameters.stiffness / truth.stiffness - 1.0) < 1e-4


def test_the_fine_grid_keeps_the_samples_and_is_fine_enough() -> None:
    record = sine_test(TABLE_2[0.0], 5.0, 0.005, rate=200)
    trial = prepare(record)
    np.testing.assert_allclose(trial.at_samples(trial.displacement), record.displacement, atol=1e-11)
    assert trial.factor == upsampling_factor(record)
    assert 2.0 * np.pi * 5.0 * trial.step <= 1.0 / 250.0


def test_rounded_time_stamps_count_as_a_regular_clock() -> None:
    record = sine_test(TABLE_2[0.0], 2.0, 0.03, rate=300)
    assert prepare(replace(record, time=np.round(record.time, 3))).positions is None


def test_an_irregular_clock_is_fitted_at_its_own_samples(rng: np.random.Generator) -> None:
    truth = TABLE_2[0.0]
    record = sine_test(truth, 2.0, 0.03)
    kept = np.sort(rng.permutation(record.time.size)[: int(0.7 * record.time.size)])
    channels = ("time", "displacement", "velocity", "acceleration", "force")
    thinned = replace(record, **{c: getattr(record, c)[kept] for c in channels})
    trial = prepare(thinned)
    assert trial.positions is not None
    np.testing.assert_allclose(fit_separable(Objective((trial,))).parameters, truth, rtol=1e-3)


def test_slopes_of_the_objective_agree_with_difference_quotients() -> None:
    truth = TABLE_2[150.0]
    objective = Objective((prepare(sine_test(truth, 2.0, 0.03, cycles=3)),))
    _, slopes = objective.residuals_and_slopes(truth)
    for i, value in enumerate(truth):
        up, down = (truth._replace(**{truth._fields[i]: value * f}) for f in (1.0 + 1e-6, 1.0 - 1e-6))
        size = -1.0 / value if i == 2 else value  # the third is by 1/k
        quotient = (objective.residuals(down) - objective.residuals(up)) / (2e-6 * size)
        np.testing.assert_allclose(slopes[:, i], quotient, atol=1e-5 * np.abs(quotient).max())


def test_the_criterion_is_the_paper_s_equation_4() -> None:
    record = sine_test(TABLE_2[0.0], 2.0, 0.03, cycles=3)
    trial = prepare(record)
    other = TABLE_2[150.0]
    simulated = trial.at_samples(element_force(trial.displacement, trial.step, *other, float(record.force[0])))
    kept = trial.counted
    by_hand = np.sum((record.force - simulated)[kept] ** 2) / np.sum(record.force[kept] ** 2)
    assert Objective((trial,)).criterion(other) == pytest.approx(by_hand, rel=1e-12)
