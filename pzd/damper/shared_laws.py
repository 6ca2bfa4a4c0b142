"""The hysteretic variable of Bouc and Wen over the travel of the rod: its equation solved for exponents 1 and 2.

Plain functions: `pzd.compiled` makes machine code of them with the laws that call them.
"""

from __future__ import annotations

import math

# ----------------------------------------------------------------------------------------------------


STRAIGHT = 1e-9
"""Below this `2 sigma - 1` the unloading is straight to rounding."""


def hysteresis_after(z: float, travel: float, rho: float, sigma: float, exponent: int) -> float:
    """The hysteretic variable after a travel of the rod to one side.

    Equation: dq/ds = 1 + (2 sigma - 1) |q|^n for q < 0, 1 - q^n for q >= 0, q = z sign(dx), s = rho |dx|
                                        Source: Wen 1976, normalised as by Ikhouane and Rodellar 2005; n = 1, 2 solved

    Parameters
    ----------
    z : before, in its ultimate value [-]
    travel : of the rod, to one side [m]; may be infinite
    rho : slope of z over the travel at z = 0 [1/m]
    sigma : 1/2 where the unloading is straight, more where it is steeper [-]
    exponent : n, 1 or 2

    Returns
    -------
    z afterwards [-]
    """
    side = 1.0 if travel > 0.0 else -1.0
    s, q = rho * abs(travel), side * z
    if q < 0.0:
        ratio, p = 2.0 * sigma - 1.0, -q
        root = math.sqrt(max(ratio, 0.0))
        if ratio < STRAIGHT:
            way, p = p, p - s
        elif exponent == 1:
            way = math.log1p(ratio * p) / ratio
            p = ((1.0 + ratio * p) * math.exp(-ratio * s) - 1.0) / ratio
        else:
            way = math.atan(root * p) / root
            p = math.tan(root * max(way - s, 0.0)) / root
        if s < way:
            return -side * p
        s, q = s - way, 0.0
    if exponent == 1:
        loaded = 1.0 - (1.0 - q) * math.exp(-s)
    else:
        t = math.tanh(s)
        loaded = (q + t) / (1.0 + q * t)
    return side * loaded


def hysteresis_rate(z: float, side: float, sigma: float, exponent: int) -> float:
    """Derivative of the hysteretic variable by rho times the travel, to a side (+1 or -1) [-]: the same equation."""
    q = side * z
    return 1.0 + (2.0 * sigma - 1.0) * (-q) ** exponent if q < 0.0 else 1.0 - q**exponent


# ----------------------------------------------------------------------------------------------------
# What is squeezed by a force, and by no more than its own length: a pocket of gas, a rubber mount.
#
# Equation: e = s + d s/(s + s_d), for s >= 0: Boyle's law of a pocket of length d at a static force p A, s_d = p A/k;
# below 0 it goes on straight. e is the elastic deflection, s = F/k the extension of the oil spring behind it.
#
# Plain functions: `pzd.compiled` makes machine code of them with the laws that call them.


def deflection_with(extension: float, length: float, half: float) -> float:
    """Deflection e [m] of both at an extension of the oil spring [m].

    Parameters
    ----------
    extension : s of the oil spring, to the side of the pocket [m]
    length : of the pocket, d [m]
    half : extension of the oil spring at which the pocket has half its length, s_d > 0 [m]
    """
    return extension * (1.0 + length / half) if extension <= 0.0 else extension * (1.0 + length / (extension + half))


def extension_behind(deflection: float, length: float, half: float) -> float:
    """Extension of the oil spring s [m] at a deflection of both [m]: the same solved for s, without cancellation."""
    if deflection <= 0.0:
        return deflection / (1.0 + length / half)
    b = half + length - deflection
    root = math.sqrt(b * b + 4.0 * half * deflection)
    return 2.0 * half * deflection / (b + root) if b > 0.0 else 0.5 * (root - b)


def extension_slope(deflection: float, length: float, half: float) -> float:
    """Derivative of the extension by the deflection [-]."""
    s = max(extension_behind(deflection, length, half), 0.0)
    return 1.0 / (1.0 + length * half / ((s + half) * (s + half)))
