"""Free play before the oil stiffness, or a chamber that fills late.

Law: dead zone of whole width delta on the elastic deflection x - y. Range: worn bushings
0.05-1 mm; a chamber that fills late looks the same from outside.
"""

from __future__ import annotations

from pzd.damper.effect import Effect, Parameter, Search, growing

EFFECT = Effect(
    name="lash",
    place="stroke",
    law="F = k e, e = dead zone of x - y, whole width delta",
    parameters=(
        Parameter(
            "delta", "m", 0.0, 0.0, 0.05, "whole width of the free play", Search(lambda s: s.stroke, (0.003, 0.02))
        ),
    ),
    source="dead-zone nonlinearity; Slotine and Li 1991, Applied Nonlinear Control",
    tests=(
        ({"deflection": 0.0004, "side": 1.0, "delta": 0.001}, -0.0001),
        ({"deflection": -0.0008, "side": -1.0, "delta": 0.001}, -0.0003),
    ),
    hidden=growing("delta", lambda s: 0.2 * s.stroke),
)


def law(deflection: float, side: float, delta: float) -> float:
    """Extension of the oil stiffness [m] at an elastic deflection x - y [m] on a side; below zero there in the play."""
    return deflection - side * 0.5 * delta


def inverse(extension: float, side: float, delta: float) -> float:
    """Elastic deflection [m] at an extension of the oil stiffness [m] on a side: the law inverted."""
    return extension + side * 0.5 * delta
