"""A pocket of vapour or gas in one chamber: after a reversal it is compressed before the oil carries the force.

Law: F = k e, x - y = e + d_c F/(F + F_c) on the side of the pocket: Boyle's law of a pocket of length d_c at the
pressure p_c, F_c = p_c A; on the other side nothing. d_c > 0: the force is missing in rebound, after a compression
faster than the gas pressure allows; d_c < 0 in compression, behind a foot valve that starves. The dependence of the
pocket on the speed of the stroke before is left out: the law has no memory. Range: 0.1-5 mm. Its nearest neighbour is
`lash`, distinguished by a slow sine: free play loses the same travel after both reversals, so the loop is odd and has
no even harmonics, wherever its zero lies; a pocket bends one flank alone. An `asymmetry` has even harmonics too, but
unequal plateaus of steady slip; `frame_compliance` is distinguished as `lash` is. A pocket that is squeezed at
once is a `lash`, wherever its zero lies, and named so.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from pzd.damper.effect import Beside, Effect, Parameter, Scales, Search, Strength


def _hidden(draw: np.random.Generator, scales: Scales) -> Strength:
    end = 0.25 * scales.stroke * float(draw.choice([-1.0, 1.0]))
    pressure = float(np.exp(draw.uniform(np.log(0.2), np.log(1.0)))) * scales.force
    return lambda s: {"d_c": end * s, "F_c": pressure}


STRAIGHT = 10.0
"""Multiple of the largest force from which on F_d is not searched: what is squeezed by a tenth is a linear spring."""
_F_C_SEARCH = Search(lambda s: s.force, (0.1, 1.0), logarithmic=True, within=(0.0, STRAIGHT))

EFFECT = Effect(
    name="cavitation",
    place="stroke",
    law="F = k e, x - y = e + d_c F/(F + F_c) on the side of the pocket",
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
            "F_c", "N", 1.0e3, 1.0e-3, 1.0e9, "its pressure times the area: half of it is left there", _F_C_SEARCH
        ),
    ),
    source="Boyle's law of a pocket in series with the oil; late filling: Duym, Stiens and Reybrouck 1997, Vehicle "
    "System Dynamics 27",
    tests=(
        ({"deflection": 0.004, "side": 1.0, "k": 2e5, "d_c": 0.002, "F_c": 200.0}, 0.0025615528128088303),
        # The golden section.
        ({"deflection": 0.001, "side": 1.0, "k": 2e5, "d_c": 0.001, "F_c": 200.0}, 0.0006180339887498949),
        ({"deflection": -0.004, "side": -1.0, "k": 2e5, "d_c": -0.002, "F_c": 200.0}, -0.0025615528128088303),
        ({"deflection": -0.004, "side": -1.0, "k": 2e5, "d_c": 0.002, "F_c": 200.0}, -0.004),
    ),
    nearly=lambda values, beside: soft_play(values["d_c"], values["F_c"], beside),
    order=1,  # a free play is taken up before anything is squeezed
    hidden=_hidden,
    imitates=True,
)


def law(deflection: float, side: float, k: float, d_c: float, F_c: float) -> float:
    """Extension of the oil stiffness [m] at an elastic deflection x - y [m] on a side."""
    if side * d_c <= 0.0:
        return deflection
    return side * extension_behind(side * deflection, abs(d_c), F_c / k)


def inverse(extension: float, side: float, k: float, d_c: float, F_c: float) -> float:
    """Elastic deflection [m] at an extension of the oil stiffness [m] on a side: the law inverted."""
    if side * d_c <= 0.0:
        return extension
    return side * deflection_with(side * extension, abs(d_c), F_c / k)


def slope(deflection: float, side: float, k: float, d_c: float, F_c: float) -> float:
    """Compute the derivative of the law by the deflection [-]."""
    if side * d_c <= 0.0:
        return 1.0
    return extension_slope(side * deflection, abs(d_c), F_c / k)


# --- A pocket of gas or a mount, compressed by a force and by no more than its own length ---
#
# Equation: e = s + d s/(s + s_d), for s >= 0: Boyle's law of a pocket of length d at a static force p A, s_d = p A/k;
# linear below 0. e is the elastic deflection, s = F/k the extension of the oil stiffness behind it, s_d = F_d/k.

SOFT_PLAY = 0.15
"""Share of the largest force, and of what squeezes the oil spring by its length, below which F_d makes a play of it.

Reason: pocket or mount then begins seven times as soft as the oil, and has given half of its way before the damper
bears a seventh of its force: whoever takes the joint apart finds a play lined with rubber. Not tuned."""


def soft_play(length: ArrayLike, half: ArrayLike, beside: Beside) -> str | None:
    """Return the name of the play that a pocket or a mount of a length d [m] is, with F_d [N]; None if it is none.

    Either may be one for each voltage: it is a play if it is one at all of them.
    """
    soft = np.asarray(half) < SOFT_PLAY * np.minimum(np.abs(length) * beside.k, beside.force)
    return "lash" if np.all(soft) else None


def deflection_with(extension: float, length: float, half: float) -> float:
    """Compute the deflection e [m] of pocket and oil stiffness together.

    Parameters
    ----------
    extension : s of the oil stiffness, to the side of the pocket [m]
    length : of the pocket, d [m]
    half : extension of the oil stiffness at which the pocket has half its length, s_d > 0 [m]
    """
    return extension * (1.0 + length / half) if extension <= 0.0 else extension * (1.0 + length / (extension + half))


def extension_behind(deflection: float, length: float, half: float) -> float:
    """Compute the extension s [m] at a deflection e of both [m]: the equation solved for s, without cancellation."""
    if deflection <= 0.0:
        return deflection / (1.0 + length / half)
    b = half + length - deflection
    root = math.sqrt(b * b + 4.0 * half * deflection)
    return 2.0 * half * deflection / (b + root) if b > 0.0 else 0.5 * (root - b)


def extension_slope(deflection: float, length: float, half: float) -> float:
    """Compute the derivative of the extension by the deflection [-]."""
    s = max(extension_behind(deflection, length, half), 0.0)
    return 1.0 / (1.0 + length * half / ((s + half) * (s + half)))
