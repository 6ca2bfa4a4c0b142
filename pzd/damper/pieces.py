"""One piece of the path inside one regime: in closed form where it is straight, else by Runge-Kutta.

Straight pieces with standing parameters are solved in closed form. The others are integrated by Dormand and Prince's
pair of order 5(4): in the elastic deflection e where the flow curve is inverted in closed form, else in the viscous
force s = visc(w), in which w(s) and F(s) are both explicit and dF/ds >= 1, so that nothing is inverted. Where a piece
is long beside the time in which the force settles (hard oil, slow test), Runge-Kutta would have to cut it in as many
parts, and a Rosenbrock method of order 4(3) takes its place.
"""

from __future__ import annotations

from typing import NamedTuple

from pzd.compiled import compiled, inlined
from pzd.damper import rosenbrock
from pzd.damper.dormand_prince import ERROR_WEIGHTS, STAGE_WEIGHTS, TIMES
from pzd.damper.element import relaxation, slip
from pzd.damper.flow import (
    breakaway,
    relief_slope,
    smooth_force_of,
    smooth_rise,
    smooth_slope,
    speed_explicit,
    straight,
    viscous_force,
    viscous_speed,
)
from pzd.damper.kernels import K, Row, interpolate, stroke_law, stroke_moves, stroke_slope, stroke_straight
from pzd.damper.regimes import RELIEF, STICK, deflection_on, speed_at, spring_force

_DIFFERENCE = 1e-3  # of a step, for the drift of the flow curve with moving parameters
_STIFF = 2.5  # settling times in a piece; Runge-Kutta is stable up to 3.3
_STIFF_TIMES, _STIFF_WEIGHTS = rosenbrock.TIMES, rosenbrock.STAGE_WEIGHTS
_RATE_WEIGHTS, _TIME_WEIGHTS, _DIAGONAL = rosenbrock.RATE_WEIGHTS, rosenbrock.TIME_WEIGHTS, rosenbrock.DIAGONAL
_NUDGE = 1e-7  # of the integrated variable, for the derivative of its rate


class TimeStep(NamedTuple):
    """One step: length h [s], extension speed from u0 to u1 [m/s], parameter rows from p0 to p1."""

    h: float
    u0: float
    u1: float
    p0: Row
    p1: Row
    moving: bool
    """Whether the two rows differ."""


@inlined
def row_in(step: TimeStep, at: float) -> Row:
    """The parameter row at a moment [s] of the step."""
    return interpolate(step.p0, step.p1, at / step.h) if step.moving else step.p0


@inlined
def extension_speed(step: TimeStep, at: float) -> float:
    """dx/dt [m/s] at a moment [s] of the step."""
    return step.u0 + (step.u1 - step.u0) * at / step.h


@compiled
def piece(
    e: float, w: float, at: float, dt: float, regime: int, side: float, step: TimeStep
) -> tuple[float, float, float]:
    """Elastic deflection and flow speed after a piece of length dt, and its embedded error as a force [N]."""
    if regime == STICK:
        return e + dt * extension_speed(step, at + 0.5 * dt), 0.0, 0.0
    p = row_in(step, at)
    if not step.moving and stroke_straight(p) and (regime == RELIEF or straight(p)):
        force = abs(spring_force(e, p))
        slope = relief_slope(p, side) if regime == RELIEF else viscous_force(1.0, p, side)
        pull, pull_after = side * extension_speed(step, at), side * extension_speed(step, at + dt)
        end = slip(force, force - slope * w, pull, pull_after, relaxation(dt, slope, p[K]))
        return deflection_on(end, p, side), w + (end - force) / slope, 0.0
    if speed_explicit(p) and dt * p[K] <= _STIFF * smooth_slope(w, p, side):
        end, last, error = _runge_kutta(e, extension_speed(step, at) - side * w, w, at, dt, regime, side, step, True)
        p = row_in(step, at + dt)
        force, other = side * p[K] * stroke_law(end, side, p), side * p[K] * stroke_law(end + error, side, p)
        return end, side * (extension_speed(step, at + dt) - last), abs(other - force)
    y = abs(spring_force(e, p)) if regime == RELIEF else viscous_force(w, p, side)
    rate = _rate_of_force(y, at, regime, side, step)
    if dt * p[K] > _STIFF * (relief_slope(p, side) if regime == RELIEF else smooth_slope(w, p, side)):
        y, error = _rosenbrock(y, rate, at, dt, regime, side, step)
    else:
        y, _, error = _runge_kutta(y, rate, w, at, dt, regime, side, step, False)
    p = row_in(step, at + dt)
    if regime == RELIEF:
        return deflection_on(y, p, side), speed_at(y, p, regime, side, w), abs(error)
    if y < 0.0:
        return deflection_on(breakaway(p, side) + y, p, side), 0.0, abs(error)
    w = viscous_speed(y, p, side)
    error *= smooth_rise(w, p, side)
    return deflection_on(smooth_force_of(y, p, side), p, side), w, abs(error)


@compiled
def _runge_kutta(
    y: float, r0: float, w: float, at: float, dt: float, regime: int, side: float, step: TimeStep, explicit: bool
) -> tuple[float, float, float]:
    """The integrated variable after dt, its rate there, and its embedded error; its rate at the start is given."""
    a, t, d = STAGE_WEIGHTS, TIMES, ERROR_WEIGHTS
    end = y + dt * (a[1, 0] * r0)
    r1 = _rate(end, w, at + t[1] * dt, regime, side, step, explicit)
    end = y + dt * (a[2, 0] * r0 + a[2, 1] * r1)
    r2 = _rate(end, w, at + t[2] * dt, regime, side, step, explicit)
    end = y + dt * (a[3, 0] * r0 + a[3, 1] * r1 + a[3, 2] * r2)
    r3 = _rate(end, w, at + t[3] * dt, regime, side, step, explicit)
    end = y + dt * (a[4, 0] * r0 + a[4, 1] * r1 + a[4, 2] * r2 + a[4, 3] * r3)
    r4 = _rate(end, w, at + t[4] * dt, regime, side, step, explicit)
    end = y + dt * (a[5, 0] * r0 + a[5, 1] * r1 + a[5, 2] * r2 + a[5, 3] * r3 + a[5, 4] * r4)
    r5 = _rate(end, w, at + t[5] * dt, regime, side, step, explicit)
    end = y + dt * (a[6, 0] * r0 + a[6, 2] * r2 + a[6, 3] * r3 + a[6, 4] * r4 + a[6, 5] * r5)
    r6 = _rate(end, w, at + t[6] * dt, regime, side, step, explicit)
    return end, r6, dt * (d[0] * r0 + d[2] * r2 + d[3] * r3 + d[4] * r4 + d[5] * r5 + d[6] * r6)


@compiled
def _rosenbrock(
    y: float, r0: float, at: float, dt: float, regime: int, side: float, step: TimeStep
) -> tuple[float, float]:
    """The integrated variable after dt, and its embedded error; its rate at the start is given."""
    a, c, t, d = _STIFF_WEIGHTS, _RATE_WEIGHTS, _STIFF_TIMES, _TIME_WEIGHTS
    nudge = _NUDGE * max(y, step.p0[K] * 1e-9)
    settling = (_rate_of_force(y + nudge, at, regime, side, step) - r0) / nudge
    span = _DIFFERENCE * dt
    drift = (_rate_of_force(y, at + span, regime, side, step) - r0) / span
    divisor = 1.0 / (dt * _DIAGONAL) - settling
    u0 = (r0 + dt * d[0] * drift) / divisor
    r = _rate_of_force(y + a[1, 0] * u0, at + t[1] * dt, regime, side, step)
    u1 = (r + dt * d[1] * drift + c[1, 0] * u0 / dt) / divisor
    r = _rate_of_force(y + a[2, 0] * u0 + a[2, 1] * u1, at + t[2] * dt, regime, side, step)
    u2 = (r + dt * d[2] * drift + (c[2, 0] * u0 + c[2, 1] * u1) / dt) / divisor
    r = _rate_of_force(y + a[3, 0] * u0 + a[3, 1] * u1 + a[3, 2] * u2, at + t[3] * dt, regime, side, step)
    u3 = (r + dt * d[3] * drift + (c[3, 0] * u0 + c[3, 1] * u1 + c[3, 2] * u2) / dt) / divisor
    end = y + a[4, 0] * u0 + a[4, 1] * u1 + a[4, 2] * u2 + a[4, 3] * u3
    r = _rate_of_force(end, at + dt, regime, side, step)
    u4 = (r + (c[4, 0] * u0 + c[4, 1] * u1 + c[4, 2] * u2 + c[4, 3] * u3) / dt) / divisor
    end += u4
    r = _rate_of_force(end, at + dt, regime, side, step)
    error = (r + (c[5, 0] * u0 + c[5, 1] * u1 + c[5, 2] * u2 + c[5, 3] * u3 + c[5, 4] * u4) / dt) / divisor
    return end + error, error


@compiled
def _rate(y: float, guess: float, at: float, regime: int, side: float, step: TimeStep, explicit: bool) -> float:
    """Rate of the integrated variable.

    Equation: de/dt = u(t) - side w(|F|)      Source: eq. (1), the flow curve inverted
    """
    if not explicit:
        return _rate_of_force(y, at, regime, side, step)
    p = row_in(step, at)
    return extension_speed(step, at) - side * speed_at(side * p[K] * stroke_law(y, side, p), p, regime, side, guess)


@compiled
def _rate_of_force(y: float, at: float, regime: int, side: float, step: TimeStep) -> float:
    """Rate of the integrated variable: of s in SMOOTH, of |F| in RELIEF.

    Equation: d|F|/dt = k s'(e) (side u - w) + (dk/dt)/k |F| + k ds/dt at e; in SMOOTH less what the moving curve
    does by itself
    """
    p = row_in(step, at)
    pull = side * extension_speed(step, at)
    softening = (step.p1[K] - step.p0[K]) / (step.h * p[K]) if step.moving else 0.0
    bent = not stroke_straight(p) or (step.moving and stroke_moves(step.p0, step.p1))
    if regime == RELIEF:
        rate = p[K] * (pull - speed_at(y, p, regime, side, 0.0))
        return (_behind_stroke(rate, y, at, p, side, step) if bent else rate) + softening * y
    s = max(y, 0.0)
    w = viscous_speed(s, p, side)
    rate = p[K] * (pull - w)
    if bent:
        rate = _behind_stroke(rate, smooth_force_of(s, p, side), at, p, side, step)
    if step.moving:
        span = _DIFFERENCE * step.h
        ahead, behind = (
            smooth_force_of(s, row_in(step, at + span), side),
            smooth_force_of(s, row_in(step, at - span), side),
        )
        rate += softening * smooth_force_of(s, p, side) - (ahead - behind) / (2.0 * span)
    return rate / smooth_rise(w, p, side)


@compiled
def _behind_stroke(rate: float, force: float, at: float, p: Row, side: float, step: TimeStep) -> float:
    """Rate of |F| [N/s] behind the stroke effects, at a |F| [N] whose rate without them is given.

    Equation: d|F|/dt = s'(e) rate + k ds/dt at constant e
    """
    e = deflection_on(force, p, side)
    rate *= stroke_slope(e, side, p)
    if step.moving:
        span = _DIFFERENCE * step.h
        ahead, behind = stroke_law(e, side, row_in(step, at + span)), stroke_law(e, side, row_in(step, at - span))
        rate += p[K] * side * (ahead - behind) / (2.0 * span)
    return rate
