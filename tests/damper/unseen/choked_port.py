"""A port that chokes: beyond a flow speed of 0.15 m/s its force rises with the square of what is beyond.

Law: + q (w - 0.15 m/s)^2 beyond 0.15 m/s. The letter q is that of `orifice_quadratic` on purpose.
"""

from __future__ import annotations

from pzd.damper.effect import Effect, Parameter, Search, growing

FREE = 0.15

EFFECT = Effect(
    name="choked_port",
    place="flow",
    law="+ q (w - 0.15 m/s)^2 beyond 0.15 m/s",
    parameters=(
        Parameter(
            "q",
            "N s2/m2",
            0.0,
            0.0,
            1.0e8,
            "force over a squared speed",
            Search(lambda s: s.force / s.speed**2, (0.1,)),
        ),
    ),
    source="made up for a test",
    tests=(({"w": 0.35, "q": 1000.0}, 40.0),),
    hidden=growing("q", lambda s: 4.0 * s.force / s.speed**2),
)


def extra_force(w: float, q: float) -> float:
    """Force [N] at a flow speed w >= 0 [m/s]."""
    return q * max(w - FREE, 0.0) ** 2


def extra_slope(w: float, q: float) -> float:
    """Derivative of the law by w [N s/m]."""
    return 2.0 * q * max(w - FREE, 0.0)
