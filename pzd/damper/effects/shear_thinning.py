"""A shear-thinning fluid: the viscous force bends below its straight line.

Law: C w becomes C w_r (w/w_r)^n with w_r = 0.3 m/s and n < 1. Range: n 0.6-1 for
multigrade oils and magneto-rheological fluids past yield.
"""

from __future__ import annotations

import math

from pzd.damper.effect import Effect, Parameter, Search

REFERENCE_SPEED = 0.3
"""w_r, the flow speed at which thinning leaves the viscous force as it is [m/s]."""

EFFECT = Effect(
    name="shear_thinning",
    place="flow",
    law="C w becomes C w_r (w/w_r)^n, w_r = 0.3 m/s",
    parameters=(
        Parameter("n", "-", 1.0, 0.1, 1.0, "flow index; 1 is a Newtonian fluid", Search(lambda _: 1.0, (0.85,))),
    ),
    source="Ostwald-de Waele power law; Bird, Stewart and Lightfoot 2002, Transport Phenomena",
    tests=(({"w": 0.3, "C": 2000.0, "n": 0.7}, 600.0), ({"w": 0.03, "C": 2000.0, "n": 0.5}, 189.73665961010275)),
    hidden=lambda draw, scales: lambda s: {"n": 1.0 - 0.6 * s},
)


def viscous_force(w: float, C: float, n: float) -> float:
    """Viscous force [N] at a flow speed w >= 0 [m/s]."""
    if n == 1.0:
        return C * w
    return float(C * REFERENCE_SPEED * (w / REFERENCE_SPEED) ** n)


def viscous_slope(w: float, C: float, n: float) -> float:
    """Compute the derivative of the law by w [N s/m]; unbounded towards w = 0 for n < 1."""
    if n == 1.0:
        return C
    if w <= 0.0:
        return math.inf
    return float(C * n * (w / REFERENCE_SPEED) ** (n - 1.0))


def viscous_speed(viscous: float, C: float, n: float) -> float:
    """Flow speed w [m/s] that takes a viscous force >= 0 [N]: the law inverted."""
    if n == 1.0:
        return viscous / C
    return float(REFERENCE_SPEED * (viscous / (C * REFERENCE_SPEED)) ** (1.0 / n))
