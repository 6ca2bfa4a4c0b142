"""Difference of rebound and compression in the damping alone: other bleeds or shims, beside a friction alike both ways.

Law: C times (1 + alpha_C sign(F)), T0 as it is. Range: as that of an `asymmetry`, its nearest neighbour, which scales
T0 too, as ports of two sizes scale the yield of a fluid. Between the two lies alpha T0, a constant as long as the rod
slips: a T0 that changes with the control signal distinguishes them, and where T0 does not, a load cell whose zero is
known and no gas. Without friction the two are one, an `asymmetry`.
"""

from __future__ import annotations

import numpy as np

from pzd.damper.effect import Beside, Effect, EffectValues, Parameter, Search, growing
from pzd.signals.measures import VISIBLE


def _without_friction(values: EffectValues, beside: Beside) -> str | None:
    """Return why such values are those of an `asymmetry`; None where a friction tells the two apart."""
    if np.max(np.abs(values["alpha_C"])) * max(beside.T0) > VISIBLE * beside.force:
        return None
    return "the same as asymmetry: there is no friction that it could leave as it is"


def _beside_a_constant(values: EffectValues, beside: Beside) -> str | None:
    """Return `asymmetry` where a constant force beside one T0 makes one of the other; None elsewhere."""
    apart = np.max(np.abs(values["alpha_C"])) * np.ptp(beside.T0)
    return "asymmetry" if beside.static and apart < VISIBLE * beside.force else None


EFFECT = Effect(
    name="viscous_asymmetry",
    place="flow",
    law="C times (1 + alpha_C sign(F))",
    parameters=(
        Parameter(
            "alpha_C", "-", 0.0, -0.95, 0.95, "share by which C is larger in rebound", Search(lambda _: 1.0, (0.0,))
        ),
    ),
    source="Dixon 2007, The Shock Absorber Handbook",
    tests=(({"side": 1.0, "alpha_C": 0.1}, 1.1), ({"side": -1.0, "alpha_C": 0.1}, 0.9)),
    nearly=_beside_a_constant,
    contradicted=_without_friction,
    hidden=growing("alpha_C", lambda _: 0.5, either=True),
)


def bleed_factor(side: float, alpha_C: float) -> float:
    """Factor on C by the sign of the force."""
    return 1.0 + alpha_C * side
