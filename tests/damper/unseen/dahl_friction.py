"""A friction that comes up over a travel, as a rubber lip does: Dahl's, whatever the speed.

Law: dF/dx = (F_c - F sign(v)) / 0.5 mm.
"""

from __future__ import annotations

import math

from pzd.damper.effect import Effect, Parameter, Search, growing

TRAVEL = 5.0e-4

EFFECT = Effect(
    name="dahl_friction",
    place="branch",
    law="dF/dx = (F_c - F sign(v)) / 0.5 mm",
    parameters=(Parameter("F_c", "N", 0.0, 0.0, 1.0e6, "friction", Search(lambda s: s.force, (0.05,))),),
    source="Dahl 1968, The Aerospace Corporation, TOR-0158(3107-18)-1",
    tests=(({"deflection": 0.0, "travel": 5.0e-4}, 3.1606027941427885e-4),),
    hidden=growing("F_c", lambda s: 0.5 * s.force),
)


def advance(deflection: float, travel: float) -> float:
    """Elastic deflection [m] after a travel to one side [m]."""
    end = math.copysign(TRAVEL, travel)
    return end + (deflection - end) * math.exp(-abs(travel) / TRAVEL)


def law(deflection: float, F_c: float) -> float:
    """Force [N] at an elastic deflection [m]."""
    return F_c * deflection / TRAVEL


def rate(deflection: float, side: float) -> float:
    """Derivative of the deflection by the travel to a side [-]."""
    return 1.0 - side * deflection / TRAVEL
