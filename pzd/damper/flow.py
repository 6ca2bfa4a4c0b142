"""The flow curve: which force drives the oil at which speed, with every flow effect in its place.

Equation: |F| = yield(w) + viscous(w) + extra(w); T0 + C w without effects, with those of the library
T0 tanh(w/w_s) + C w_r (w/w_r)^n + q w^2; where it passes b = max(F_r, T0) it goes on with slope C_r.
w = |dy/dt| >= 0; T0 and C after drive, material and direction. The curve rises with w, so w(F) exists;
below the breakaway force nothing flows.
"""

from __future__ import annotations

from pzd.compiled import compiled
from pzd.damper.compiled import kernels
from pzd.damper.compiled.kernels import T0, C, Row, bleed_factor, direction_factor

_NEWTON_STEPS = 60
_NEWTON_TOLERANCE = 1e-13
_NO_FRICTION = 1e-6
"""Breakaway force [N] that counts as none: in the rounding of a force, its two edges would be one to a path that looks
for where it sticks; a search that ends at T0 = 0 comes as near as 1e-12."""


_friction, _friction_slope, _friction_is_sharp = kernels.yield_force, kernels.yield_slope, kernels.yield_sharp
_viscous, _viscous_slope, _viscous_speed = kernels.viscous_force, kernels.viscous_slope, kernels.viscous_speed
_viscous_is_straight = kernels.viscous_straight
_extra, _extra_slope, _extra_speed, _no_extra = (
    kernels.extra_force,
    kernels.extra_slope,
    kernels.extra_speed,
    kernels.extra_none,
)
_relief = kernels.relief_of


@compiled
def damping(p: Row, side: float) -> float:
    """C [N s/m] in the direction `side` (+1 rebound, -1 compression)."""
    return p[C] * direction_factor(side, p) * bleed_factor(side, p)


@compiled
def breakaway(p: Row, side: float) -> float:
    """Force [N] below which nothing flows in the direction `side` (+1 rebound, -1 compression)."""
    force = _friction(0.0, p[T0] * direction_factor(side, p), p)
    return force if force > _NO_FRICTION else 0.0


@compiled
def relief(p: Row, side: float) -> float:
    """Force [N] beyond which the relief valve carries the rise."""
    edge, _ = _relief(p[T0] * direction_factor(side, p), side, p)
    return edge


@compiled
def relief_slope(p: Row, side: float) -> float:
    """Slope of the curve [N s/m] beyond `relief`."""
    _, slope = _relief(p[T0] * direction_factor(side, p), side, p)
    return slope


@compiled
def straight(p: Row) -> bool:
    """Whether the curve is T0 + C w, the relief valve shut."""
    return _no_extra(p) and _viscous_is_straight(p) and _friction_is_sharp(p)


@compiled
def viscous_force(w: float, p: Row, side: float) -> float:
    """Viscous force s [N] at a flow speed w >= 0 [m/s]."""
    return _viscous(w, damping(p, side), p)


@compiled
def viscous_speed(s: float, p: Row, side: float) -> float:
    """Flow speed w [m/s] at a viscous force s >= 0 [N]."""
    return _viscous_speed(s, damping(p, side), p)


@compiled
def smooth_force_of(s: float, p: Row, side: float) -> float:
    """|F| [N] at a viscous force s >= 0 [N], the relief valve shut."""
    w = viscous_speed(s, p, side)
    return _friction(w, p[T0] * direction_factor(side, p), p) + s + _extra(w, p)


@compiled
def smooth_rise(w: float, p: Row, side: float) -> float:
    """d|F|/ds >= 1 of `smooth_force_of` at a flow speed w [m/s]."""
    factor = direction_factor(side, p)
    bend = _friction_slope(w, p[T0] * factor, p) + _extra_slope(w, p)
    if bend == 0.0:
        return 1.0
    return 1.0 + bend / _viscous_slope(w, damping(p, side), p)


@compiled
def smooth_force(w: float, p: Row, side: float) -> float:
    """|F| [N] at a flow speed w >= 0 [m/s], the relief valve shut."""
    return smooth_force_of(viscous_force(w, p, side), p, side)


@compiled
def smooth_slope(w: float, p: Row, side: float) -> float:
    """Slope [N s/m] of `smooth_force`; infinite at w = 0 where the fluid thins."""
    return smooth_rise(w, p, side) * _viscous_slope(w, damping(p, side), p)


@compiled
def speed_explicit(p: Row) -> bool:
    """Whether `smooth_speed` is a closed form."""
    if not _friction_is_sharp(p):
        return False
    return _no_extra(p) or (_viscous_is_straight(p) and _extra_speed(1.0, p[C], p) >= 0.0)


@compiled
def smooth_speed(force: float, p: Row, side: float, guess: float) -> float:
    """Flow speed [m/s] at a force at or above breakaway [N], the relief valve shut; closed form where there is one."""
    if _friction_is_sharp(p):
        over = max(force - p[T0] * direction_factor(side, p), 0.0)
        slope = damping(p, side)
        if _no_extra(p):
            return _viscous_speed(over, slope, p)
        if _viscous_is_straight(p):
            speed = _extra_speed(over, slope, p)
            if speed >= 0.0:
                return speed
    if _viscous_is_straight(p):
        return _searched_speed(force, p, side, guess)
    return _searched_thinning(force, p, side, guess)


@compiled
def _searched_speed(force: float, p: Row, side: float, guess: float) -> float:
    """The same by Newton's method within a bracket."""
    if force <= 0.0:
        return 0.0
    low, high = 0.0, _viscous_speed(force, damping(p, side), p)
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
def _searched_thinning(force: float, p: Row, side: float, guess: float) -> float:
    """The same over the viscous force, by which |F| rises 1 or more everywhere.

    Over the speed the curve of a fluid that thins has an infinite slope at 0, which no tangent leaves. Where there is
    none the search over the speed is the more exact one, by a digit: a path of order five shows it (test_path.py).
    """
    if force <= 0.0:
        return 0.0
    low, high, friction = 0.0, force, p[T0] * direction_factor(side, p)
    s = viscous_force(guess, p, side)
    if not low < s < high:
        s = 0.5 * high
    for _ in range(_NEWTON_STEPS):
        w = viscous_speed(s, p, side)
        miss = _friction(w, friction, p) + s + _extra(w, p) - force
        if miss > 0.0:
            high = s
        else:
            low = s
        following = s - miss / smooth_rise(w, p, side)
        if not low < following < high:
            following = 0.5 * (low + high)
        if abs(following - s) <= _NEWTON_TOLERANCE * s:
            return viscous_speed(following, p, side)
        s = following
    return viscous_speed(s, p, side)


@compiled
def flow_force(w: float, p: Row, side: float) -> float:
    """Force [N] that drives the oil at a flow speed w >= 0 [m/s]."""
    force = smooth_force(w, p, side)
    limit = relief(p, side)
    if force <= limit:
        return force
    return limit + relief_slope(p, side) * (w - smooth_speed(limit, p, side, w))


@compiled
def flow_speed(force: float, p: Row, side: float, guess: float) -> float:
    """Flow speed w >= 0 [m/s] that a force >= 0 [N] drives: `flow_force` inverted."""
    limit = relief(p, side)
    if force > limit:
        return smooth_speed(limit, p, side, guess) + (force - limit) / relief_slope(p, side)
    if force <= breakaway(p, side):
        return 0.0
    return smooth_speed(force, p, side, guess)
