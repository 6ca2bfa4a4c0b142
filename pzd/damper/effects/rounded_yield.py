"""A rounded yield, as in magneto-rheological dampers: no stick, but a steep slope through zero.

Law: T0 becomes T0 tanh(w / w_s). Range: w_s 1-50 mm/s.
"""

from __future__ import annotations

import math

from pzd.damper.effect import Effect, Parameter, Search, growing

_SEARCH = Search(lambda s: s.speed, (0.01, 0.06), logarithmic=True)

EFFECT = Effect(
    name="rounded_yield",
    place="flow",
    law="T0 becomes T0 tanh(w/w_s)",
    parameters=(Parameter("w_s", "m/s", 0.0, 0.0, 2.0, "flow speed over which the yield builds up", _SEARCH),),
    source="Kwok et al. 2006, J. Sound Vib. 296, hyperbolic-tangent model of a magneto-rheological damper",
    tests=(({"w": 0.01, "T0": 400.0, "w_s": 0.01}, 304.63766238230594), ({"w": 0.0, "T0": 400.0, "w_s": 0.0}, 400.0)),
    hidden=growing("w_s", lambda s: 0.3 * s.speed),
)


def yield_force(w: float, T0: float, w_s: float) -> float:
    """Friction force [N] at a flow speed w >= 0 [m/s]."""
    return T0 if w_s <= 0.0 else T0 * math.tanh(w / w_s)


def yield_slope(w: float, T0: float, w_s: float) -> float:
    """Compute the derivative of the law by w [N s/m]."""
    if w_s <= 0.0 or w > 20.0 * w_s:
        return 0.0
    return T0 / (w_s * math.cosh(w / w_s) ** 2)
