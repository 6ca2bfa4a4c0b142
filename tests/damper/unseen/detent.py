"""A force that waves over the position: magnets, a thread, a wavy guide.

Law: F_d sin(2 pi x / 15 mm).
"""

from __future__ import annotations

import math

from pzd.damper.effect import Effect, Parameter, Search, growing

PITCH = 0.015

EFFECT = Effect(
    name="detent",
    place="parallel",
    law="F_d sin(2 pi x / 15 mm)",
    parameters=(Parameter("F_d", "N", 0.0, 0.0, 1.0e6, "amplitude of the wave", Search(lambda s: s.force, (0.05,))),),
    source="made up for a test",
    tests=(({"x": 0.00375, "F_d": 100.0}, 100.0),),
    hidden=growing("F_d", lambda s: 0.5 * s.force),
)


def law(x: float, F_d: float) -> float:
    """Force [N] beside the element at a displacement x [m]."""
    return F_d * math.sin(2.0 * math.pi * x / PITCH)
