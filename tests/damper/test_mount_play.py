"""The play of a joint that bears the whole force, held to the unilateral contact that it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rod_end import RodEnd, sine

from pzd.damper.compose import respond
from pzd.damper.effect import functions
from pzd.damper.effects import library, mount_play
from pzd.damper.model import BaseRow, Damper
from pzd.record import Array

JOINT = RodEnd(T0=20.0, C=3000.0, k=1.5e6, gas=150.0, stiffness=0.0, play=2.5e-4)
TESTS = ((1.0, 0.02), (2.0, 0.02), (4.0, 0.005))


def of(joint: RodEnd, **changed: dict[str, float]) -> Damper:
    """The damper of a joint, with the law of the library for its play."""
    damper = Damper(base=(BaseRow(T0_N=joint.T0, C_Ns_per_m=joint.C, k_N_per_m=joint.k),))
    for name, values in (("preload_offset", {"F_0": -joint.gas}), *changed.items()):
        damper = damper.with_effect(name, values)
    return damper


def missed(damper: Damper, joint: RodEnd, frequency: float, amplitude: float) -> float:
    """What a damper misses of the force of a joint, r.m.s. over r.m.s."""
    motion = sine(frequency, amplitude)
    true = joint.force(motion)
    last: Array = motion.time > motion.time[-1] - 1.0 / frequency
    return float(np.std((respond(damper, motion) - true)[last]) / np.std(true[last]))


@pytest.mark.parametrize(("frequency", "amplitude"), TESTS)
@pytest.mark.parametrize("gas", [80.0, 150.0, 250.0])
def test_the_joint_is_free_where_the_flow_undoes_the_gas(gas: float, frequency: float, amplitude: float) -> None:
    joint = replace(JOINT, gas=gas)
    law = of(joint, mount_play={"delta": joint.play, "F_m": gas})
    without, as_lash = of(joint), of(joint, lash={"delta": joint.play})
    least = min(missed(each, joint, frequency, amplitude) for each in (without, as_lash))
    assert missed(law, joint, frequency, amplitude) < 0.3 * least
    assert least > 0.01


def test_a_gas_that_hardens_moves_the_place_but_little() -> None:
    joint = replace(JOINT, stiffness=400.0)
    law = of(joint, mount_play={"delta": joint.play, "F_m": joint.gas}, gas_spring={"k_g": 400.0})
    without = of(joint, gas_spring={"k_g": 400.0})
    assert missed(law, joint, 2.0, 0.02) < 0.5 * missed(without, joint, 2.0, 0.02)


def test_without_a_gas_it_is_free_play_before_the_oil() -> None:
    motion = sine(2.0, 0.02)
    joint, play = (of(replace(JOINT, gas=0.0), **{name: {"delta": 2.5e-4, **more}}) for name, more in LIMITS)
    force = respond(play, motion)
    np.testing.assert_allclose(respond(joint, motion), force, rtol=0, atol=0.01 * np.max(force))


LIMITS: tuple[tuple[str, dict[str, float]], ...] = (("mount_play", {"F_m": 0.0}), ("lash", {}))


@pytest.mark.parametrize("free", [-300.0, -2.0, 0.0, 40.0])
def test_the_law_and_its_inverse_agree_in_the_play_and_beside_it(free: float, rng: np.random.Generator) -> None:
    laws, play = functions(library()["mount_play"], mount_play), {"k": 1.5e6, "delta": 2.5e-4, "F_m": free}
    for force in rng.uniform(-500.0, 500.0, 200):
        side, extension = float(np.sign(force)), float(force) / 1.5e6
        deflection = laws["inverse"](extension, side, **play)
        assert laws["law"](deflection, side, **play) == pytest.approx(extension, rel=1e-9)
        step = 1e-9 * laws["slope"](deflection, side, **play)
        there = laws["law"](deflection + 1e-9, side, **play)
        assert there - extension == pytest.approx(step, rel=1e-3)
