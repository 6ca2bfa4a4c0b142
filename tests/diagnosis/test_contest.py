"""An effect chosen first, beside less than is adopted in the end, is tried again against the others."""

from __future__ import annotations

import numpy as np
import pytest
from campaign import damper_of, sines
from whole_diagnosis import all_but, problem_of

from pzd.damper.effects import library
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.fit.least_squares import FitResult, fit
from pzd.diagnosis.fit.problem import Problem
from pzd.diagnosis.search.candidates import Candidate, converged
from pzd.diagnosis.search.candidates import candidate as fitted_beside
from pzd.diagnosis.search.forward_selection import swap_step

SMALL = DiagnoseConfig(forbid=all_but("gas_spring", "orifice_quadratic", "stribeck_friction", "relief_valve"))


def charged_orifice(rng: np.random.Generator) -> Problem:
    """An orifice and the spring of a gas, at two frequencies and two amplitudes."""
    hidden = damper_of((0.0,), orifice_quadratic={"q": 3000.0}, gas_spring={"k_g": 3000.0})
    return problem_of(sines(hidden, rng, voltages=(0.0,)))


def with_effects(problem: Problem, *names: str) -> FitResult:
    """The optimum with some effects, added one by one."""
    found = fit(problem, (), problem.start())
    for name in names:
        found = converged(problem, found, fitted_beside(problem, found, library()[name])).fitted
    return found


def nothing_refused(_: Candidate) -> None:
    return None


@pytest.mark.parametrize("first", ["stribeck_friction", "relief_valve"])
def test_what_stood_in_for_another_effect_gives_way_to_it(first: str, rng: np.random.Generator) -> None:
    problem = charged_orifice(rng)
    without, current = with_effects(problem, "gas_spring"), with_effects(problem, "gas_spring", first)
    step, kept = swap_step(problem, without, first, current, nothing_refused, SMALL, 1)
    assert kept.effect == step.chosen == "orifice_quadratic"
    assert kept.fitted.damper.effects["orifice_quadratic"]["q"] == pytest.approx(3000.0, rel=0.2)
    assert {*kept.fitted.effects} == {"gas_spring", "orifice_quadratic"}


def test_what_does_as_well_as_anything_stays(rng: np.random.Generator) -> None:
    problem = charged_orifice(rng)
    without = with_effects(problem, "gas_spring")
    current = with_effects(problem, "gas_spring", "orifice_quadratic")
    step, kept = swap_step(problem, without, "orifice_quadratic", current, nothing_refused, SMALL, 1)
    assert kept.fitted is current
    assert step.rivals == ()


def test_what_the_data_do_not_support_takes_no_place(rng: np.random.Generator) -> None:
    problem = charged_orifice(rng)
    without = with_effects(problem, "gas_spring")
    current = with_effects(problem, "gas_spring", "stribeck_friction")

    def refused(each: Candidate) -> str | None:
        return "a stand-in" if each.effect == "orifice_quadratic" else None

    step, kept = swap_step(problem, without, "stribeck_friction", current, refused, SMALL, 1)
    assert kept.effect != "orifice_quadratic"
    assert "orifice_quadratic" in step.rejected
    assert "orifice_quadratic" not in step.rivals
