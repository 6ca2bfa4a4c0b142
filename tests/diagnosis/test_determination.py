"""Effects that a fit does not determine: off as well, at a limit, cancelled by another, or another C."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import TWO, campaign_of, damper_of, problem_of, sine, sines

from pzd.damper.effects import library
from pzd.damper.model import Damper
from pzd.diagnosis.adoption import adopt_effects
from pzd.diagnosis.campaign import evidence_of
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.cross_validation import cross_validation_of
from pzd.diagnosis.fit.least_squares import FitResult, fit, standard_errors
from pzd.diagnosis.fit.problem import Problem
from pzd.diagnosis.predictive_search import CriterionFit, without_off
from pzd.diagnosis.search.acceptance import Selection, insufficient_support
from pzd.diagnosis.search.candidates import as_candidate, starts_of
from pzd.diagnosis.search.determination import (
    ANOTHER_DAMPING,
    AT_LIMIT,
    CANCELLED,
    MAY_BE_OFF,
    at_limits,
    cancelling,
    opens_below_friction,
    showing,
    undetermined,
)
from pzd.record import Record

BASE = damper_of((0.0,))
ONE_FREQUENCY = ((1.0, 0.02), (1.0, 0.03))
SEVERAL = ((0.5, 0.02), (0.5, 0.03), (2.0, 0.02), (2.0, 0.03))


def problem_on(damper: Damper, rng: np.random.Generator, motions: tuple[tuple[float, float], ...]) -> Problem:
    return problem_of([sine(damper, 0.0, f, a, rng) for f, a in motions])


def fitted_from(problem: Problem, **effects: dict[str, float]) -> FitResult:
    """The fit with some effects from given values."""
    damper = BASE
    for name, values in effects.items():
        damper = damper.with_effect(name, values)
    return fit(problem, tuple(effects), problem.start_with(damper))


@pytest.mark.parametrize(
    "effects",
    [
        {"gas_spring": {"k_g": 4000.0}, "preload_offset": {"F_0": 200.0}},
        {"orifice_quadratic": {"q": 6000.0}, "end_stop": {"k_e": 4e6, "x_e": 0.018}},
        {"relief_valve": {"F_r": 450.0, "C_r": 700.0}},
    ],
)
def test_effects_that_are_there_are_determined(effects: dict[str, dict[str, float]], rng: np.random.Generator) -> None:
    problem = problem_on(Damper(base=BASE.base, effects=effects), rng, SEVERAL)
    assert undetermined(problem, fitted_from(problem, **effects)) == {}


def test_a_strength_that_may_be_zero_is_none(rng: np.random.Generator) -> None:
    problem = problem_on(BASE, rng, SEVERAL)
    found = fitted_from(problem, orifice_quadratic={"q": 500.0})
    assert undetermined(problem, found) == {"orifice_quadratic": MAY_BE_OFF}


def test_a_strength_is_told_from_none_by_so_many_of_its_errors_as_are_asked(rng: np.random.Generator) -> None:
    fitted = fitted_from(problem_on(BASE, rng, SEVERAL), gas_spring={"k_g": 4000.0})
    (of_spring,) = standard_errors(fitted)
    away = abs(fitted.damper.effects["gas_spring"]["k_g"]) / of_spring
    assert showing(fitted, 0.9 * away) == {"gas_spring"}
    assert showing(fitted, 1.1 * away) == set()


def test_a_stop_at_the_end_of_the_recorded_stroke_ends_at_a_limit(rng: np.random.Generator) -> None:
    problem = problem_on(BASE, rng, SEVERAL)
    found = fitted_from(problem, end_stop={"k_e": 1e9, "x_e": 0.0297})
    high = next(u.bounds[1] for u in found.unknowns if u.parameter.name == "x_e")
    assert high == 0.99
    pinned = replace(found, optimum=np.where(np.arange(found.optimum.size) == 4, high - 1e-6, found.optimum))
    assert list(at_limits(pinned)) == ["end_stop"]
    assert undetermined(problem, pinned)["end_stop"] in (MAY_BE_OFF, AT_LIMIT)


def test_two_forces_that_cancel_in_every_test_are_neither(rng: np.random.Generator) -> None:
    # At one frequency a mass is a spring below zero: k_g x + m a = (k_g - m w^2) x.
    problem = problem_on(BASE, rng, ONE_FREQUENCY)
    found = fitted_from(problem, gas_spring={"k_g": 8000.0}, fluid_inertia={"m": 8000.0 / (2.0 * np.pi) ** 2})
    assert list(cancelling(problem, found)) == [("gas_spring", "fluid_inertia")]
    assert set(undetermined(problem, found).values()) <= {CANCELLED, MAY_BE_OFF}
    assert set(undetermined(problem, found)) == {"gas_spring", "fluid_inertia"}


@pytest.mark.parametrize(("F_r", "below"), [(200.0, True), (300.0, True), (302.0, False), (900.0, False)])
def test_a_valve_that_opens_below_the_friction_is_another_damping(F_r: float, below: bool) -> None:
    assert opens_below_friction(damper_of((0.0,), relief_valve={"F_r": F_r, "C_r": 900.0})) is below


def test_by_voltage_a_valve_need_open_above_the_friction_of_one() -> None:
    nodes = {"at_voltage_V": (0.0, 150.0)}
    both = damper_of(TWO, relief_valve={"F_r": (200.0, 1000.0), "C_r": (900.0, 900.0), **nodes})
    one = damper_of(TWO, relief_valve={"F_r": (400.0, 1000.0), "C_r": (900.0, 900.0), **nodes})
    assert opens_below_friction(both)
    assert not opens_below_friction(one)


def test_such_a_valve_is_no_candidate_however_much_it_pays(rng: np.random.Generator) -> None:
    # The fit begins at C = 2720 N s/m, far from the damper's own 700: a valve below T0 pays for that.
    soft = Damper(base=(BASE.base[0].model_copy(update={"C_Ns_per_m": 700.0}),))
    records = [sine(soft, 0.0, f, a, rng) for f, a in SEVERAL]
    evidence = evidence_of(campaign_of(records), BASE)
    before = fit(evidence.whole, (), evidence.whole.start(), evaluations=1)
    valve = fitted_from(evidence.whole, relief_valve={"F_r": 150.0, "C_r": 700.0})
    found = as_candidate(evidence.whole, before, "relief_valve", valve)
    assert found.delta_bic < -1000.0
    assert opens_below_friction(valve.damper)
    assert insufficient_support(evidence, DiagnoseConfig(), found) == ANOTHER_DAMPING


def test_what_the_tests_do_not_determine_is_not_handed_on_and_the_rest_is_fitted_again(
    rng: np.random.Generator,
) -> None:
    true = damper_of(TWO, orifice_quadratic={"q": 6000.0})
    records: tuple[Record, ...] = sines(true, rng, TWO, tests=ONE_FREQUENCY)
    campaign, plain = campaign_of(records), damper_of(TWO)
    evidence = evidence_of(campaign, plain)
    baseline = fit(evidence.whole, (), evidence.whole.start())
    both = plain.with_effect("gas_spring", {"k_g": 8000.0})
    both = both.with_effect("fluid_inertia", {"m": 8000.0 / (2.0 * np.pi) ** 2})
    three = both.with_effect("orifice_quadratic", {"q": 6000.0})
    weighed = evidence_of(campaign, three)
    found = fit(weighed.whole, tuple(three.effects), weighed.whole.start_with(three))
    selection = Selection(baseline, found, (), {}, evidence, weighed)
    adopted = adopt_effects(selection, cross_validation_of(campaign, plain, 0.0025), (), "V").selection
    assert adopted.adopted == ("orifice_quadratic",)
    again = fit(adopted.final_evidence.whole, adopted.adopted, adopted.fitted.optimum)
    assert adopted.fitted.misfit == pytest.approx(again.misfit, rel=1e-4)


def test_no_test_brings_a_law_near_its_pole(rng: np.random.Generator) -> None:
    problem = problem_on(BASE, rng, SEVERAL)
    for start in starts_of(problem, fit(problem, (), problem.start()), library()["accumulator"]):
        assert np.exp(start[1]) >= 1.5
    length = next(u for u in problem.unknowns(("accumulator",)) if u.parameter.name == "L")
    assert length.value(length.bounds[0]) == pytest.approx(1.5 * problem.scales.stroke)


def test_what_may_be_off_beside_what_was_added_is_not_handed_on(rng: np.random.Generator) -> None:
    true = damper_of((0.0,), gas_spring={"k_g": 6000.0})
    validation = cross_validation_of(campaign_of([sine(true, 0.0, f, a, rng) for f, a in SEVERAL]), BASE, 0.0025)
    both = true.with_effect("end_stop", {"k_e": 1e6, "x_e": 0.0295})
    found = validation.fit_by_criterion(both, validation.no_samples)
    assert found is not None
    error = validation.error_by_criterion(both)
    current = CriterionFit(*found, error, error)
    assert set(without_off(current, validation, ()).fitted.effects) == {"gas_spring"}
    assert set(without_off(current, validation, ("end_stop",)).fitted.effects) == {"gas_spring", "end_stop"}
