"""Free play before the oil spring, or a chamber that fills late.

Law: dead zone of whole width delta on the elastic deflection x - y. Range: worn bushings
0.05-1 mm; a chamber that fills late looks the same from outside.
"""

from __future__ import annotations

from pzd.damper.effect import Effect, Parameter, Search

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
        ({"deflection": 0.0004, "delta": 0.001}, 0.0),
        ({"deflection": -0.0008, "delta": 0.001}, -0.0003),
    ),
)


def law(deflection: float, delta: float) -> float:
    """Extension of the oil spring [m] at an elastic deflection x - y [m]."""
    free = 0.5 * delta
    if deflection > free:
        return deflection - free
    if deflection < -free:
        return deflection + free
    return 0.0
