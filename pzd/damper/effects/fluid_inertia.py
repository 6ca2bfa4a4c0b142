"""Inertia of oil in a long duct, or of a mass on the rod.

Law: m a. Range: inertance of a duct 1-100 kg; the sign is left free, for on a single frequency
a mass and a spring of the other sign are the same thing.
"""

from __future__ import annotations

from pzd.damper.effect import Effect, Parameter, Search, growing

_SEARCH = Search(lambda s: s.force / s.acceleration, (0.0,))

EFFECT = Effect(
    name="fluid_inertia",
    place="parallel",
    law="m a",
    parameters=(
        Parameter("m", "kg", 0.0, -1.0e5, 1.0e5, "apparent mass of the oil column", _SEARCH, natural_from=0.0),
    ),
    same_at_every_voltage=True,
    source="fluid inerter; Swift et al. 2013, Vehicle System Dynamics 51(11)",
    tests=(({"x": 0.01, "v": 1.0, "a": 4.0, "m": 5.0}, 20.0),),
    hidden=growing("m", lambda s: 0.5 * s.force / s.acceleration),
)


def law(x: float, v: float, a: float, m: float) -> float:
    """Force [N] parallel to the element at an acceleration a [m/s2]."""
    return m * a
