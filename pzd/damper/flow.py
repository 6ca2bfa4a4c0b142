"""The flow curve, force over flow speed, with every flow effect in its place.

Equation: |F| = yield(w) + viscous(w) + extra(w); T0 + C w without effects, with those of the library
T0 tanh(w/w_s) + C w_r (w/w_r)^n + q w^2; where it passes b = max(F_r, T0) it goes on with slope C_r.
w = |dy/dt| >= 0; T0 and C after drive, material and direction. The curve rises with w, so w(F) exists;
below the breakaway force nothing flows.
"""

from __future__ import annotations

from pzd.compiled import compiled
from pzd.damper.compiled import kernels
from pzd.damper.compiled.kernels import T0, C, Row

_NEWTON_STEPS = 60  # bisection alone needs 53 for all digits of a double
_NEWTON_TOLERANCE = 1e-13  # of the unknown: a few times its rounding
_ROUNDING = 1e-15  # of the force: what a search may leave, which no step makes smaller
_NO_FRICTION = 1e-6
"""Breakaway force [N] that counts as none: within the rounding of a force its two edges would be one, and a search that
ends at T0 = 0 comes as near as 1e-12."""


@compiled
def damping(p: Row, side: float) -> float:
    """Return C [N s/m] in the direction `side` (+1 rebound, -1 compression)."""
    return p[C] * kernels.direction_factor(side, p) * kernels.bleed_factor(side, p)


@compiled
def breakaway(p: Row, side: float) -> float:
    """Compute the force [N] below which nothing flows in the direction `side` (+1 rebound, -1 compression)."""
    force = kernels.yield_force(0.0, p[T0] * kernels.direction_factor(side, p), p)
    return force if force > _NO_FRICTION else 0.0


@compiled
def relief(p: Row, side: float) -> float:
    """Return the force [N] beyond which the relief valve is open."""
    return kernels.relief_of(p[T0] * kernels.direction_factor(side, p), side, p)[0]


@compiled
def relief_slope(p: Row, side: float) -> float:
    """Return the slope of the curve [N s/m] beyond `relief`."""
    return kernels.relief_of(p[T0] * kernels.direction_factor(side, p), side, p)[1]


@compiled
def straight(p: Row) -> bool:
    """Return whether the curve is T0 + C w, the relief valve shut."""
    return kernels.extra_none(p) and kernels.viscous_straight(p) and kernels.yield_sharp(p)


@compiled
def viscous_force(w: float, p: Row, side: float) -> float:
    """Compute the viscous force s [N] at a flow speed w >= 0 [m/s]."""
    return kernels.viscous_force(w, damping(p, side), p)


@compiled
def viscous_speed(s: float, p: Row, side: float) -> float:
    """Compute the flow speed w [m/s] at a viscous force s >= 0 [N]."""
    return kernels.viscous_speed(s, damping(p, side), p)


@compiled
def smooth_force_of(s: float, p: Row, side: float) -> float:
    """Compute |F| [N] at a viscous force s >= 0 [N], the relief valve shut."""
    w = viscous_speed(s, p, side)
    return kernels.yield_force(w, p[T0] * kernels.direction_factor(side, p), p) + s + kernels.extra_force(w, side, p)


@compiled
def smooth_rise(w: float, p: Row, side: float) -> float:
    """Compute d|F|/ds >= 1 of `smooth_force_of` at a flow speed w [m/s]."""
    factor = kernels.direction_factor(side, p)
    bend = kernels.yield_slope(w, p[T0] * factor, p) + kernels.extra_slope(w, side, p)
    if bend == 0.0:
        return 1.0
    return 1.0 + bend / kernels.viscous_slope(w, damping(p, side), p)


@compiled
def smooth_force(w: float, p: Row, side: float) -> float:
    """Compute |F| [N] at a flow speed w >= 0 [m/s], the relief valve shut."""
    friction = kernels.yield_force(w, p[T0] * kernels.direction_factor(side, p), p)
    return friction + viscous_force(w, p, side) + kernels.extra_force(w, side, p)


@compiled
def smooth_slope(w: float, p: Row, side: float) -> float:
    """Compute the slope [N s/m] of `smooth_force`; infinite at w = 0 where the fluid thins."""
    friction = kernels.yield_slope(w, p[T0] * kernels.direction_factor(side, p), p)
    return friction + kernels.viscous_slope(w, damping(p, side), p) + kernels.extra_slope(w, side, p)


@compiled
def speed_explicit(p: Row) -> bool:
    """Return whether `smooth_speed` is a closed form."""
    if not kernels.yield_sharp(p):
        return False
    return kernels.extra_none(p) or (kernels.viscous_straight(p) and kernels.extra_speed(1.0, p[C], 1.0, p) >= 0.0)


@compiled
def smooth_speed(force: float, p: Row, side: float, guess: float) -> float:
    """Compute the flow speed [m/s] at a force [N] >= breakaway, the relief valve shut; closed form where possible."""
    if kernels.yield_sharp(p):
        over = max(force - p[T0] * kernels.direction_factor(side, p), 0.0)
        slope = damping(p, side)
        if kernels.extra_none(p):
            return kernels.viscous_speed(over, slope, p)
        if kernels.viscous_straight(p):
            speed = kernels.extra_speed(over, slope, side, p)
            if speed >= 0.0:
                return speed
    if kernels.viscous_straight(p):
        return _searched_speed(force, p, side, guess)
    return _searched_thinning(force, p, side, guess)


@compiled
def _searched_speed(force: float, p: Row, side: float, guess: float) -> float:
    """Solve `smooth_force` for the flow speed [m/s] by Newton's method within a bracket."""
    if force <= 0.0:
        return 0.0
    low, high = 0.0, kernels.viscous_speed(force, damping(p, side), p)
    w = guess if low < guess < high else 0.5 * high
    for _ in range(_NEWTON_STEPS):
        miss = smooth_force(w, p, side) - force
        if miss > 0.0:
            high = w
        else:
            low = w
        following = w - miss / smooth_slope(w, p, side)
        if abs(following - w) <= _NEWTON_TOLERANCE * w or abs(miss) <= _ROUNDING * force:
            return min(max(following, low), high)  # of the bracket it may be the very end
        if not low < following < high:
            following = 0.5 * (low + high)
        w = following
    return w


@compiled
def _searched_thinning(force: float, p: Row, side: float, guess: float) -> float:
    """Solve `smooth_force` over the viscous force, by which |F| rises by 1 or more everywhere; return the flow speed.

    Over the speed, the curve of a shear-thinning fluid has an infinite slope at 0, from which Newton's method does not
    start. For other fluids the search over the speed is more exact, by a digit, which a path of order five shows.
    """
    if force <= 0.0:
        return 0.0
    low, high, friction = 0.0, force, p[T0] * kernels.direction_factor(side, p)
    if guess > 0.0 and smooth_rise(guess, p, side) < 2.0:  # the rest changes less by the speed than s does
        s = force - kernels.yield_force(guess, friction, p) - kernels.extra_force(guess, side, p)
    else:
        s = viscous_force(guess, p, side)
    if not low < s < high:
        s = 0.5 * high
    for _ in range(_NEWTON_STEPS):
        w = viscous_speed(s, p, side)
        miss = kernels.yield_force(w, friction, p) + s + kernels.extra_force(w, side, p) - force
        if miss > 0.0:
            high = s
        else:
            low = s
        following = s - miss / smooth_rise(w, p, side)
        if abs(miss) <= _ROUNDING * force:
            return w
        if abs(following - s) <= _NEWTON_TOLERANCE * s:
            return viscous_speed(min(max(following, low), high), p, side)
        if not low < following < high:
            following = 0.5 * (low + high)
        s = following
    return viscous_speed(s, p, side)


@compiled
def flow_force(w: float, p: Row, side: float) -> float:
    """Compute the force [N] at a flow speed w >= 0 [m/s], beyond the relief valve too."""
    force = smooth_force(w, p, side)
    limit = relief(p, side)
    if force <= limit:
        return force
    return limit + relief_slope(p, side) * (w - smooth_speed(limit, p, side, w))


@compiled
def flow_speed(force: float, p: Row, side: float, guess: float) -> float:
    """Compute the flow speed w >= 0 [m/s] at a force >= 0 [N]: `flow_force` inverted."""
    limit = relief(p, side)
    if force > limit:
        return smooth_speed(limit, p, side, guess) + (force - limit) / relief_slope(p, side)
    if force <= breakaway(p, side):
        return 0.0
    return smooth_speed(force, p, side, guess)
