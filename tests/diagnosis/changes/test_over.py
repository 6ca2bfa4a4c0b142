"""Quantities over several states: each against its limits, and those that are not followed reported open."""

from __future__ import annotations

import numpy as np
import pytest
from states import campaign, drawn_damper, scaled, state_of

from pzd.diagnosis.changes.over import followed_over
from pzd.diagnosis.config import ChangesConfig, DiagnoseConfig
from pzd.identification.config import IdentifyConfig
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
