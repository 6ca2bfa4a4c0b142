"""The gas of an accumulator: against the gas equation by another solver, and its distinction from a linear spring."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pzd.damper.compose import respond, static_force, steady_force
from pzd.damper.effects.accumulator import law
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion

PLAIN = Damper(base=(BaseRow(T0_N=300.0, C_Ns_per_m=2700.0, k_N_per_m=2e6),))
PRESSURE, AREA, VOLUME = 25e5, np.pi / 4.0 * 0.014**2, 16e-6
GAS = {"F_g": PRESSURE * AREA, "L": VOLUME / AREA}
ROD = PLAIN.with_effect("accumulator", GAS)


def stroke(half: float, frequency: float = 0.05, samples: int = 2000) -> Motion:
    """Three cycles of a sine about the middle of the stroke."""
    time = np.linspace(0.0, 3.0 / frequency, 3 * samples + 1)
    w = 2.0 * np.pi * frequency
    x, v = half * np.sin(w * time), half * w * np.cos(w * time)
    return Motion(time, x, v, -(w**2) * x, None)


def beside(motion: Motion, damper: Damper) -> np.ndarray:
    """(n,) what stands beside the element [N]."""
    return respond(damper, motion) - respond(PLAIN, motion)


def test_an_accumulator_is_a_polytropic_gas_as_another_solver_compresses_it() -> None:
    """dp/dV = -n p/V from the static pressure on, V = V_0 + A x; the rod feels -p A."""
    motion = stroke(0.06, 1.0)

    def rate(t: float, p: np.ndarray) -> np.ndarray:
        w = 2.0 * np.pi
        volume = VOLUME + AREA * 0.06 * np.sin(w * t)
        return np.asarray(-1.3 * p / volume * AREA * 0.06 * w * np.cos(w * t))

    gas = solve_ivp(rate, (0.0, 3.0), [PRESSURE], "DOP853", motion.time, rtol=1e-11, atol=1e-3)
    force = beside(motion, ROD)
    np.testing.assert_allclose(force, -AREA * gas.y[0], rtol=0, atol=1e-8 * np.max(np.abs(force)))


def test_its_stiffness_at_both_ends_distinguishes_an_accumulator_from_a_gas_spring_with_a_preload() -> None:
    """By the mean of rebound and compression on a wide slow stroke, as a laboratory has it."""
    half = 0.06
    motion = stroke(half)
    linear = {"gas_spring": {"k_g": 1.3 * GAS["F_g"] / GAS["L"]}, "preload_offset": {"F_0": -GAS["F_g"]}}

    def steepness(damper: Damper) -> float:
        """Of the mean of both ways near the inner end, over that near the outer one."""
        last = slice(2 * (motion.time.size - 1) // 3, None)
        x, v, force = motion.displacement[last], motion.velocity[last], respond(damper, motion)[last]
        at = np.array([-0.96, -0.94, 0.94, 0.96]) * half
        ways = [np.interp(at, x[way][np.argsort(x[way])], force[way][np.argsort(x[way])]) for way in (v > 0.0, v < 0.0)]
        mean = np.mean(ways, axis=0)
        return float((mean[1] - mean[0]) / (mean[3] - mean[2]))

    assert steepness(PLAIN.model_copy(update={"effects": linear})) == pytest.approx(1.0, rel=1e-3)
    L, X = GAS["L"], 0.95 * half
    assert steepness(ROD) == pytest.approx(((L + X) / (L - X)) ** (1.3 + 1.0), rel=0.01)
    assert steepness(ROD) > 5.0
    small = stroke(1e-4)
    together = PLAIN.model_copy(update={"effects": linear})
    np.testing.assert_allclose(beside(small, ROD), beside(small, together), rtol=0, atol=1e-5 * GAS["F_g"])


def test_another_zero_of_the_displacement_is_another_gas_of_the_same_law() -> None:
    """So no zero has to be looked for: F_g and L count from the middle of what was recorded."""
    away = 0.02
    L = GAS["L"] + away
    for x in np.linspace(-0.06, 0.06, 13):
        moved = law(float(x), -law(away, **GAS), L)
        assert moved == pytest.approx(law(float(x) + away, **GAS), rel=1e-12)


def test_an_accumulator_is_left_to_the_static_balance_and_absent_from_steady_slip() -> None:
    assert static_force(ROD, None) == pytest.approx(-GAS["F_g"], rel=1e-12)
    speeds = np.array([-0.3, -0.0, 0.0, 0.3])
    np.testing.assert_allclose(steady_force(ROD, None, None, speeds), steady_force(PLAIN, None, None, speeds))


def test_a_rod_that_would_fill_the_gas_meets_a_finite_force() -> None:
    forces = [law(x, **GAS) for x in (-0.99 * GAS["L"], -GAS["L"], -2.0 * GAS["L"])]
    assert forces[0] == forces[1] == forces[2]
    assert np.isfinite(forces).all()
    assert forces[0] < 20.0 * law(0.0, **GAS)
