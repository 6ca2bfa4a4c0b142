"""The flow curve: which force drives the oil at which speed, with every flow effect in its place.

Equation: |F| = T0 tanh(w/w_s) + visc(w) + q w^2, visc = C w or C w_r (w/w_r)^n; where it passes
b = max(F_r, T0) it goes on with slope C_r. w = |dy/dt| >= 0; T0 and C after drive, material and
asymmetry. The curve rises with w, so w(F) exists; below the breakaway force nothing flows.

Parameters travel as one tuple, in the order of `ROW`.
"""

from __future__ import annotations

import math

from pzd.compiled import compiled
from pzd.damper.effects import asymmetry, lash, orifice_quadratic, relief_valve, rounded_yield, shear_thinning

Row = tuple[float, ...]

ROW = ("T0", "C", "k", "delta", "q", "n", "F_r", "C_r", "w_s", "alpha")
"""The places in a parameter row; those after k are the parameters of the stroke and flow effects."""
T0, C, K, DELTA, Q, N, F_R, C_R, W_S, ALPHA = range(len(ROW))

_friction = compiled(rounded_yield.law)
_friction_slope = compiled(rounded_yield.slope)
_viscous = compiled(shear_thinning.law)
_viscous_slope = compiled(shear_thinning.slope)
_viscous_speed = compiled(shear_thinning.speed)
_orifice = compiled(orifice_quadratic.law)
_orifice_slope = compiled(orifice_quadratic.slope)
_relief = compiled(relief_valve.law)
_side = compiled(asymmetry.law)
spring_extension = compiled(lash.law)

_NEWTON_STEPS = 60
_NEWTON_TOLERANCE = 1e-13


@compiled
def breakaway(p: Row, side: float) -> float:
    """Force [N] below which nothing flows in the direction `side` (+1 rebound, -1 compression)."""
    return _friction(0.0, p[T0] * _side(side, p[ALPHA]), p[W_S])


@compiled
def relief(p: Row, side: float) -> float:
    """Force [N] beyond which the relief valve carries the rise."""
    return _relief(p[F_R], p[T0] * _side(side, p[ALPHA]))


@compiled
def viscous_force(w: float, p: Row, side: float) -> float:
    """Viscous force s [N] at a flow speed w >= 0 [m/s]."""
    return _viscous(w, p[C] * _side(side, p[ALPHA]), p[N])


@compiled
def viscous_speed(s: float, p: Row, side: float) -> float:
    """Flow speed w [m/s] at a viscous force s >= 0 [N]."""
    return _viscous_speed(s, p[C] * _side(side, p[ALPHA]), p[N])


@compiled
def smooth_force_of(s: float, p: Row, side: float) -> float:
    """|F| [N] at a viscous force s >= 0 [N], the relief valve shut."""
    w = viscous_speed(s, p, side)
    return _friction(w, p[T0] * _side(side, p[ALPHA]), p[W_S]) + s + _orifice(w, p[Q])


@compiled
def smooth_rise(s: float, w: float, p: Row, side: float) -> float:
    """d|F|/ds >= 1 of `smooth_force_of`, at a viscous force s [N] and its flow speed w [m/s]."""
    bend = _friction_slope(w, p[T0] * _side(side, p[ALPHA]), p[W_S]) + _orifice_slope(w, p[Q])
    if bend == 0.0:
        return 1.0
    if s <= 0.0 and p[N] != 1.0:
        return 1.0
    return 1.0 + bend / _viscous_slope(w, p[C] * _side(side, p[ALPHA]), p[N])


@compiled
def smooth_force(w: float, p: Row, side: float) -> float:
    """|F| [N] at a flow speed w >= 0 [m/s], the relief valve shut."""
    return smooth_force_of(viscous_force(w, p, side), p, side)


@compiled
def smooth_slope(w: float, p: Row, side: float) -> float:
    """Slope [N s/m] of `smooth_force`; w > 0 where the fluid thins."""
    rise = smooth_rise(viscous_force(w, p, side), w, p, side)
    return rise * _viscous_slope(w, p[C] * _side(side, p[ALPHA]), p[N])


@compiled
def smooth_speed(force: float, p: Row, side: float, guess: float) -> float:
    """Flow speed [m/s] at a force at or above breakaway [N], the relief valve shut; closed form where there is one."""
    factor = _side(side, p[ALPHA])
    if p[W_S] <= 0.0:
        over = max(force - p[T0] * factor, 0.0)
        if p[Q] == 0.0:
            return _viscous_speed(over, p[C] * factor, p[N])
        if p[N] == 1.0:
            viscous = p[C] * factor
            return 2.0 * over / (viscous + math.sqrt(viscous * viscous + 4.0 * p[Q] * over))
    if force <= 0.0:
        return 0.0
    low, high = 0.0, _viscous_speed(force, p[C] * factor, p[N])
    w = guess if low < guess < high else 0.5 * high
    for _ in range(_NEWTON_STEPS):
        miss = smooth_force(w, p, side) - force
        if miss > 0.0:
            high = w
        else:
            low = w
        following = w - miss / smooth_slope(w, p, side)
        if not low < following < high:
            following = 0.5 * (low + high)
        if abs(following - w) <= _NEWTON_TOLERANCE * w:
            return following
        w = following
    return w


@compiled
def flow_force(w: float, p: Row, side: float) -> float:
    """Force [N] that drives the oil at a flow speed w >= 0 [m/s]."""
    force = smooth_force(w, p, side)
    limit = relief(p, side)
    if force <= limit:
        return force
    return limit + p[C_R] * (w - smooth_speed(limit, p, side, w))


@compiled
def flow_speed(force: float, p: Row, side: float, guess: float) -> float:
    """Flow speed w >= 0 [m/s] that a force >= 0 [N] drives: `flow_force` inverted."""
    limit = relief(p, side)
    if force > limit:
        return smooth_speed(limit, p, side, guess) + (force - limit) / p[C_R]
    if force <= breakaway(p, side):
        return 0.0
    return smooth_speed(force, p, side, guess)
