"""The initial force of a damper: the element carries what the parallel forces do not."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion

TIME = np.arange(600) * 1e-3
BASE = (BaseRow(T0_N=300.0, C_Ns_per_m=2700.0, k_N_per_m=2e5),)
BESIDE = [
    {"preload_offset": {"F_0": 200.0}},
    {"gas_spring": {"k_g": 4000.0}},
    {"fluid_inertia": {"m": 30.0}},
    {"preload_offset": {"F_0": -150.0}, "gas_spring": {"k_g": 4000.0}},
]


def within_the_stick(middle: float) -> Motion:
    """A motion so small that 300 N of friction are never reached."""
    w, a = 2 * np.pi * 2.0, 2e-4
    return Motion(TIME, middle + a * np.cos(w * TIME), -a * w * np.sin(w * TIME), -a * w * w * np.cos(w * TIME))


@pytest.mark.parametrize("effects", BESIDE, ids="+".join)
def test_a_damper_that_never_slips_goes_on_from_the_recorded_force(effects: dict) -> None:
    """F - F_1 is that of the springs and masses side by side, wherever the recording began."""
    motion, damper = within_the_stick(0.01), Damper(base=BASE, effects=effects)
    force = respond(damper, motion, 100.0)
    values = {key: value for each in effects.values() for key, value in each.items()}
    stiffness, mass = 2e5 + values.get("k_g", 0.0), values.get("m", 0.0)
    x, a = motion.displacement, motion.acceleration
    np.testing.assert_allclose(force, 100.0 + stiffness * (x - x[0]) + mass * (a - a[0]), atol=1e-8)


def test_without_a_force_to_begin_with_the_oil_spring_is_relaxed() -> None:
    motion = within_the_stick(0.0)
    force = respond(Damper(base=BASE, effects={"preload_offset": {"F_0": 200.0}}), motion)
    np.testing.assert_allclose(force, 200.0 + 2e5 * (motion.displacement - motion.displacement[0]), atol=1e-8)
