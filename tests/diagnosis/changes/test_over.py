"""Quantities over several states: each against its limits, and those that are not followed reported open."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from states import campaign, drawn_damper, scaled, sine, state_of

from pzd.artefacts import Rig
from pzd.diagnosis.changes.over import blocks_of_cycles, followed_over
from pzd.diagnosis.changes.state import State
from pzd.diagnosis.config import ChangesConfig, DiagnoseConfig
from pzd.identification.config import IdentifyConfig
from pzd.identification.stage import identify
from pzd.quantities import Control


def test_friction_that_rises_leaves_its_limits_and_what_changed_in_no_state_stays_open(
    rng: np.random.Generator,
) -> None:
    damper = drawn_damper(rng, voltages=(0.0,))
    friction = damper.base[0].T0_N
    states = [state_of(f"{f:g}", campaign(scaled(damper, T0_N=f), rng)) for f in (1.0, 1.1, 1.3)]

    def followed(**tolerance: tuple[float, float]):  # type: ignore[no-untyped-def]  # noqa: ANN202
        changes = ChangesConfig(tolerance={name.replace("__", "."): limits for name, limits in tolerance.items()})
        return followed_over(states, DiagnoseConfig(), IdentifyConfig(), changes, Control()).course

    course = followed(T0=(0.0, 1.2 * friction), gas_spring__k_g=(0.0, 1.0))
    (row,) = [row for row in course.over if row.name == "T0"]
    assert row.values == pytest.approx([friction, 1.1 * friction, 1.3 * friction], rel=0.03)
    assert (row.pass_, course.pass_) == (False, False)
    assert "T0 is outside its limits from 1.3 on" in course.reason
    assert "gas_spring.k_g changed in no state" in course.reason
    assert followed(T0=(0.0, 2.0 * friction)).pass_ is True
    assert followed(T0=(0.0, 2.0 * friction), gas_spring__k_g=(0.0, 1.0)).pass_ is None


def test_limits_of_the_friction_of_a_seal_are_those_of_t0() -> None:
    with pytest.raises(ValueError, match=r"no quantity is called seal\.F_s"):
        ChangesConfig(tolerance={"seal.F_s": (10.0, 20.0)})


def test_the_force_that_fades_in_a_long_test_is_followed_over_its_cycles(rng: np.random.Generator) -> None:
    damper = drawn_damper(rng, voltages=(0.0,))
    count, lost = 16, 0.15
    records = [sine(damper, 0.0, f, 0.02, rng, noise=0.003, scatter=0.0, cycles=count) for f in (1.0, 2.0)]
    fading = [replace(r, force=r.force * (1.0 - lost * r.time / r.time[-1])) for r in records]
    blocks = blocks_of_cycles(Rig(tuple(fading), ()), None)
    states = [State.of(name, rig, identify(IdentifyConfig(), rig, 1), None, Control()) for name, rig in blocks]
    course = followed_over(states, DiagnoseConfig(), IdentifyConfig(), ChangesConfig(), Control()).course
    assert (course.states[0], course.states[-1]) == ("cycles 1-2", "cycles 15-16")
    rows = {row.name: np.array(row.values, dtype=float) for row in course.over}
    middles = (np.arange(8) + 0.5) / 8
    for name in ("T0", "C"):
        followed = rows[name] / rows[name][0]
        assert followed == pytest.approx((1.0 - lost * middles) / (1.0 - lost * middles[0]), abs=0.02)
    assert course.verdict != "unchanged"
    assert "load_cell_gain" in course.rivals  # at one level it cannot be told from all of T0, C and k


def test_what_stays_as_it_is_passes_its_limits_and_fails_those_that_it_never_met(rng: np.random.Generator) -> None:
    """A good part is told good: a quantity of the first damper needs no change to be held to its limits."""
    gas = 3000.0
    damper = drawn_damper(rng, voltages=(0.0,)).with_effect("gas_spring", {"k_g": gas})
    damping = damper.base[0].C_Ns_per_m
    states = [replace(state_of(name, campaign(damper, rng)), damper=damper) for name in ("first", "second")]
    tolerance = {"C": (0.9 * damping, 1.1 * damping), "gas_spring.k_g": (0.8 * gas, 1.2 * gas)}

    def passed(tolerance: dict[str, tuple[float, float]]) -> bool | None:
        changes = ChangesConfig(tolerance=tolerance)
        return followed_over(states, DiagnoseConfig(), IdentifyConfig(), changes, Control()).course.pass_

    assert passed(tolerance) is True
    assert passed(tolerance | {"gas_spring.k_g": (1.3 * gas, 1.5 * gas)}) is False
