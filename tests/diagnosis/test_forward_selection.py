"""Forward selection: which candidates are searched for, adopted, exchanged and refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from synthetic import TWO, all_but, campaign_of, damper_of, diagnosed, problem_of, sine, sines

from pzd.damper.compose import respond
from pzd.damper.effect import Scales
from pzd.damper.effects import library, nameable
from pzd.damper.model import BaseRow, Damper, against_nature
from pzd.damper.motion import Motion
from pzd.diagnosis import thresholds
from pzd.diagnosis.campaign import Campaign, evidence_of
from pzd.diagnosis.cleaned_records import clean
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.fit.least_squares import FitResult, fit
from pzd.diagnosis.fit.problem import Problem
from pzd.diagnosis.roles import split
from pzd.diagnosis.search import candidates as searching
from pzd.diagnosis.search.acceptance import Selection, SelectionStep
from pzd.diagnosis.search.candidates import Candidate, candidate, converged, resumed
from pzd.diagnosis.search.candidates import candidate as fitted_beside
from pzd.diagnosis.search.forward_selection import swap_step
from pzd.record import Record
from pzd.signals.nuisance import NuisanceConfig


@pytest.mark.ci
def test_parameters_differ_by_voltage_where_the_data_demand_it(rng: np.random.Generator) -> None:
    thinning = {"n": (0.95, 0.75), "at_voltage_V": TWO}
    damper = damper_of(TWO).with_effect("shear_thinning", thinning)
    records = sines(damper, rng, TWO, jitter=0.01)
    # Forced, so that the claim is about the voltage alone: with one n a relief valve may look better at first.
    found = diagnosed(records, force=("shear_thinning",), most_effects=1)
    told = found.diagnosis
    assert told.effects == ("shear_thinning",), told.reason
    value = told.parameters["shear_thinning"]["n"]
    assert value.at_voltage_V == TWO
    assert value.value == pytest.approx(thinning["n"], abs=0.03)
    assert found.damper.effects["shear_thinning"]["at_voltage_V"] == TWO


@pytest.mark.ci
def test_two_effects_that_distort_each_other_are_found(rng: np.random.Generator) -> None:
    damper = damper_of(TWO, orifice_quadratic={"q": 2500.0}, rounded_yield={"w_s": 0.015})
    told = diagnosed(sines(damper, rng, TWO, jitter=0.01)).diagnosis
    assert set(told.effects) == {"orifice_quadratic", "rounded_yield"}, told.reason


def test_an_asymmetry_is_found_beside_the_zero_that_bends_it_in_slow_tests(rng: np.random.Generator) -> None:
    """C alone is larger in rebound; with the zero of a load cell the offset is a fifth of the slowest force."""
    base = BaseRow(voltage_V=0.0, T0_N=25.0, C_Ns_per_m=900.0, k_N_per_m=4e5)
    truth = Damper(base=(base,), effects={"asymmetry": {"alpha": 0.3}, "preload_offset": {"F_0": -7.5 - 8.0}})
    tests = [(v / (2.0 * np.pi * 0.025), 0.025) for v in (0.052, 0.131, 0.262, 0.393, 0.524, 1.047)]
    records = sines(truth, rng, (0.0,), tests=tests, noise=0.004, colour=0.0, cycles=6)
    found = diagnosed(records, forbid=all_but("asymmetry", "preload_offset")).diagnosis
    assert (found.verdict, {*found.effects}) == ("named", {"asymmetry", "preload_offset"})


def test_an_effect_that_stood_in_for_another_is_begun_afresh_beside_it(rng: np.random.Generator) -> None:
    """Alone the friction falls over the whole range of speeds, as a power law does; from there no way leads to both."""
    rows = zip(TWO, (210.0, 450.0), (3600.0, 2900.0), (1.7e6, 2e6), strict=True)
    base = tuple(BaseRow(voltage_V=U, T0_N=T0, C_Ns_per_m=C, k_N_per_m=k) for U, T0, C, k in rows)
    effects = {"stribeck_friction": {"F_s": 106.0, "v_s": 0.0102}, "shear_thinning": {"n": 0.4}}
    tests = ((1.0, 0.005), (1.0, 0.01), (2.0, 0.0036), (2.0, 0.0072))
    records = sines(Damper(base=base, effects=effects), rng, TWO, jitter=0.01, tests=tests)
    told = diagnosed(records, forbid=all_but(*effects, "relief_valve")).diagnosis
    assert (told.verdict, set(told.effects)) == ("named", set(effects)), told.reason
    found = {name: told.parameters[effect][name].value for effect, values in effects.items() for name in values}
    assert found == pytest.approx({"F_s": 106.0, "v_s": 0.0102, "n": 0.4}, rel=0.1)


def warming(
    damper: Damper, voltage: float, frequency: float, warm: tuple[float, float], rng: np.random.Generator
) -> Record:
    """A sine test during which the damper warms steadily."""
    plain = sine(damper_of(TWO), voltage, frequency, 0.02, rng)
    temperature = np.linspace(*warm, plain.time.size)
    motion = Motion(plain.time, plain.displacement, plain.velocity, plain.acceleration, plain.voltage, temperature)
    force = respond(damper, motion)
    noise = 0.01 * float(np.max(np.abs(force))) * rng.standard_normal(force.size)
    return Record(
        f"{plain.name}-{warm[0]:g}", None, plain.time, plain.displacement, plain.velocity, plain.acceleration,
        force + noise, plain.voltage, temperature,
    )  # fmt: skip


@pytest.mark.ci
@pytest.mark.parametrize("drifts", [pytest.param(True, marks=pytest.mark.ci), False])
def test_a_drift_is_named_where_the_damper_warms_and_only_if_there_is_one(
    drifts: bool,  # a parameter of the test
    rng: np.random.Generator,
) -> None:
    betas = {"beta_T0": 0.02, "beta_C": 0.015}
    damper = damper_of(TWO).model_copy(update={"reference_temperature_degC": 22.0})
    if drifts:
        damper = damper.with_effect("temperature_drift", betas)
    tests = ((f, warm) for f, warm in ((0.5, (20.0, 23.0)), (1.0, (21.0, 26.0)), (2.0, (22.0, 29.0))))
    records = tuple(warming(damper, U, f, warm, rng) for f, warm in tests for U in TWO)
    told = diagnosed(records).diagnosis
    assert told.effects == (("temperature_drift",) if drifts else ()), told.reason
    for name, beta in betas.items() if drifts else ():
        assert told.parameters["temperature_drift"][name].value == pytest.approx(beta, rel=0.2)


def test_rivals_of_one_step_stay_rivals_when_another_effect_is_adopted_but_not_when_they_are() -> None:
    spring_or_mass = SelectionStep((), "gas_spring", ("fluid_inertia",))
    then = SelectionStep((), "asymmetry")

    def named(*effects: str) -> Selection:
        standing: Any = SimpleNamespace(effects=effects, damper=damper_of(TWO))
        evidence: Any = SimpleNamespace(whole=SimpleNamespace(scales=SimpleNamespace(force=1000.0)))
        return Selection(standing, standing, (spring_or_mass, then), {}, evidence, evidence)

    assert named("gas_spring", "asymmetry").rivals == ("fluid_inertia",)
    assert named("gas_spring", "asymmetry", "fluid_inertia").rivals == ()
    assert named("asymmetry").rivals == ()


# --- Swap step: an effect chosen first is tried again against the others


SMALL = DiagnoseConfig(forbid=all_but("gas_spring", "orifice_quadratic", "stribeck_friction", "relief_valve"))


@pytest.fixture(scope="module")
def problem(generator_for: Callable[[str], np.random.Generator]) -> Problem:
    """An orifice and the spring of a gas, at two frequencies and two amplitudes."""
    hidden = damper_of((0.0,), orifice_quadratic={"q": 3000.0}, gas_spring={"k_g": 3000.0})
    return problem_of(sines(hidden, generator_for("charged orifice"), voltages=(0.0,), cycles=4))


@pytest.fixture(scope="module")
def without(problem: Problem) -> FitResult:
    """The spring alone, beside which the other effects are tried."""
    return with_effects(problem, "gas_spring")


def with_effects(problem: Problem, *names: str, before: FitResult | None = None) -> FitResult:
    """The optimum with some effects, added one by one to what was found before."""
    found = before or fit(problem, (), problem.start())
    for name in names:
        found = converged(problem, found, fitted_beside(problem, found, library()[name])).fitted
    return found


def nothing_refused(_: Candidate) -> None:
    return None


@pytest.mark.parametrize("first", ["stribeck_friction", "relief_valve"])
def test_a_spurious_effect_gives_way_to_the_true_one(first: str, problem: Problem, without: FitResult) -> None:
    current = with_effects(problem, first, before=without)
    step, kept = swap_step(problem, without, first, current, nothing_refused, SMALL, 1)
    assert kept.effect == step.chosen == "orifice_quadratic"
    assert kept.fitted.damper.effects["orifice_quadratic"]["q"] == pytest.approx(3000.0, rel=0.2)
    assert {*kept.fitted.effects} == {"gas_spring", "orifice_quadratic"}


def test_the_best_effect_stays_in_the_swap_step(problem: Problem, without: FitResult) -> None:
    current = with_effects(problem, "orifice_quadratic", before=without)
    step, kept = swap_step(problem, without, "orifice_quadratic", current, nothing_refused, SMALL, 1)
    assert kept.fitted is current
    assert step.rivals == ()


def test_an_unsupported_candidate_replaces_no_effect(problem: Problem, without: FitResult) -> None:
    current = with_effects(problem, "stribeck_friction", before=without)

    def refused(each: Candidate) -> str | None:
        return "a stand-in" if each.effect == "orifice_quadratic" else None

    step, kept = swap_step(problem, without, "stribeck_friction", current, refused, SMALL, 1)
    assert kept.effect != "orifice_quadratic"
    assert "orifice_quadratic" in step.rejected
    assert "orifice_quadratic" not in step.rivals


# --- Halves of the tests that give an effect other values


ONLY_SPRING = all_but("gas_spring")
TESTS = ((0.5, 0.02), (0.5, 0.03), (2.0, 0.02), (2.0, 0.03))


def told(other: float, rng: np.random.Generator) -> tuple[str, tuple[str, ...]]:
    """The verdict and its effects where every second test has another spring, so many times as stiff."""
    springs = (4000.0, other * 4000.0)
    records = tuple(
        sine(damper_of((U,), gas_spring={"k_g": k}), U, f, x, rng, noise=0.003, cycles=4, rate=500.0)
        for U in (0.0, 150.0)
        for (f, x), k in zip(TESTS, 2 * springs, strict=True)
    )
    found = diagnosed(records, forbid=ONLY_SPRING, most_added=0).diagnosis
    return found.verdict, found.effects


@pytest.mark.parametrize(("other", "one"), [(1.15, True), (3.0, False)])
def test_a_spring_that_two_halves_tell_a_little_apart_is_one(other: float, one: bool, rng: np.random.Generator) -> None:
    """What gains and clocks of a stand make of it, though quiet tests tell it apart by many standard errors."""
    verdict, effects = told(other, rng)
    assert (verdict, effects) == (("named", ("gas_spring",)) if one else ("unexplained", ()))


# --- Promised drop of the misfit: no effect that would improve the criterion is left out


HIDDEN = {
    "relief_valve": {"F_r": 700.0, "C_r": 900.0},
    "orifice_quadratic": {"q": 6000.0},
    "lash": {"delta": 4e-4},
    "sensor_delay": {"tau": 2e-3},
}
OTHERS = (*list(HIDDEN)[1:], None)


@pytest.mark.parametrize("hidden", ["relief_valve", *(pytest.param(name, marks=pytest.mark.ci) for name in OTHERS)])
def test_an_effect_that_is_not_searched_for_would_not_pay(
    hidden: str | None, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    effects = {} if hidden is None else {hidden: HIDDEN[hidden]}
    cleaned = clean(sines(damper_of(TWO, **effects), rng, TWO, cycles=3))
    whole = evidence_of(Campaign(cleaned, split(cleaned, None, 2.0), NuisanceConfig()), damper_of(TWO)).whole
    before = fit(whole, (), whole.start())
    screened = {c.effect: c for c in searching.candidates(whole, before)}
    monkeypatch.setattr(thresholds, "LEAST_DROP_IN_GAP", -np.inf)
    monkeypatch.setattr(thresholds, "SHARE_WORTH_FITTING", -np.inf)
    all_searched = searching.candidates(whole, before)
    assert all(c.searched for c in all_searched)
    left_out = [c for c in all_searched if not screened[c.effect].searched]
    assert left_out
    assert min(c.delta_bic for c in left_out) > DiagnoseConfig().adopt_bic
    if hidden is not None:
        assert all_searched[0].effect == hidden
        assert screened[hidden].delta_bic == pytest.approx(all_searched[0].delta_bic, rel=1e-6)


# --- Effects of two and three numbers, found with their values where the config forces them


VOLTAGES = (0.0, 150.0)
TESTS_FORCED = ((0.5, 0.005), (0.5, 0.03), (2.0, 0.01), (2.0, 0.03))
RIG = Scales(2500.0, 1300.0, 0.38, 0.03, 4.7, 2640.0, 150.0)
"""Of the plain damper on these tests, rounded."""
WITHIN = {"accumulator": 0.1, "bouc_wen": 0.15, "cavitation": 0.15, "frame_compliance": 0.15}
"""How near a fit on half a per cent of noise comes to every value, as a share of it."""


def test_every_effect_that_no_verdict_names_is_among_the_forced_ones() -> None:
    unnamed = {name for name in library().keys() - nameable().keys() if library()[name].hidden is not None}
    assert unnamed <= WITHIN.keys()


@pytest.mark.parametrize("name", WITHIN)
def test_the_values_of_a_forced_effect_are_found_again(name: str, rng: np.random.Generator) -> None:
    effect = library()[name]
    assert effect.hidden is not None
    values = effect.hidden(rng, RIG)(0.4)
    truth = damper_of(VOLTAGES, **{name: values})
    assert against_nature(truth) == ()
    records = sines(truth, rng, VOLTAGES, tests=TESTS_FORCED, cycles=3, noise=5e-3)
    evidence = evidence_of(campaign_of(records), damper_of(VOLTAGES))
    plain = fit(evidence.whole, (), evidence.whole.start())
    found = resumed(evidence.whole, plain, candidate(evidence.whole, plain, effect))
    assert found.fitted.misfit < 0.5 * plain.misfit
    fitted = found.fitted.damper.effects[name]
    for parameter, value in values.items():
        assert fitted[parameter] == pytest.approx(value, rel=WITHIN[name]), (parameter, values, fitted)


@pytest.mark.ci
def test_an_effect_is_named_where_the_oil_spring_follows_the_temperature_as_no_drift_does(
    rng: np.random.Generator,
) -> None:
    """T0 and C have a law of the temperature and k has none: the gains of the tests had to follow it in its place."""
    records = []
    for degC, a, b, c in ((20.0, 1.0, 1.0, 1.0), (60.0, 0.852, 0.67, 0.961)):
        rows = tuple(
            BaseRow(voltage_V=U, T0_N=a * T0, C_Ns_per_m=b * C, k_N_per_m=c * k)
            for U, T0, C, k in (
                (0.0, 180.0, 1700.0, 3.5e5),
                (40.0, 507.0, 1933.0, 4.17e5),
                (80.0, 807.0, 2167.0, 4.83e5),
                (120.0, 1080.0, 2400.0, 5.5e5),
            )
        )
        damper = Damper(base=rows, effects={"lash": {"delta": 3e-4}})
        voltages, tests = [row.voltage_V for row in rows], ((1.0, 0.02), (4.0, 0.008))
        made = sines(damper, rng, voltages, tests=tests, noise=0.004, colour=0.0, displacement_noise=3e-6)
        records += [replace(r, name=f"{r.name}-{degC:g}", temperature=np.full(r.time.size, degC)) for r in made]
    told = diagnosed(records).diagnosis
    assert (told.verdict, told.effects) == ("named", ("lash",)), told.reason
    assert told.parameters["lash"]["delta"].value == pytest.approx(3e-4, rel=0.02)
