"""Stiffness of the gas charge, which pushes the rod out: a force that rises with the displacement.

Law: k_g x. Range: monotube dampers 1-5 kN/m; the sign is left free, for the mount may pull.
"""

from __future__ import annotations

from pzd.damper.effect import Effect, Parameter, Search, growing

_SEARCH = Search(lambda s: s.force / s.stroke, (0.0,))

EFFECT = Effect(
    name="gas_spring",
    place="parallel",
    law="k_g x",
    parameters=(
        Parameter("k_g", "N/m", 0.0, -1.0e7, 1.0e7, "stiffness beside the element", _SEARCH, natural_from=0.0),
    ),
    source="Dixon 2007, The Shock Absorber Handbook",
    tests=(({"x": 0.01, "v": 1.0, "a": 1.0, "k_g": 2000.0}, 20.0),),
    hidden=growing("k_g", lambda s: 0.5 * s.force / s.stroke),
)


def law(x: float, v: float, a: float, k_g: float) -> float:
    """Force [N] parallel to the element at a displacement x [m]."""
    return k_g * x
