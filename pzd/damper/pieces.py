"""One piece of the path inside one regime: in closed form where it is straight, else by an exponential integrator.

Straight pieces with standing parameters are solved in closed form. The others are integrated by the method of
`pzd.damper.exponential`, which takes the slope of the flow curve exactly however fast the force settles beside the
piece (hard oil, slow test): in the elastic deflection e where the flow curve is inverted in closed form, else in the
viscous force s = visc(w), in which w(s) and F(s) are both explicit and dF/ds >= 1, so that nothing is inverted.
"""

from __future__ import annotations

from typing import NamedTuple

from pzd.compiled import compiled, inlined
from pzd.damper.element import relaxation, slip
from pzd.damper.exponential import COUPLING, STAGES, bend, end_corrected, phi
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
_SECOND_DIFFERENCE = 0.03  # of a step, for the change of that drift: a shorter one would show rounding
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
    if speed_explicit(p):
        end, error = _exponential(e, w, at, dt, regime, side, step, True)
        p = row_in(step, at + dt)
        force, other = side * p[K] * stroke_law(end, side, p), side * p[K] * stroke_law(end + error, side, p)
        return end, speed_at(force, p, regime, side, w), abs(other - force)
    y = abs(spring_force(e, p)) if regime == RELIEF else viscous_force(w, p, side)
    y, error = _exponential(y, w, at, dt, regime, side, step, False)
    p = row_in(step, at + dt)
    if regime == RELIEF:
        return deflection_on(y, p, side), speed_at(y, p, regime, side, w), abs(error)
    if y < 0.0:
        return deflection_on(breakaway(p, side) + y, p, side), 0.0, abs(error)
    w = viscous_speed(y, p, side)
    error *= smooth_rise(w, p, side)
    return deflection_on(smooth_force_of(y, p, side), p, side), w, abs(error)


@compiled
def _exponential(
    y: float, w: float, at: float, dt: float, regime: int, side: float, step: TimeStep, explicit: bool
) -> tuple[float, float]:
    """The integrated variable after dt, and its error; see `pzd.damper.exponential`."""
    rate = _rate(y, w, at, regime, side, step, explicit)
    by_y, by_time = _slopes(y, rate, w, at, dt, regime, side, step, explicit)
    z, c, d = by_y * dt, STAGES[0], STAGES[1]
    over, half, late = phi(z), phi(c * z), phi(d * z)
    way, drift = rate * dt, by_time * dt * dt
    first = y + c * way * half.one + c * c * drift * half.two
    beside = _rate(first, w, at + c * dt, regime, side, step, explicit) - rate
    beside -= by_y * (first - y) + by_time * c * dt
    second = y + d * way * late.one + d * d * drift * late.two
    second += dt * beside * (COUPLING[0] * half.three + COUPLING[1] * late.three)
    later = _rate(second, w, at + d * dt, regime, side, step, explicit) - rate
    later -= by_y * (second - y) + by_time * d * dt
    a, b = bend(beside, later)
    end = y + way * over.one + drift * over.two + dt * (2.0 * a * over.three + 6.0 * b * over.four)
    last = _rate(end, w, at + dt, regime, side, step, explicit) - rate - by_y * (end - y) - by_time * dt
    added, error = end_corrected(a, b, last, over)
    return end + dt * added, dt * error


@compiled
def _slopes(
    y: float, rate: float, w: float, at: float, dt: float, regime: int, side: float, step: TimeStep, explicit: bool
) -> tuple[float, float]:
    """Derivatives of the rate of the integrated variable by itself and by time."""
    p = row_in(step, at)
    if explicit:
        rise = relief_slope(p, side) if regime == RELIEF else smooth_slope(w, p, side)
        by_y = -p[K] * stroke_slope(y, side, p) / rise
    else:
        nudge = _NUDGE * max(y, p[K] * 1e-9)
        by_y = (_rate(y + nudge, w, at, regime, side, step, explicit) - rate) / nudge
    if not step.moving:
        if explicit:
            return by_y, (step.u1 - step.u0) / step.h
        return by_y, (_rate(y, w, at + dt, regime, side, step, explicit) - rate) / dt  # linear in time
    span = _SECOND_DIFFERENCE * step.h
    ahead = _rate(y, w, at + span, regime, side, step, explicit)
    return by_y, (ahead - _rate(y, w, at - span, regime, side, step, explicit)) / (2.0 * span)


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
