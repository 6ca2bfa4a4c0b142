"""Free play of a joint that bears the whole force: a rod end, an eye or a clevis.

Law: F = k e, x - y = e + delta/2 (s(F - F_m) + s(F_m)), s(f) = f/(0.02 |F_m|) and no more than one to either side. The
joint is free where the damper as a whole bears nothing: where the force of the flow, F, undoes that of the gas, which
the joint bears too, F_m = -F_0. There the rod goes on as the gas drives it, at the speed of the flow at F_m, until the
play is passed. F_m is searched freely; that it comes out as the force of the gas is what speaks for a joint. A gas that
hardens moves it along the stroke, which the law leaves out: where it does so by a quarter of F_m little is gained.
Range: 0.1-1 mm, and oil springs softer than 100 |F_m|/delta: behind a stiffer one, where so steep a law would not be
integrated, it is `lash`. That is its nearest neighbour, play between the oil spring and the flow, passed at F = 0, the
same where there is no gas; the loop distinguishes them: a joint has its shelf at no force at all, free play before the
oil at the force of the gas.
"""

from __future__ import annotations

import math

import numpy as np

from pzd.damper.effect import Beside, Effect, EffectValues, Parameter, Search
from pzd.damper.effects.cavitation import soft_play

SPREAD = 0.02
"""Share of F_m over which the joint passes to either side: a steeper law is as good, and takes more steps."""
LIKE_LASH = 0.01
"""Share of the play in extension of the oil spring at F_m below which it is passed at no force, as free play is."""
OFF_THE_GAS = 0.5
"""Share of the gas force by which F_m may differ from it.

Reason: friction and hardening move the force at which the joint is free by less; what comes out elsewhere is something
else that looks alike. Not tuned."""


def _contradicted(values: EffectValues, beside: Beside) -> str | None:
    """Say why these values are those of no joint; None where it is free where the gas is undone."""
    free = values["F_m"]
    if np.all(np.abs(np.add(free, beside.static)) <= OFF_THE_GAS * np.abs(beside.static)):
        return None
    told = " and ".join(f"{force:.3g}" for force in np.atleast_1d(free))
    return f"stand-in: no joint is free at {told} N of the flow beside a static force of {beside.static:.3g} N"


EFFECT = Effect(
    name="mount_play",
    place="stroke",
    law="F = k e, x - y = e + delta/2 (s(F - F_m) + s(F_m)), s(f) = f/(0.02 abs(F_m)), 1 at most",
    parameters=(
        Parameter(
            "delta", "m", 0.0, 0.0, 0.05, "whole width of the free play", Search(lambda s: s.stroke, (0.003, 0.02))
        ),
        Parameter(
            "F_m",
            "N",
            0.0,
            -1.0e6,
            1.0e6,
            "force of the flow at which the joint bears nothing",
            Search(lambda s: s.force, (0.1, -0.1), within=(-0.9, 0.9)),
        ),
    ),
    same_at_every_voltage=True,
    source="dead-zone nonlinearity; Slotine and Li 1991, Applied Nonlinear Control, about the equilibrium of the joint",
    tests=(
        ({"deflection": 0.0, "side": 1.0, "k": 2e5, "delta": 0.001, "F_m": 100.0}, 0.0),
        # In the play: from 98 to 102 N by its whole width, and by 0.02 mm of the oil spring.
        ({"deflection": -0.001, "side": -1.0, "k": 2e5, "delta": 0.001, "F_m": 100.0}, -0.001),
        ({"deflection": 0.0012, "side": 1.0, "k": 2e5, "delta": 0.001, "F_m": 100.0}, 0.00050392156862745098),
        ({"deflection": 0.004, "side": 1.0, "k": 2e5, "delta": 0.001, "F_m": 100.0}, 0.003),
    ),
    nearly=lambda values, beside: soft_play(values["delta"], np.abs(values["F_m"]), beside),
    contradicted=_contradicted,
    beside_gas=True,
    order=3,  # the last joint on the way
)


def law(deflection: float, side: float, k: float, delta: float, F_m: float) -> float:
    """Extension of the oil stiffness [m] at an elastic deflection x - y [m] on a side; below zero there in the play."""
    half, free = 0.5 * delta, F_m / k
    if abs(free) <= LIKE_LASH * delta:
        return deflection - side * half
    spread = SPREAD * abs(free)
    way = deflection - free - math.copysign(half, free)
    return free + (way * spread / (half + spread) if abs(way) < half + spread else way - math.copysign(half, way))


def inverse(extension: float, side: float, k: float, delta: float, F_m: float) -> float:
    """Elastic deflection [m] at an extension of the oil stiffness [m] on a side: the law inverted."""
    half, free = 0.5 * delta, F_m / k
    if abs(free) <= LIKE_LASH * delta:
        return extension + side * half
    passed = min(max((extension - free) / (SPREAD * abs(free)), -1.0), 1.0)
    return extension + half * passed + math.copysign(half, free)


def slope(deflection: float, side: float, k: float, delta: float, F_m: float) -> float:
    """Compute the derivative of the law by the deflection [-]."""
    half, free = 0.5 * delta, F_m / k
    if abs(free) <= LIKE_LASH * delta:
        return 1.0
    spread = SPREAD * abs(free)
    return spread / (half + spread) if abs(deflection - free - math.copysign(half, free)) < half + spread else 1.0
