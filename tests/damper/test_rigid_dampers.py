"""A rigid damper with effects: the flow is as fast as the rod, and the force is that of the flow curve."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pzd.artefacts import Diagnosed
from pzd.damper.compose import respond, steady_force
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.quantities import Control

EFFECTS: dict[str, dict[str, float]] = {
    "orifice_quadratic": {"q": 1500.0},
    "relief_valve": {"F_r": 420.0, "C_r": 300.0},
    "shear_thinning": {"n": 0.7},
    "asymmetry": {"alpha": 0.2},
    "rounded_yield": {"w_s": 0.02},
    "gas_spring": {"k_g": 5e3},
    "preload_offset": {"F_0": 40.0},
}
TIME = np.arange(0.0, 2.0, 1e-3)


def sine(rng: np.random.Generator) -> Motion:
    """A sine of any phase."""
    omega, phase = 2.0 * np.pi * 1.3, rng.uniform(0.0, 2.0 * np.pi)
    x, v = 0.02 * np.sin(omega * TIME + phase), 0.02 * omega * np.cos(omega * TIME + phase)
    return Motion(TIME, x, v, -(omega**2) * x)


def rigid(**effects: dict[str, float]) -> Damper:
    return Damper(base=(BaseRow(T0_N=300.0, C_Ns_per_m=1500.0, k_N_per_m=np.inf),), effects=effects)


@pytest.mark.parametrize("effect", EFFECTS)
def test_the_force_is_that_of_the_flow_curve_at_the_speed_of_the_rod(effect: str, rng: np.random.Generator) -> None:
    damper, motion = rigid(**{effect: EFFECTS[effect]}), sine(rng)
    force = respond(damper, motion)
    beside = (
        np.zeros(TIME.size) + EFFECTS[effect].get("F_0", 0.0) + EFFECTS[effect].get("k_g", 0.0) * motion.displacement
    )
    curve = steady_force(damper, None, None, motion.velocity) + beside
    away = np.abs(motion.velocity) > 0.1 * np.max(np.abs(motion.velocity))
    away[0] = False  # an element is relaxed there
    np.testing.assert_allclose(force[away], curve[away], atol=3e-4 * np.max(np.abs(curve)))


def test_stiffer_dampers_with_an_effect_go_to_the_rigid_one(rng: np.random.Generator) -> None:
    motion = sine(rng)
    limit = respond(rigid(orifice_quadratic={"q": 1500.0}), motion)
    away = []
    for k in (1e6, 1e7, 1e8):
        base = (BaseRow(T0_N=300.0, C_Ns_per_m=1500.0, k_N_per_m=k),)
        stiff = respond(Damper(base=base, effects={"orifice_quadratic": {"q": 1500.0}}), motion)
        away.append(float(np.median(np.abs(stiff - limit))))
    assert away[0] > 8.0 * away[1] > 64.0 * away[2]


def test_a_rigid_damper_reads_back_as_it_was_written(tmp_path: Path) -> None:
    damper = rigid()
    Diagnosed.undiagnosed(damper).write(tmp_path, Control())
    assert Diagnosed.read(tmp_path, Control()).damper == damper
    assert Damper.model_validate_json(damper.model_dump_json()) == damper
