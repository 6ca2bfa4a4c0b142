"""A frame, mount or rubber bushing in series with the oil stiffness: soft at first, hardening to a limit.

Law: F = k e, x - y = e + d_f F/(|F| + F_f): a mount of stiffness k_f = F_f/d_f at no force that hardens and gives d_f
at most to either side. The oil may be rigid beside it, 1/k = 0. A linear frame is left out, for no test distinguishes
it from a softer k: with e = F/k and x - y = F/k + F/k_f, F = k k_f/(k + k_f) (x - y), at every voltage; where it
carries the parallel forces as well, it belongs to the stand. Range: d_f 0.1-3 mm. Its nearest neighbours are `lash`,
and a smaller k. A stroke so short that nothing slips distinguishes it from both: free play carries no force there, a
linear spring is as stiff at twice the stroke, and this one hardens. `cavitation` hardens to one side alone. A mount
that gives way at once is a `lash`, and named so.
"""

from __future__ import annotations

import numpy as np

from pzd.damper.effect import Effect, Parameter, Scales, Search, Strength
from pzd.damper.effects.cavitation import STRAIGHT, deflection_with, extension_behind, extension_slope, soft_play


def _hidden(draw: np.random.Generator, scales: Scales) -> Strength:
    half = float(np.exp(draw.uniform(np.log(0.2), np.log(1.0)))) * scales.force
    return lambda s: {"d_f": 0.15 * scales.stroke * s, "F_f": half}


_D_F_SEARCH = Search(lambda s: s.stroke, (0.03,))

EFFECT = Effect(
    name="frame_compliance",
    place="stroke",
    law="F = k e, x - y = e + d_f F/(|F| + F_f)",
    parameters=(
        Parameter("d_f", "m", 0.0, 0.0, 0.1, "what the mount gives at most to either side", _D_F_SEARCH),
        Parameter(
            "F_f",
            "N",
            1.0e3,
            1.0e-3,
            1.0e9,
            "force at which it has given half of that",
            Search(lambda s: s.force, (0.1, 1.0), logarithmic=True, within=(0.0, STRAIGHT)),
        ),
    ),
    source="Mindlin 1945, Bell System Technical Journal 24: a cushion that gives at most its own height, in rational "
    "form",
    tests=(
        ({"deflection": 0.004, "side": 1.0, "k": 2e5, "d_f": 0.002, "F_f": 200.0}, 0.0025615528128088303),
        (
            {"deflection": -0.001, "side": -1.0, "k": 2e5, "d_f": 0.001, "F_f": 200.0},
            -0.0006180339887498949,
        ),  # golden section
    ),
    nearly=lambda values, beside: soft_play(values["d_f"], values["F_f"], beside),
    order=2,  # behind a free play, and a pocket
    hidden=_hidden,
    imitates=True,
)


def law(deflection: float, side: float, k: float, d_f: float, F_f: float) -> float:
    """Extension of the oil stiffness [m] at an elastic deflection x - y [m] on a side."""
    return side * extension_behind(side * deflection, d_f, F_f / k)


def inverse(extension: float, side: float, k: float, d_f: float, F_f: float) -> float:
    """Elastic deflection [m] at an extension of the oil stiffness [m] on a side: the law inverted."""
    return side * deflection_with(side * extension, d_f, F_f / k)


def slope(deflection: float, side: float, k: float, d_f: float, F_f: float) -> float:
    """Compute the derivative of the law by the deflection [-]."""
    return extension_slope(side * deflection, d_f, F_f / k)
