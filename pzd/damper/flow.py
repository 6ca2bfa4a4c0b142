"""The flow curve, force over flow speed, with every flow effect in its place.

Equation: |F| = yield(w) + viscous(w) + extra(w); T0 + C w without effects, with those of the library
T0 tanh(w/w_s) + C w_r (w/w_r)^n + q w^2; where it passes b = max(F_r, T0) it goes on with slope C_r.
w = |dy/dt| >= 0; T0 and C after drive, material and direction. The curve rises with w, so w(F) exists;
below the breakaway force nothing flows.

A valve that opens little by little makes that corner round. Sharp, the flow at |F| is shut(f) + (|F| - f)/C_r, shut(f)
through the shut valve and f = min(|F|, b). Round it is the same with f = |F| - s ln(1 + exp((|F| - b)/s)), which begins
at the breakaway force: as if many valves beside each other opened at forces that are spread about b like the logistic
distribution of scale s.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from pzd.compiled import compiled
from pzd.damper.compiled import kernels
from pzd.damper.compiled.kernels import T0, C, Row

_NEWTON_STEPS = 60  # bisection alone needs 53 for all digits of a double
_NEWTON_TOLERANCE = 1e-13  # of the unknown: a few times its rounding
_ROUNDING = 1e-15  # of the force: what a search may leave, which no step makes smaller
_LARGEST_EXPONENT = 700.0  # e to that is near the largest double
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


class Corner(NamedTuple):
    """Where a valve opens, and over which forces."""

    force: float
    """b [N], the middle of the forces at which it opens."""
    slope: float
    """C_r of the open valve [N s/m]."""
    spread: float
    """s [N], 0 for a valve that opens at once or never."""


@compiled
def _corner(p: Row, side: float) -> Corner:
    """Return the corner of the curve."""
    edge, slope, spread = kernels.relief_of(p[T0] * kernels.direction_factor(side, p), side, p)
    return Corner(edge, slope, spread)


@compiled
def relief(p: Row, side: float) -> float:
    """Return the force [N] at which the relief valve opens at once; infinite where it opens little by little."""
    corner = _corner(p, side)
    return math.inf if corner.spread > 0.0 else corner.force


@compiled
def relief_slope(p: Row, side: float) -> float:
    """Return the slope of the curve [N s/m] beyond `relief`."""
    return _corner(p, side).slope


@compiled
def rounded(p: Row) -> bool:
    """Return whether the relief valve opens little by little, to either side."""
    return _corner(p, 1.0).spread > 0.0 or _corner(p, -1.0).spread > 0.0


@compiled
def straight(p: Row) -> bool:
    """Return whether the curve is T0 + C w, the relief valve shut."""
    return kernels.extra_none(p) and kernels.viscous_straight(p) and kernels.yield_sharp(p) and not rounded(p)


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


# --- The relief valve shut, or opening little by little ---


@compiled
def _ramp(x: float) -> float:
    """Compute ln(1 + e^x), 0 far below 0 and x far above."""
    return max(x, 0.0) + math.log1p(math.exp(-abs(x)))


@compiled
def _before(force: float, corner: Corner, p: Row, side: float) -> float:
    """Compute the part f [N] of a force |F| [N] that rises like it before the corner, and no more beyond."""
    start = _ramp((breakaway(p, side) - corner.force) / corner.spread)
    return force - corner.spread * (_ramp((force - corner.force) / corner.spread) - start)


@compiled
def _spread_speed(force: float, corner: Corner, p: Row, side: float, guess: float) -> float:
    """Compute the flow speed [m/s] at |F| >= breakaway [N] through a valve that opens little by little."""
    before = _before(force, corner, p, side)
    return _shut_speed(before, p, side, guess) + (force - before) / corner.slope


@compiled
def _spread_slope(force: float, corner: Corner, p: Row, side: float) -> float:
    """Compute the slope [N s/m] of its curve at |F| >= breakaway [N]."""
    opened = 1.0 / (1.0 + math.exp(min((corner.force - force) / corner.spread, _LARGEST_EXPONENT)))
    w = _shut_speed(_before(force, corner, p, side), p, side, 0.0)
    return 1.0 / ((1.0 - opened) / _shut_slope(w, p, side) + opened / corner.slope)


@compiled
def _spread_force(w: float, corner: Corner, p: Row, side: float) -> float:
    """Solve `_spread_speed` for |F| [N] at a flow speed w >= 0 [m/s] by Newton's method within a bracket."""
    low = breakaway(p, side)
    most = corner.force + corner.spread * _ramp((low - corner.force) / corner.spread)  # f never passes it
    high, force = most + corner.slope * w, min(_shut_force(w, p, side), most)
    for _ in range(_NEWTON_STEPS):
        miss = _spread_speed(force, corner, p, side, w) - w
        if miss > 0.0:
            high = force
        else:
            low = force
        following = force - miss * _spread_slope(force, corner, p, side)
        if abs(following - force) <= _NEWTON_TOLERANCE * force or miss == 0.0:
            return min(max(following, low), high)
        if not low < following < high:
            following = 0.5 * (low + high)
        force = following
    return force


@compiled
def _shut_force(w: float, p: Row, side: float) -> float:
    """Compute |F| [N] at a flow speed w >= 0 [m/s], the relief valve shut."""
    friction = kernels.yield_force(w, p[T0] * kernels.direction_factor(side, p), p)
    return friction + viscous_force(w, p, side) + kernels.extra_force(w, side, p)


@compiled
def _shut_slope(w: float, p: Row, side: float) -> float:
    """Compute the slope [N s/m] of `_shut_force`; infinite at w = 0 where the fluid thins."""
    friction = kernels.yield_slope(w, p[T0] * kernels.direction_factor(side, p), p)
    return friction + kernels.viscous_slope(w, damping(p, side), p) + kernels.extra_slope(w, side, p)


@compiled
def _shut_speed(force: float, p: Row, side: float, guess: float) -> float:
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
def smooth_force(w: float, p: Row, side: float) -> float:
    """Compute |F| [N] at a flow speed w >= 0 [m/s], the relief valve shut or opening little by little."""
    corner = _corner(p, side)
    return _spread_force(w, corner, p, side) if corner.spread > 0.0 else _shut_force(w, p, side)


@compiled
def smooth_slope(w: float, force: float, p: Row, side: float) -> float:
    """Compute the slope [N s/m] of `smooth_force` at a flow speed [m/s] and its force [N].

    Infinite at w = 0 where the fluid thins.
    """
    corner = _corner(p, side)
    return _spread_slope(force, corner, p, side) if corner.spread > 0.0 else _shut_slope(w, p, side)


@compiled
def speed_explicit(p: Row) -> bool:
    """Return whether `smooth_speed` is a closed form, or the only form there is."""
    if rounded(p):
        return True
    if not kernels.yield_sharp(p):
        return False
    return kernels.extra_none(p) or (kernels.viscous_straight(p) and kernels.extra_speed(1.0, p[C], 1.0, p) >= 0.0)


@compiled
def smooth_speed(force: float, p: Row, side: float, guess: float) -> float:
    """Compute the flow speed [m/s] at a force [N] >= breakaway: `smooth_force` inverted."""
    corner = _corner(p, side)
    if corner.spread > 0.0:
        return _spread_speed(max(force, breakaway(p, side)), corner, p, side, guess)
    return _shut_speed(force, p, side, guess)


@compiled
def _searched_speed(force: float, p: Row, side: float, guess: float) -> float:
    """Solve `_shut_force` for the flow speed [m/s] by Newton's method within a bracket."""
    if force <= 0.0:
        return 0.0
    low, high = 0.0, kernels.viscous_speed(force, damping(p, side), p)
    w = guess if low < guess < high else 0.5 * high
    for _ in range(_NEWTON_STEPS):
        miss = _shut_force(w, p, side) - force
        if miss > 0.0:
            high = w
        else:
            low = w
        following = w - miss / _shut_slope(w, p, side)
        if abs(following - w) <= _NEWTON_TOLERANCE * w or abs(miss) <= _ROUNDING * force:
            return min(max(following, low), high)  # of the bracket it may be the very end
        if not low < following < high:
            following = 0.5 * (low + high)
        w = following
    return w


@compiled
def _searched_thinning(force: float, p: Row, side: float, guess: float) -> float:
    """Solve `_shut_force` over the viscous force, by which |F| rises by 1 or more everywhere; return the flow speed.

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
