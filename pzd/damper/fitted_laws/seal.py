"""Friction of the rod's seal and of the piston's band, beside the oil: it turns round with the rod.

Law: F_s tanh(v/v_s); T0 of the element instead lies behind the oil spring and turns round with the flow. Range: 10 to
60 N, v_s up to 5 mm/s: below it the lip gives, and creeps.
"""

from __future__ import annotations

from math import tanh

from pzd.damper.effect import Effect, Parameter, Search

_V_S_SEARCH = Search(lambda s: s.speed, (0.003,), logarithmic=True, within=(0.0, 0.05))
"""Of the fastest test: what has not turned at a twentieth of that is damping, and no friction."""

EFFECT = Effect(
    name="seal",
    place="parallel",
    law="F_s tanh(v/v_s)",
    parameters=(
        Parameter("F_s", "N", 0.0, 0.0, 1.0e6, "friction on the rod", Search(lambda s: s.force, (0.02,))),
        Parameter("v_s", "m/s", 1.0e-3, 1.0e-5, 1.0, "speed by which it has turned", _V_S_SEARCH),
    ),
    source="regularised Coulomb friction; Andersson, Soderberg and Bjorklund 2007, Tribology International 40(4)",
    tests=(
        ({"x": 0.0, "v": 0.002, "a": 0.0, "F_s": 100.0, "v_s": 0.002}, 76.15941559557649),
        ({"x": 0.0, "v": -0.5, "a": 0.0, "F_s": 100.0, "v_s": 0.002}, -100.0),
    ),
    by_speed_alone=True,
)


def law(x: float, v: float, a: float, F_s: float, v_s: float) -> float:
    """Force [N] parallel to the element at a piston speed v [m/s]."""
    return F_s * tanh(v / v_s)
