"""Steps of the search for prediction: what they gain at kept-back tests against what they lose between voltages."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest
from synthetic import campaign_of, damper_of, diagnosed, sine, sines

from pzd.damper.model import BaseRow, Damper
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.cross_validation import cross_validation_of
from pzd.diagnosis.predictive_search import CriterionFit, PredictiveSearch, Tried, _Proposal, as_good, loses_between
from pzd.fit.cross_validation import PredictionError
from pzd.quantities import Control
from pzd.report.diagnosis_text import diagnosis_lines

ENERGY = 1e4
"""Sum of squared forces of a test [N^2]."""


def errors(held_out: float, between: float) -> Tried:
    """What was tried, with W_s of kept-back tests and of left-out voltages; what is below 1e-4 is not visible."""

    def of(criterion: float) -> PredictionError:
        entry = (criterion * ENERGY, ENERGY, ENERGY, 1e-4 * ENERGY)
        return PredictionError.of_entries([0, 1], [entry, entry])

    return Tried(cast("Any", None), of(held_out), of(between))


@pytest.mark.parametrize(
    ("held_out", "between", "loses"),
    [
        (0.006, 0.0080, False),  # nothing lost
        (0.006, 0.0087, False),  # half the error for a few per cent: measured, a branch of an MR damper
        (0.011, 0.0095, True),  # a twelfth gained, a sixth lost
        (0.004, 0.0190, True),  # beyond what the plain damper misses
        (0.0119, 0.00805, False),  # no visible loss
    ],
)
def test_a_step_may_lose_between_voltages_less_than_it_gains_and_never_what_the_plain_damper_has(
    held_out: float, between: float, *, loses: bool
) -> None:
    plain = errors(0.02, 0.0185).interpolation_error
    assert loses_between(errors(0.012, 0.0080), errors(held_out, between), plain) is loses


@pytest.mark.parametrize(
    ("voltages", "good"),
    [
        ((0.0040, 0.0060), True),  # as before
        ((0.0038, 0.0060), True),
        ((0.0010, 0.0080), False),  # less in all, and at one voltage more
        ((0.0052, 0.0050), False),
    ],
)
def test_fewer_parameters_do_as_well_where_nothing_is_lost_at_any_voltage(
    voltages: tuple[float, float], *, good: bool
) -> None:
    def of(pair: tuple[float, float]) -> PredictionError:
        entries = [(criterion * ENERGY, ENERGY, ENERGY, 1e-4 * ENERGY) for criterion in np.repeat(pair, 4)]
        return PredictionError.of_entries(range(8), entries)

    class TwoVoltages:
        @staticmethod
        def worse_at(one: PredictionError, other: PredictionError) -> tuple[float, ...]:
            tests = (0.0, range(4)), (1.0, range(4, 8))
            return tuple(v for v, i in tests if other.of_records(list(i)).visibly_below(one.of_records(list(i))))

    assert as_good(of(voltages), of((0.0040, 0.0060)), cast("Any", TwoVoltages())) is good


@pytest.mark.parametrize(
    ("effect", "values", "taken"),
    [
        ("gas_spring", {"k_g": 1000.0}, True),
        ("accumulator", {"F_g": 300.0, "L": 0.1}, False),
        ("accumulator", {"F_g": 6e4, "L": 20.0}, False),
    ],
)
def test_two_forces_that_cancel_at_their_optimum_are_no_step(
    effect: str, values: dict[str, float], *, taken: bool, rng: np.random.Generator
) -> None:
    """A gas as long as twenty metres is a spring, beside a preload of tens of kilonewtons that takes its force back."""
    plain = damper_of((0.0,))
    preloaded = plain.with_effect("preload_offset", {"F_0": 150.0})
    true = preloaded.with_effect("gas_spring", {"k_g": 4000.0})
    records = tuple(sine(true, 0.0, f, x, rng) for f, x in ((0.5, 0.02), (0.5, 0.03), (2.0, 0.02), (2.0, 0.03)))
    config = DiagnoseConfig()
    validation = cross_validation_of(campaign_of(records), plain, config.visible)
    here, further = (
        validation.fit_by_criterion(damper, validation.no_samples)
        for damper in (preloaded, preloaded.with_effect(effect, values))
    )
    assert here is not None
    assert further is not None
    damper = here[1].damper
    errors = validation.error_by_criterion(damper), validation.interpolation_error(damper, by_criterion=True)
    search = PredictiveSearch(validation, config, most_effects=6)
    found = search._best(CriterionFit(*here, *errors), [_Proposal.of(*further, validation)])
    assert (found is not None) is taken
    assert search.off == (set() if taken else {effect})


@pytest.mark.parametrize(("late", "taken"), [(4e-3, True), (-4e-3, False)])
def test_a_force_that_would_be_shown_early_is_no_step(late: float, *, taken: bool, rng: np.random.Generator) -> None:
    """It would be taken out of the force at the rod, in which it stands for something of the damper."""
    plain = damper_of((0.0,))
    true = plain.with_effect("sensor_delay", {"tau": late})
    records = tuple(sine(true, 0.0, f, x, rng) for f, x in ((0.5, 0.02), (0.5, 0.03), (2.0, 0.02), (2.0, 0.03)))
    validation = cross_validation_of(campaign_of(records), plain, DiagnoseConfig().visible)
    here, further = (validation.fit_by_criterion(damper, validation.no_samples) for damper in (plain, true))
    assert here is not None
    assert further is not None
    errors = validation.error_by_criterion(plain), validation.interpolation_error(plain, by_criterion=True)
    search = PredictiveSearch(validation, DiagnoseConfig(), most_effects=6)
    found = search._best(CriterionFit(*here, *errors), [_Proposal.of(*further, validation)])
    assert (found is not None) is taken


def test_damping_along_the_stroke_predicts_kept_back_tests_though_six_evaluations_do_not_find_it(
    rng: np.random.Generator,
) -> None:
    row = BaseRow(voltage_V=0.0, T0_N=80.0, C_Ns_per_m=1500.0, k_N_per_m=1e6)
    zone = {"c_p": 400.0, "x_p": 0.005, "b_p": 0.012}
    truth = Damper(base=(row,), effects={"position_damping": zone})
    tests = ((0.5, 0.005), (0.5, 0.03), (2.0, 0.01), (2.0, 0.03))
    found = diagnosed(sines(truth, rng, (0.0,), tests=tests, noise=3e-3, cycles=5, jitter=0.003))
    assert (found.diagnosis.verdict, found.diagnosis.effects) == ("unexplained", ("position_damping",))
    assert found.damper.effects["position_damping"] == pytest.approx(zone, rel=0.05)
    moved = found.diagnosis.model_copy(update={"zero_m": 0.002})
    told = next(line for line in diagnosis_lines(moved, Control()) if line.startswith("adopted: position_damping"))
    assert " m counted from x = 0.002 m" in told
    assert found.diagnosis.prediction is not None
    assert found.diagnosis.prediction.W_s < 0.05 * found.diagnosis.prediction.W_s_plain


def test_the_friction_of_a_seal_is_told_from_that_of_the_valve_behind_the_oil(rng: np.random.Generator) -> None:
    """A fit without the branch makes a rigid spring of it, or the lag of a recorder, and the oil is lost."""
    row = BaseRow(voltage_V=0.0, T0_N=0.0, C_Ns_per_m=1500.0, k_N_per_m=8e5)
    truth = Damper(base=(row,), effects={"second_branch": {"T0_2": 20.0, "k_2": 1e8}})
    tests = ((1.0, 0.01), (1.0, 0.025), (2.5, 0.01), (2.5, 0.025), (4.8, 0.025))
    found = diagnosed(sines(truth, rng, (0.0,), tests=tests, noise=4e-3, cycles=5, jitter=0.003))
    assert found.diagnosis.effects == ("second_branch",)
    assert found.damper.effects["second_branch"]["T0_2"] == pytest.approx(20.0, rel=0.1)
    (base,) = found.damper.base
    assert base.k_N_per_m == pytest.approx(8e5, rel=0.2)  # a millisecond of delay in a test is half of C/k
    assert base.T0_N < 1.0


def test_a_seal_has_one_friction_at_every_voltage(rng: np.random.Generator) -> None:
    voltages = (0.0, 50.0, 100.0)
    rows = tuple(BaseRow(voltage_V=v, T0_N=20.0 + 3.0 * v, C_Ns_per_m=1200.0, k_N_per_m=9e5) for v in voltages)
    seal = {"T0_2": 45.0, "k_2": 1.5e5}
    truth = Damper(base=rows, effects={"second_branch": seal})
    found = diagnosed(sines(truth, rng, voltages, noise=4e-3, cycles=5, jitter=0.003))
    assert found.diagnosis.effects == ("second_branch",)
    assert found.damper.effects["second_branch"] == pytest.approx(seal, rel=0.1)
