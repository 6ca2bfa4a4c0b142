"""A constant force: the gas charge at mid-stroke, a weight on the load cell, or its zero offset.

Law: F_0. Range: gas-charged dampers 50-300 N. Friction that differs between the two directions, T0 (1 + alpha sign(F)),
is the constant alpha T0 as long as the rod slips: neither gas nor zero knows the control signal, so an offset that goes
with it may be an `asymmetry` of the friction alone.
"""

from __future__ import annotations

from pzd.damper.effect import Effect, Parameter, Search, growing

EFFECT = Effect(
    name="preload_offset",
    place="parallel",
    law="F_0",
    parameters=(
        Parameter(
            "F_0", "N", 0.0, -1.0e6, 1.0e6, "constant force beside the element", Search(lambda s: s.force, (0.0,))
        ),
    ),
    source="Dixon 2007, The Shock Absorber Handbook",
    tests=(({"x": 0.01, "v": 1.0, "a": 1.0, "F_0": 55.0}, 55.0),),
    nearly=lambda values: "asymmetry" if isinstance(values["F_0"], tuple) else None,
    hidden=growing("F_0", lambda s: 0.5 * s.force, either=True),
)


def law(x: float, v: float, a: float, F_0: float) -> float:
    """Force [N] parallel to the element."""
    return F_0
