"""An oil stiffness that hardens with its extension.

Law: F = k (e + c e^3).
"""

from __future__ import annotations

import math

from pzd.damper.effect import Effect, Parameter, Search, growing

EFFECT = Effect(
    name="hardening_spring",
    place="stroke",
    law="F = k (e + c e^3)",
    parameters=(
        Parameter("c", "1/m2", 0.0, 0.0, 1.0e8, "bend of the spring", Search(lambda s: 10.0 / s.stroke**2, (0.3, 3.0))),
    ),
    source="Duffing's spring, made up for a test",
    tests=(({"deflection": 0.01, "c": 1.0e4}, 0.02),),
    hidden=growing("c", lambda s: 1000.0 / s.stroke**2),
)


def law(deflection: float, c: float) -> float:
    """Extension [m] at an elastic deflection [m]."""
    return deflection + c * deflection**3


def slope(deflection: float, c: float) -> float:
    """Derivative of the law."""
    return 1.0 + 3.0 * c * deflection**2


def inverse(extension: float, c: float) -> float:
    """Elastic deflection [m] at an extension [m]."""
    root = math.sqrt(3.0 * c)
    return 2.0 / root * math.sinh(math.asinh(1.5 * extension * root) / 3.0)
