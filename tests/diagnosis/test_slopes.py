"""Residuals and slopes of a search: those of the whole damper, by every variable, at every kind of test."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from numpy.random import Generator
from synthetic import damper_of

import pzd.diagnosis.fit.sensitivities as sensitivities_module
from pzd.damper.compose import respond, sensors_of
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.campaign import Campaign, evidence_of
from pzd.diagnosis.cleaned_records import clean
from pzd.diagnosis.fit.least_squares import fit
from pzd.diagnosis.fit.likelihood import SIMULATION_TOLERANCE, prompt_force, shown_force
from pzd.diagnosis.fit.problem import Problem
from pzd.diagnosis.fit.sensitivities import linearise
from pzd.diagnosis.roles import split
from pzd.record import Array, Record
from pzd.signals.kinematics import kinematics
from pzd.signals.nuisance import NuisanceConfig

ROW = BaseRow(voltage_V=0.0, T0_N=400.0, C_Ns_per_m=2500.0, k_N_per_m=4.0e5)
CHARGED = Damper(base=(ROW,), effects={"gas_spring": {"k_g": 1330.0}})


def two_tones(damper: Damper, tones: Sequence[tuple[float, float]], rng: Generator) -> Problem:
    """Two tones of those amplitudes [m] and frequencies [Hz], sampled at 500 Hz, with 5 N of noise."""
    t = np.arange(0.0, 10.0, 1.0 / 500.0)
    x = np.sum([a * np.sin(2.0 * np.pi * f * t) for a, f in tones], axis=0)
    smooth = kinematics(t, x, None)
    volts = np.zeros(t.size)
    force = respond(damper, Motion(t, x, smooth.velocity, smooth.acceleration, volts))
    measured = force + 5.0 * rng.standard_normal(t.size)
    tests = clean((Record("two tones", None, t, x, smooth.velocity, smooth.acceleration, measured, volts),))
    return evidence_of(Campaign(tests, split(tests, None, 2.0), NuisanceConfig()), damper).whole


BOTH = (0.0, 150.0)
EFFECTS = {
    "orifice_quadratic": {"q": 3000.0},
    "rounded_yield": {"w_s": 0.01},
    "relief_valve": {"F_r": 900.0, "C_r": 700.0},
    "lash": {"delta": 4e-4},
    "asymmetry": {"alpha": 0.2},
    "gas_spring": {"k_g": 4000.0},
    "accumulator": {"F_g": 300.0, "L": 0.1},
    "stribeck_friction": {"F_s": 80.0, "v_s": 0.04},
    "second_branch": {"T0_2": 100.0, "k_2": 5e4},
    "sensor_delay": {"tau": 2e-3},
    "temperature_drift": {"beta_T0": 0.01, "beta_C": 0.02},
    "valve_lag": {"tau": 8e-3},
    "piezo_hysteresis": {"r": 6.0},
}


def whole(effects: dict[str, dict[str, float]], rng: Generator, *, moving: bool) -> tuple[Problem, Damper]:
    """A sine at one voltage that repeats, or two tones at a voltage that goes to and fro while the oil warms by 8 K."""
    plain = damper_of(BOTH)
    damper = Damper(base=plain.base, effects=effects, reference_temperature_degC=22.0)
    t = np.arange(0.0, 4.0, 2e-3)
    warmth = np.full(t.size, 22.0) + (2.0 * t if "temperature_drift" in effects else 0.0)
    x = 0.02 * np.sin(2.0 * np.pi * t) + (0.004 * np.sin(2.0 * np.pi * 4.3 * t) if moving else 0.0)
    volts = 75.0 + 70.0 * np.sin(2.0 * np.pi * 0.7 * t) if moving else np.full(t.size, 150.0)
    smooth = kinematics(t, x, None)
    force = respond(damper, Motion(t, x, smooth.velocity, smooth.acceleration, volts, warmth))
    measured = force + 5.0 * rng.standard_normal(t.size)
    record = Record("test", None, t, x, smooth.velocity, smooth.acceleration, measured, volts, warmth)
    tests = clean((record,))
    return evidence_of(Campaign(tests, split(tests, None, 2.0), NuisanceConfig()), damper).whole, damper


@pytest.mark.parametrize("moving", [False, True], ids=["one voltage", "moving"])
@pytest.mark.parametrize("effect", EFFECTS)
def test_residuals_and_jacobian_are_those_of_the_whole_damper(effect: str, moving: bool, rng: Generator) -> None:
    """As the stand computes it from the config, and differenced with an exact path, by every searched variable."""
    problem, damper = whole({effect: EFFECTS[effect]}, rng, moving=moving)
    (o,), unknowns, x = problem.observations, problem.unknowns((effect,)), problem.start_with(damper)
    free = np.full(x.size, np.inf)
    left = linearise(problem, unknowns, x, (-free, free))

    def force(place: int, by: float, tolerance: float) -> Array:
        moved = x.copy()
        moved[place] += by
        of = problem.point(moved, unknowns).damper
        sensors = sensors_of(of)
        prompt = of.model_copy(update={"effects": {n: e for n, e in of.effects.items() if n not in sensors}})
        return o.through_sensors(respond(prompt, o.motion, o.initial_force, tolerance), sensors)

    here, sensors = prompt_force(o, problem.point(x, unknowns).damper)
    np.testing.assert_allclose(
        left.simulated[0], o.at_compared(force(0, 0.0, SIMULATION_TOLERANCE)), atol=1e-6 * o.peak
    )
    counted = o.residual_and_slopes(here, np.zeros((here.size, 0)), sensors)[:, 0]
    np.testing.assert_allclose(left.residuals[0], counted, rtol=1e-5, atol=1e-5)
    for j in range(x.size):
        slope = (force(j, 2e-5, 1e-11) - force(j, -2e-5, 1e-11)) / 4e-5  # a branch slips at other samples beyond
        exact = o.residual_and_slopes(here, slope[:, None], sensors)[:, 1]
        missed = np.linalg.norm(left.jacobian.dense()[:, j] - exact)
        assert missed <= 0.02 * np.linalg.norm(exact) + 1e-9, (j, missed / np.linalg.norm(exact))


def test_a_factor_common_to_all_forces_moves_them_in_proportion(rng: Generator) -> None:
    """The gain of a test leaves this one direction nearly open, where a search goes by what little is left of it."""
    asked = two_tones(CHARGED, ((0.01, 1.38), (0.01, 1.42)), rng)
    start = asked.start_with(CHARGED)
    found = fit(asked, ("gas_spring",), start, evaluations=1)
    friction, damping, compliance, charge = start
    # C and 1/k are the hyperbolic sines of their coordinates; the first grows with the forces, the second falls
    along = found.jacobian.dense() @ np.array([friction, np.tanh(damping), -np.tanh(compliance), charge])
    shown = [shown_force(o, found.damper) for o in asked.observations]
    exact = [o.residual_and_slopes(f, f[:, None])[:, 1] for o, f in zip(asked.observations, shown, strict=True)]
    assert np.linalg.norm(along - np.concatenate(exact)) < 0.02 * np.linalg.norm(along)


def test_slopes_beyond_the_floating_numbers_leave_residuals_and_jacobian_finite(
    rng: Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As those next to C = 0 under a power law, from some sample of a test on: the search ended there as a fault."""
    problem, damper = whole({"shear_thinning": {"n": 0.5}}, rng, moving=True)
    unknowns, x = problem.unknowns(("shear_thinning",)), problem.start_with(damper)
    free = np.full(x.size, np.inf)
    sound = linearise(problem, unknowns, x, (-free, free))
    computed = sensitivities_module.sensitivities

    def overflowing(*given: Any) -> tuple[Array, Array]:
        force, slopes = computed(*given)
        slopes[force.size // 2 :] = np.nan
        return force, slopes

    monkeypatch.setattr(sensitivities_module, "sensitivities", overflowing)
    found = linearise(problem, unknowns, x, (-free, free))
    np.testing.assert_array_equal(found.residuals[0], sound.residuals[0])
    jacobian = found.jacobian.dense()
    assert np.all(np.isfinite(jacobian))
    assert np.any(jacobian != 0.0)
