"""Gas of an accumulator or behind a floating piston: static pressure on the rod, hardening as the rod moves in.

Law: -F_g (1 + x/L)^-1.3: pressure p_0 on the rod's area A, F_g = p_0 A, over a volume V_0 that the rod displaces,
L = V_0/A; the force depends on this product and this quotient alone. Range: F_g 50-500 N, L two to ten strokes.
Its nearest neighbour is `gas_spring`, with a `preload_offset`: to first order the same, F_0 = -F_g and
k_g = 1.3 F_g/L, but as stiff everywhere. A wide slow test distinguishes them: the mean of rebound and compression is
((L + X)/(L - X))^2.3 times as steep at the inner end of a stroke +-X as at the outer one. The same mean distinguishes
a `cubic_spring` or `end_stop`, which harden at both ends: there it is odd with respect to the middle. Where the stroke
is too short to show the hardening, `gas_spring` and `preload_offset` are named, which are what it is there; behind a
load cell that was zeroed it stands beside a `preload_offset`.
"""

from __future__ import annotations

import numpy as np

from pzd.damper.effect import Effect, Parameter, Scales, Search, Strength

POLYTROPIC = 1.3
"""Exponent: 1 for isothermal gas, 1.4 for adiabatic nitrogen, which is approached above 1 Hz."""
EXPONENTS = (1.0, 1.4)
"""Those of a real gas, from isothermal to adiabatic nitrogen."""
LEAST = 0.05
"""Smallest share of its volume to which the gas is compressed: beyond L the force is large, not infinite."""


def _hidden(draw: np.random.Generator, scales: Scales) -> Strength:
    column = float(draw.uniform(1.5, 4.0)) * scales.stroke
    return lambda s: {"F_g": 0.5 * scales.force * s, "L": column}


_SEARCH = Search(lambda s: s.stroke, (2.0, 6.0), logarithmic=True, within=(1.5, np.inf))
"""At 1.5 half strokes the tests compress the gas to a third of its volume, as much as any damper does; nearer, the pole
of the law would lie within what a car drives."""

EFFECT = Effect(
    name="accumulator",
    place="parallel",
    law="-F_g (1 + x/L)^-1.3",
    parameters=(
        Parameter("F_g", "N", 0.0, 0.0, 1.0e6, "static force of the gas on the rod", Search(lambda s: s.force, (0.1,))),
        Parameter(
            "L",
            "m",
            0.1,
            1.0e-3,
            100.0,
            "length of rod that would fill the volume of the gas",
            _SEARCH,
            position="counted from",
        ),
    ),
    same_at_every_voltage=True,
    source="polytropic gas on the area of the rod; Dixon 2007, The Shock Absorber Handbook",
    tests=(
        ({"x": 0.0, "F_g": 200.0, "L": 0.1}, -200.0),
        ({"x": -0.05, "F_g": 200.0, "L": 0.1}, -492.4577653379664),  # 200 * 2^1.3
        ({"x": 0.1, "F_g": 200.0, "L": 0.1}, -81.22523963562355),
    ),
    hidden=_hidden,
    imitates=True,
)


def law(x: float, F_g: float, L: float) -> float:
    """Force [N] parallel to the element at a displacement x [m]: it pushes the rod out."""
    return float(-F_g * max(1.0 + x / L, LEAST) ** -POLYTROPIC)


def other_gas(exponent: float) -> tuple[float, float]:
    """Compute the factors on F_g and L of a gas of another exponent with the same stiffness and the same hardening.

    It differs by a constant force, which a `preload_offset` beside it takes up: tests tell the exponent by that alone.

    Equation: n F_g/L and n (n + 1) F_g/L^2 the same: L'/L = (n' + 1)/(n + 1), F_g'/F_g = n (n' + 1)/(n' (n + 1))

    Examples
    --------
    >>> tuple(round(factor, 3) for factor in other_gas(1.0))
    (1.13, 0.87)
    """
    longer = (exponent + 1.0) / (POLYTROPIC + 1.0)
    return POLYTROPIC / exponent * longer, longer
