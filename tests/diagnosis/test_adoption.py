"""Adoption: effects by voltage, two at once, and what is taken back."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from campaign import damper_of, sine, sines
from test_naming import TWO
from whole_diagnosis import diagnosed

from pzd.damper.compose import respond
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.search.acceptance import Selection, SelectionStep
from pzd.record import Record


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
        standing: Any = SimpleNamespace(effects=effects)
        nothing: Any = None
        return Selection(standing, standing, (spring_or_mass, then), {}, nothing, nothing)

    assert named("gas_spring", "asymmetry").rivals == ("fluid_inertia",)
    assert named("gas_spring", "asymmetry", "fluid_inertia").rivals == ()
    assert named("asymmetry").rivals == ()
