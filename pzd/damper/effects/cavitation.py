"""A pocket of vapour or gas in one chamber: after a reversal it is squeezed before the oil takes up the force.

Law: F = k e, x - y = e + d_c e/(e + s_c) on the side of the pocket: Boyle's law of a pocket of length d_c at the
pressure p_c, s_c = p_c A/k; on the other side nothing. d_c > 0: the force is lost in rebound, behind a compression that
outran the gas pressure; d_c < 0 in compression, behind a foot valve that starves. What the speed of the stroke before
adds to the pocket is left out: the law has no memory. Range: 0.1-5 mm. Its nearest neighbour is `lash`, told from it by
a slow sine: free play loses the same travel after both reversals, so the loop is odd and has no even harmonics,
wherever its zero lies; a pocket bends one flank alone. From an `asymmetry`, which has them too, it is told by the
plateaus of steady slip, which a pocket leaves alike; from `frame_compliance` as from `lash`.
"""

from __future__ import annotations

import numpy as np

from pzd.damper.effect import Effect, Parameter, Scales, Search, Strength
from pzd.damper.shared_laws import deflection_with, extension_behind, extension_slope


def _hidden(draw: np.random.Generator, scales: Scales) -> Strength:
    end = 0.25 * scales.stroke * float(draw.choice([-1.0, 1.0]))
    pressed = float(np.exp(draw.uniform(np.log(0.01), np.log(0.05)))) * scales.stroke
    return lambda s: {"d_c": end * s, "s_c": pressed}


EFFECT = Effect(
    name="cavitation",
    place="stroke",
    law="F = k e, x - y = e + d_c e/(e + s_c) on the side of the pocket",
    parameters=(
        Parameter(
            "d_c",
            "m",
            0.0,
            -0.1,
            0.1,
            "length of the pocket; above 0 it is squeezed in rebound, below in compression",
            Search(lambda s: s.stroke, (0.05, -0.05)),
        ),
        Parameter(
            "s_c",
            "m",
            1.0e-3,
            1.0e-7,
            1.0,
            "extension of the oil spring at which half of it is left",
            Search(lambda s: s.stroke, (0.01, 0.1), logarithmic=True),
        ),
    ),
    source="Boyle's law of a pocket in series with the oil; late filling: Duym, Stiens and Reybrouck 1997, Vehicle "
    "System Dynamics 27",
    tests=(
        ({"deflection": 0.004, "side": 1.0, "d_c": 0.002, "s_c": 0.001}, 0.0025615528128088303),
        ({"deflection": 0.001, "side": 1.0, "d_c": 0.001, "s_c": 0.001}, 0.0006180339887498949),  # golden section
        ({"deflection": -0.004, "side": -1.0, "d_c": -0.002, "s_c": 0.001}, -0.0025615528128088303),
        ({"deflection": -0.004, "side": -1.0, "d_c": 0.002, "s_c": 0.001}, -0.004),
    ),
    order=1,  # a free play is taken up before anything is squeezed
    hidden=_hidden,
    never_named="how often its name would be right has not been through a whole blind benchmark, in which a chamber "
    "that fills late counts as a lash",
)


def law(deflection: float, side: float, d_c: float, s_c: float) -> float:
    """Extension of the oil spring [m] at an elastic deflection x - y [m] on a side."""
    if side * d_c <= 0.0:
        return deflection
    return side * extension_behind(side * deflection, abs(d_c), s_c)


def inverse(extension: float, side: float, d_c: float, s_c: float) -> float:
    """Elastic deflection [m] at an extension of the oil spring [m] on a side: the law inverted."""
    if side * d_c <= 0.0:
        return extension
    return side * deflection_with(side * extension, abs(d_c), s_c)


def slope(deflection: float, side: float, d_c: float, s_c: float) -> float:
    """Derivative of the law by the deflection [-]."""
    if side * d_c <= 0.0:
        return 1.0
    return extension_slope(side * deflection, abs(d_c), s_c)
