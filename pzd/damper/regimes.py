"""The regimes of the damper: where nothing flows, where it flows smoothly, where the relief valve is open.

State is the elastic deflection e = x - y (paper, eq. 1); a stiffness that moves with the voltage
then moves the force and nothing else. F = k s(e), s the extension of the oil spring behind the stroke effects.
"""

from __future__ import annotations

import math

from pzd.compiled import compiled
from pzd.damper.flow import breakaway, relief, relief_slope, smooth_speed
from pzd.damper.kernels import K, Row, stroke_inverse, stroke_law, stroke_straight

STICK, SMOOTH, RELIEF = 0, 1, 2
"""The regimes: nothing flows; it flows along the smooth curve; the relief valve is open."""


_GAUSS = (
    (0.18343464249564980, 0.36268378337836198),
    (0.52553240991632899, 0.31370664587788729),
    (0.79666647741362674, 0.22238103445337447),
    (0.96028985649753623, 0.10122853629037626),
)
"""Points and weights of Gauss and Legendre's rule of eight points on (-1, 1), those above 0."""


@compiled
def spring_extension(e: float, p: Row) -> float:
    """Extension of the oil spring [m] at an elastic deflection [m]; 0 inside a free play."""
    side = 1.0 if e >= 0.0 else -1.0
    extension = stroke_law(e, side, p)
    return extension if side * extension > 0.0 else 0.0


@compiled
def spring_force(e: float, p: Row) -> float:
    """Force of the oil spring [N] at an elastic deflection [m]; eq. (1) behind the stroke effects."""
    return p[K] * spring_extension(e, p)


@compiled
def spring_energy(e: float, p: Row, k: float) -> float:
    """Energy [J] of an oil spring of stiffness k [N/m] at an elastic deflection [m], behind the stroke effects.

    Equation: k integral s de; k s^2 / 2 where s rises like e
    """
    extension = spring_extension(e, p)
    if extension == 0.0 or stroke_straight(p):
        return 0.5 * k * extension * extension
    side = 1.0 if e >= 0.0 else -1.0
    start = stroke_inverse(0.0, side, p)
    middle, half, area = 0.5 * (e + start), 0.5 * (e - start), 0.0
    for point, weight in _GAUSS:
        area += weight * (stroke_law(middle + half * point, side, p) + stroke_law(middle - half * point, side, p))
    return k * half * area


@compiled
def deflection_at(force: float, p: Row) -> float:
    """Elastic deflection [m] at which the oil spring carries `force` [N], the nearest to zero."""
    return 0.0 if force == 0.0 else stroke_inverse(force / p[K], math.copysign(1.0, force), p)


@compiled
def deflection_on(force: float, p: Row, side: float) -> float:
    """Elastic deflection [m] at which the oil spring carries a force [N] on one side, counted from there."""
    return stroke_inverse(side * force / p[K], side, p)


@compiled
def regime_of(force: float, p: Row) -> tuple[int, float]:
    """The regime and the side (sign of F) of a force [N]."""
    side = 1.0 if force >= 0.0 else -1.0
    if abs(force) <= breakaway(p, side):
        return STICK, side
    return (RELIEF if abs(force) > relief(p, side) else SMOOTH), side


@compiled
def over_yield(e: float, p: Row, side: float) -> float:
    """How far the force lies above breakaway on one side [N]; inside a free play it counts on below zero."""
    return p[K] * (side * stroke_law(e, side, p)) - breakaway(p, side)


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
    onto = deflection_on(edge, p, side)
    if way > 0:
        return onto, (SMOOTH if regime == STICK and high > low else RELIEF), side
    if regime == RELIEF and high > low:
        return onto, SMOOTH, side
    if low <= 0.0 and side * deflection_on(0.0, p, side) <= 0.0:  # no free play to stick in
        return 0.0, (SMOOTH if relief(p, -side) > 0.0 else RELIEF), -side
    return onto, STICK, side


@compiled
def speed_at(force: float, p: Row, regime: int, side: float, guess: float) -> float:
    """Flow speed [m/s] of a regime's own law at |F| = force."""
    if regime == STICK:
        return 0.0
    if regime == RELIEF:
        edge = relief(p, side)
        return smooth_speed(edge, p, side, guess) + (force - edge) / relief_slope(p, side)
    return smooth_speed(force, p, side, guess)
