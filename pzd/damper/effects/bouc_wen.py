"""A smooth hysteresis parallel to the element (Bouc and Wen): its force builds up over a travel and turns into slip.

Law: dF/dx = F_h/x_h (1 - z^2) where the rod winds it up, F_h/x_h (1 + (2 sigma - 1) z^2) where it unwinds, z = F/F_h,
whatever the speed: the form of the source with n = 2, counted in its ultimate force. sigma >= 1/2, else a loop would
give off energy; 1/2 (beta = gamma) unwinds straight. Range: x_h 0.2-5 mm, F_h up to a quarter of the peak, sigma to 5.
Its nearest neighbour is `second_branch`, distinguished by small amplitudes: inside its shelf that one is a spring and
dissipates nothing, while this one always does, sigma F_h A^4/x_h^3, a sixteenth at half the amplitude. `rounded_yield`
is distinguished by one speed at two amplitudes: its loop has the same width in m/s, this one in mm.
"""

from __future__ import annotations

import math

import numpy as np

from pzd.damper.effect import Effect, Parameter, Scales, Search, Strength

EXPONENT = 2
"""n of the source: 1 is the friction of Dahl; larger ones approach `second_branch`."""
STRAIGHT = 1e-9
"""Below this `2 sigma - 1` the unloading is straight to rounding."""


def _hidden(draw: np.random.Generator, scales: Scales) -> Strength:
    travel = float(np.exp(draw.uniform(np.log(0.05), np.log(0.3)))) * scales.stroke
    unwinding = float(draw.uniform(0.5, 3.0))
    return lambda s: {"F_h": 0.5 * scales.force * s, "x_h": travel, "sigma": unwinding}


_F_H_SEARCH = Search(lambda s: s.force, (0.1,))
_X_H_SEARCH = Search(lambda s: s.stroke, (0.03, 0.15), logarithmic=True)

EFFECT = Effect(
    name="bouc_wen",
    place="branch",
    law="dF/dx = F_h/x_h (1 - z^2) winding up, F_h/x_h (1 + (2 sigma - 1) z^2) unwinding, z = F/F_h",
    parameters=(
        Parameter("F_h", "N", 0.0, 0.0, 1.0e6, "ultimate force of the hysteresis", _F_H_SEARCH, with_friction=True),
        Parameter("x_h", "m", 1.0e-3, 1.0e-6, 1.0, "travel over which it would come up without a bend", _X_H_SEARCH),
        Parameter(
            "sigma",
            "-",
            0.5,
            0.5,
            50.0,
            "unwinding: 1/2 straight, more where it is steeper the further it was wound",
            Search(lambda s: 1.0, (1.0,), logarithmic=True),
        ),
    ),
    source="Wen 1976, J. Eng. Mech. Div. ASCE 102(2), 249-263; normalised: Ikhouane and Rodellar 2005, Nonlinear "
    "Dynamics 42, 63-78",
    tests=(
        ({"deflection": 0.0, "travel": 1.0e-3, "x_h": 1.0e-3, "sigma": 0.5}, 0.7615941559557649e-3),  # tanh 1
        ({"deflection": 0.8e-3, "travel": -0.5e-3, "x_h": 1.0e-3, "sigma": 0.5}, 0.3e-3),
        ({"deflection": 1.0e-3, "travel": -0.5e-3, "x_h": 1.0e-3, "sigma": 1.0}, 0.2934079930260234e-3),
        ({"deflection": 0.5e-3, "F_h": 200.0, "x_h": 1.0e-3}, 100.0),
    ),
    hidden=_hidden,
    imitates=True,
    named_alone=True,
    never_named="whatever friction builds up over a travel has its loop: the yield of a magneto-rheological fluid, a "
    "lip, rubber; and T0 takes up most of it, so that the name would rest on the rounding of its flank alone",
)


def advance(deflection: float, travel: float, x_h: float, sigma: float) -> float:
    """Elastic deflection z x_h [m] after a travel of the rod to one side [m]."""
    return x_h * hysteresis_after(deflection / x_h, travel, 1.0 / x_h, sigma, EXPONENT)


def law(deflection: float, F_h: float, x_h: float) -> float:
    """Force [N] parallel to the element at an elastic deflection [m]."""
    return F_h * deflection / x_h


def rate(deflection: float, side: float, x_h: float, sigma: float) -> float:
    """Compute the derivative of the deflection by the travel to a side [-]: 0 in steady slip, 1 at zero force."""
    return hysteresis_rate(deflection / x_h, side, sigma, EXPONENT)


# --- The equation of Bouc and Wen over the travel of the rod, solved for exponents 1 and 2 ---


def hysteresis_after(z: float, travel: float, rho: float, sigma: float, exponent: int) -> float:
    """Compute the hysteretic variable after a travel of the rod to one side.

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
    """Compute the derivative of the hysteretic variable by rho times the travel, to a side (+1 or -1) [-]."""
    q = side * z
    return 1.0 + (2.0 * sigma - 1.0) * (-q) ** exponent if q < 0.0 else 1.0 - q**exponent
