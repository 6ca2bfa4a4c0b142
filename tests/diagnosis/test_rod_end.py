"""Play of a joint is told from play before the oil by the force at which it is passed: that of the gas, or none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rod_end import RodEnd, sine
from synthetic import all_but, coloured, diagnosed

from pzd.artefacts import Diagnosis, Rig
from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.changes.comparison import changes_between
from pzd.diagnosis.changes.state import State
from pzd.diagnosis.config import DiagnoseConfig
from pzd.identification.config import IdentifyConfig
from pzd.identification.stage import identify
from pzd.quantities import Control
from pzd.record import Array, Record

JOINT = RodEnd(T0=60.0, C=3000.0, k=1.0e6, gas=180.0, stiffness=0.0, play=3.0e-4)
TESTS = ((0.5, 0.025), (1.0, 0.02), (2.0, 0.02), (3.0, 0.012), (4.0, 0.008))
LOOKED_FOR = ("mount_play", "lash", "cavitation", "preload_offset", "gas_spring", "asymmetry", "rounded_yield")


def record(motion: Motion, force: Array, rng: np.random.Generator) -> Record:
    """A test with noise of 0.3 % of the peak, without its first cycle."""
    peak = float(np.max(np.abs(force)))
    noisy = force + coloured(rng, force.size, 0.003 * peak, 0.5)
    x, v, a = motion.displacement, motion.velocity, motion.acceleration
    return Record(f"{np.max(v):.3f}", None, motion.time, x, v, a, noisy, None)


def told(forces: list[tuple[Motion, Array]], rng: np.random.Generator) -> Diagnosis:
    """The diagnosis of the tests, the most likely neighbours among the candidates."""
    records = [record(motion, force, rng) for motion, force in forces]
    return diagnosed(records, forbid=all_but(*LOOKED_FOR)).diagnosis


@pytest.mark.ci
def test_play_of_a_joint_is_named_beside_the_gas_that_it_bears(rng: np.random.Generator) -> None:
    motions = [sine(f, x, cycles=8) for f, x in TESTS]
    found = told([(motion, JOINT.force(motion)) for motion in motions], rng)
    assert (found.verdict, {*found.effects}, found.rivals) == ("named", {"mount_play", "preload_offset"}, ())
    play = {name: value.value for name, value in found.parameters["mount_play"].items()}
    assert play == pytest.approx({"delta": JOINT.play, "F_m": JOINT.gas}, rel=0.05)


@pytest.mark.ci
def test_beside_a_gas_that_hardens_play_of_a_joint_predicts_though_something_is_left(rng: np.random.Generator) -> None:
    joint = replace(JOINT, stiffness=500.0)
    found = told([(motion, joint.force(motion)) for motion in (sine(f, x, cycles=8) for f, x in TESTS)], rng)
    assert "mount_play" in found.effects, found.reason
    assert found.prediction is not None
    assert found.prediction.W_s < 0.01 * found.prediction.W_s_plain


@pytest.mark.ci
@pytest.mark.parametrize("gas", [0.0, 180.0])
def test_play_before_the_oil_is_none_of_a_joint(gas: float, rng: np.random.Generator) -> None:
    damper = Damper(base=(BaseRow(T0_N=JOINT.T0, C_Ns_per_m=JOINT.C, k_N_per_m=JOINT.k),))
    damper = damper.with_effect("lash", {"delta": JOINT.play}).with_effect("preload_offset", {"F_0": -gas})
    motions = [sine(f, x, cycles=8) for f, x in TESTS]
    found = told([(motion, respond(damper, motion)) for motion in motions], rng)
    assert found.verdict == "named", found.reason
    assert {*found.effects} - {"preload_offset"} == {"lash"}


def test_without_a_gas_no_joint_is_looked_for(rng: np.random.Generator) -> None:
    joint = replace(JOINT, gas=0.0, stiffness=0.0)
    found = told([(motion, joint.force(motion)) for motion in (sine(f, x, cycles=8) for f, x in TESTS[1:4])], rng)
    assert (found.verdict, found.effects) == ("named", ("lash",)), found.reason
    assert "mount_play" not in {row.effect for row in found.ranking}


def test_a_rod_end_that_has_worn_is_what_changed(rng: np.random.Generator) -> None:
    """Its play is passed where the gas of the first state is undone, however large it is."""

    def state(name: str, play: float) -> State:
        motions = [sine(f, x, cycles=8) for f, x in TESTS[:4]]
        rig = Rig(tuple(record(m, replace(JOINT, play=play).force(m), rng) for m in motions), ())
        found = State.of(name, rig, identify(IdentifyConfig(), rig, 1), None, Control())
        whole = Damper(base=(BaseRow(T0_N=JOINT.T0, C_Ns_per_m=JOINT.C, k_N_per_m=JOINT.k),))
        return replace(found, damper=whole.with_effect("preload_offset", {"F_0": -JOINT.gas}))

    states = state("new", 1e-9), state("worn", JOINT.play)
    changes = changes_between(*states, DiagnoseConfig(), IdentifyConfig(), Control()).changes
    assert (changes.verdict, {c.name for c in changes.changes}) == ("changed", {"mount_play"}), changes.reason
    worn = {c.parameter: c.to for c in changes.changes}
    assert worn == pytest.approx({"delta": JOINT.play, "F_m": JOINT.gas}, rel=0.1)
