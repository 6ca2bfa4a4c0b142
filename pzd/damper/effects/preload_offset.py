"""A constant force: the gas charge at mid-stroke, a weight on the load cell, or its zero offset.

Law: F_0. Range: gas-charged dampers 50-300 N. Friction that differs between the two directions, T0 (1 + alpha sign(F)),
is the constant alpha T0 as long as the rod slips. Neither gas nor zero knows the control signal, so an offset that goes
with it may be an `asymmetry` of the friction alone; one of -alpha T0 beside an `asymmetry` makes it a
`viscous_asymmetry`.
Beside an `accumulator`, whose law has one exponent, a gas of another leaves a constant: 13 % of F_g at most.
"""

from __future__ import annotations

import numpy as np

from pzd.damper.effect import Beside, Effect, EffectValues, Parameter, Search, growing
from pzd.damper.effects.accumulator import EXPONENTS, other_gas

LIKE_FRICTION = 0.3
"""Share by which an offset differs from -alpha T0 and may yet be that.

Reason: 0 to 15 % where damping alone differed between the directions (four rigs by a simulator of other authorship)."""


def _of_friction_or_gas(values: EffectValues, beside: Beside) -> str | None:
    """Return what else an offset may be by its value and what stands beside it; None for an offset.

    `asymmetry` where it goes with the control signal; `viscous_asymmetry` where it does so beside one, or undoes
    that of the friction; `accumulator` where it is what a gas of another exponent than that of its law leaves.
    """
    if isinstance(values["F_0"], tuple):
        return "viscous_asymmetry" if "asymmetry" in beside.effects else "asymmetry"
    gas = np.asarray(beside.effects.get("accumulator", {}).get("F_g", 0.0))
    least, most = sorted(1.0 - other_gas(exponent)[0] for exponent in EXPONENTS)
    if gas.any() and np.all((least * gas <= values["F_0"]) & (values["F_0"] <= most * gas)):
        return "accumulator"
    alpha = beside.effects.get("asymmetry", {}).get("alpha", 0.0)
    undone = -np.mean(alpha) * np.array(beside.T0)
    near = np.abs(values["F_0"] - undone) < LIKE_FRICTION * np.abs(undone)
    return "viscous_asymmetry" if np.all(near) else None


EFFECT = Effect(
    name="preload_offset",
    place="parallel",
    law="F_0",
    parameters=(
        Parameter(
            "F_0", "N", 0.0, -1.0e6, 1.0e6, "constant force beside the element", Search(lambda s: s.force, (0.0,))
        ),
    ),
    source="Dixon 2007, The Shock Absorber Handbook",
    tests=(({"x": 0.01, "v": 1.0, "a": 1.0, "F_0": 55.0}, 55.0),),
    nearly=_of_friction_or_gas,
    hidden=growing("F_0", lambda s: 0.5 * s.force, either=True),
)


def law(x: float, v: float, a: float, F_0: float) -> float:
    """Force [N] parallel to the element."""
    return F_0
