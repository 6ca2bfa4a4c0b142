"""Dry friction parallel to the damper, of a guide or a mount: without elastic travel, and the same at every speed.

Law: F_g sign(v). It is the limit v_s -> infinity of `stribeck_friction`.
"""

from __future__ import annotations

import math

from pzd.damper.effect import Effect, Parameter, Search

EFFECT = Effect(
    name="guide_friction",
    place="parallel",
    law="F_g sign(v)",
    parameters=(Parameter("F_g", "N", 0.0, 0.0, 1.0e6, "friction", Search(lambda s: s.force, (0.02,))),),
    source="Armstrong-Helouvry, Dupont and Canudas de Wit 1994, Automatica 30(7)",
    tests=(
        ({"x": 0.0, "v": 0.02, "a": 0.0, "F_g": 20.0}, 20.0),
        ({"x": 0.0, "v": -1.0, "a": 0.0, "F_g": 20.0}, -20.0),
        ({"x": 0.0, "v": 0.0, "a": 0.0, "F_g": 20.0}, 0.0),
    ),
)


def law(x: float, v: float, a: float, F_g: float) -> float:
    """Force [N] parallel to the element at a piston speed v [m/s]."""
    return math.copysign(F_g, v) if v != 0.0 else 0.0
