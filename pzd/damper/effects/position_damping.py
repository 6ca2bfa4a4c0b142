"""Damping that is another one in a zone of the stroke: bypass grooves, a port, a rod with a taper, a worn tube.

Law: c_p v exp(-((x - x_p)/b_p)^2), c_p below 0 where the zone is softer. Range: half of C to either side, b_p a third
of the stroke and more; a zone that is wider than the stroke, with its middle beyond an end, is damping that rises from
one end to the other. It fades beyond the zone, so that nothing grows outside the tested stroke. One speed at several
places of the stroke distinguishes it from every law of speed: a triangle, whose plateaus it bends.
"""

from __future__ import annotations

import math

from pzd.damper.effect import Effect, Parameter, Search

_C_P_SEARCH = Search(lambda s: s.damping, (0.3,))
_X_P_SEARCH = Search(lambda s: s.stroke, (-0.8, 0.0, 0.8), within=(-1.5, 1.5))
_B_P_SEARCH = Search(lambda s: s.stroke, (0.6,), logarithmic=True, within=(0.1, 3.0))
"""A zone narrower than a tenth of the half stroke makes no difference to a ride; one of three is the whole stroke."""

EFFECT = Effect(
    name="position_damping",
    place="parallel",
    law="c_p v exp(-((x - x_p)/b_p)^2)",
    parameters=(
        Parameter("c_p", "N s/m", 0.0, -1.0e6, 1.0e6, "damping that comes on top in the zone", _C_P_SEARCH),
        Parameter(
            "x_p", "m", 0.0, -10.0, 10.0, "displacement at the middle of the zone", _X_P_SEARCH, position="counted from"
        ),
        Parameter("b_p", "m", 0.02, 1.0e-4, 10.0, "half width of the zone, where 1/e of it is left", _B_P_SEARCH),
    ),
    source="position-sensitive damping by grooves in the tube; Dixon 2007, The Shock Absorber Handbook",
    tests=(
        ({"x": 0.01, "v": 0.5, "c_p": 300.0, "x_p": 0.01, "b_p": 0.02}, 150.0),
        ({"x": 0.03, "v": -0.5, "c_p": 300.0, "x_p": 0.01, "b_p": 0.02}, -55.18191617571635),  # 150/e
    ),
    imitates=True,
    asked_last=True,
    never_named="grooves, a port, a taper, wear and a side load all change the damping along the stroke, each with a "
    "shape of its own; the zone stands for any of them",
)


def law(x: float, v: float, c_p: float, x_p: float, b_p: float) -> float:
    """Force [N] parallel to the element at a displacement x [m] and a speed v [m/s]."""
    away = (x - x_p) / b_p
    return c_p * v * math.exp(-away * away)
