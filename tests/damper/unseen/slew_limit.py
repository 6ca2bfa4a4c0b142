"""A supply that charges the stack with a limited current: the voltage moves no faster than R.

Law: |dUe/dt| <= R.
"""

from __future__ import annotations

from math import inf

from pzd.damper.effect import Effect, Parameter, Search

EFFECT = Effect(
    name="slew_limit",
    place="drive",
    law="|dUe/dt| <= R",
    parameters=(
        Parameter(
            "R",
            "V/s",
            inf,
            1.0,
            1.0e9,
            "largest rate of the voltage",
            Search(lambda s: s.voltage, (3.0, 10.0, 40.0), logarithmic=True),
        ),
    ),
    source="made up for a test",
    tests=(({"effective": 0.0, "now": 150.0, "step": 0.01, "R": 1000.0}, 10.0),),
    needs="voltage",
    hidden=lambda draw, scales: lambda s: {"R": 3.0 * scales.voltage / s},
    order=-1,
)


def law(effective: float, now: float, step: float, R: float) -> float:
    """Effective voltage [V] after a step [s]."""
    return effective + max(-R * step, min(R * step, now - effective))


def rate(effective: float, now: float, rate: float, R: float) -> float:
    """Rate of the effective voltage [V/s]."""
    if abs(now - effective) > 1.0e-9:
        return R if now > effective else -R
    return max(-R, min(R, rate))
