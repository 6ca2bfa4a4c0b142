"""Difference of rebound and compression: other ports or shims for the two directions.

Law: T0 and C times (1 + alpha sign(F)), and the force of a branch beside them likewise by its own sign. Range:
passenger cars damp rebound two to three times as hard, alpha 0.3-0.5; a symmetric prototype shows a few percent. Where
the friction is alike both ways, as that of a seal, it is a `viscous_asymmetry`.
"""

from __future__ import annotations

from pzd.damper.effect import Effect, Parameter, Search, growing

EFFECT = Effect(
    name="asymmetry",
    place="flow",
    law="T0, C and the force of a branch times (1 + alpha sign(F))",
    parameters=(
        Parameter("alpha", "-", 0.0, -0.95, 0.95, "share by which rebound is harder", Search(lambda _: 1.0, (0.0,))),
    ),
    source="Dixon 2007, The Shock Absorber Handbook",
    tests=(({"side": 1.0, "alpha": 0.1}, 1.1), ({"side": -1.0, "alpha": 0.1}, 0.9)),
    hidden=growing("alpha", lambda _: 0.5, either=True),
)


def direction_factor(side: float, alpha: float) -> float:
    """Factor on T0, C and the force of a branch, each by the sign of its force."""
    return 1.0 + alpha * side
