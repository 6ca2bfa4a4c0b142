"""The regimes of the damper: where nothing flows, where it flows smoothly, where the relief valve is open.

State is the elastic deflection e = x - y (paper, eq. 1); a stiffness that moves with the voltage
then moves the force and nothing else. F = k dead_zone(e).
"""

from __future__ import annotations

import math

from pzd.compiled import compiled
from pzd.damper.flow import C_R, DELTA, K, Row, breakaway, relief, smooth_speed, spring_extension

STICK, SMOOTH, RELIEF = 0, 1, 2
"""The regimes: nothing flows; it flows along the smooth curve; the relief valve is open."""


@compiled
def spring_force(e: float, p: Row) -> float:
    """Force of the oil spring [N] at an elastic deflection [m]; eq. (1) behind the lash."""
    return p[K] * spring_extension(e, p[DELTA])


@compiled
def deflection_at(force: float, p: Row) -> float:
    """Elastic deflection [m] at which the oil spring carries `force` [N], the nearest to zero."""
    return force / p[K] + (0.0 if force == 0.0 else math.copysign(0.5 * p[DELTA], force))


@compiled
def regime_of(force: float, p: Row) -> tuple[int, float]:
    """The regime and the side (sign of F) of a force [N]."""
    side = 1.0 if force >= 0.0 else -1.0
    if abs(force) <= breakaway(p, side):
        return STICK, side
    return (RELIEF if abs(force) > relief(p, side) else SMOOTH), side


@compiled
def over_yield(e: float, p: Row, side: float) -> float:
    """How far the force lies above breakaway on one side [N]; inside the lash it counts on below zero."""
    return p[K] * (side * e - 0.5 * p[DELTA]) - breakaway(p, side)


@compiled
def beyond(e: float, p: Row, regime: int, side: float) -> tuple[float, int]:
    """How far the state lies outside its regime, as a force [N], and past which edge: -1 low, 1 high.

    Negative inside; `side` is not looked at in STICK.
    """
    if regime == STICK:
        return over_yield(e, p, math.copysign(1.0, e)), 1
    below = -over_yield(e, p, side)
    above = breakaway(p, side) - below - relief(p, side)
    if regime == RELIEF:
        return -above, -1
    return (below, -1) if below > above else (above, 1)


@compiled
def onto_edge(e: float, p: Row, regime: int, side: float, way: int) -> tuple[float, int, float]:
    """The deflection on the edge that is crossed, and the regime and side beyond it."""
    if regime == STICK:
        side = math.copysign(1.0, e)
    low, high = breakaway(p, side), relief(p, side)
    edge = high if (regime == RELIEF or (regime == SMOOTH and way > 0)) else low
    onto = side * (0.5 * p[DELTA] + edge / p[K])
    if way > 0:
        return onto, (SMOOTH if regime == STICK and high > low else RELIEF), side
    if regime == RELIEF and high > low:
        return onto, SMOOTH, side
    if low <= 0.0 and p[DELTA] <= 0.0:
        return 0.0, (SMOOTH if relief(p, -side) > 0.0 else RELIEF), -side
    return onto, STICK, side


@compiled
def speed_at(force: float, p: Row, regime: int, side: float, guess: float) -> float:
    """Flow speed [m/s] of a regime's own law at |F| = force."""
    if regime == STICK:
        return 0.0
    if regime == RELIEF:
        edge = relief(p, side)
        return smooth_speed(edge, p, side, guess) + (force - edge) / p[C_R]
    return smooth_speed(force, p, side, guess)
