"""One piece of the path inside one regime: in closed form where it is straight, else by Runge-Kutta.

Straight pieces with standing parameters are solved in closed form. The others are integrated by
Dormand and Prince's pair of order 5(4) in the viscous force s = visc(w), in which w(s) and F(s)
are both explicit and dF/ds >= 1, so that nothing is inverted.
"""

from __future__ import annotations

from typing import NamedTuple

from pzd.compiled import compiled
from pzd.damper.dormand_prince import ERROR_WEIGHTS, STAGE_WEIGHTS, STAGES, TIMES
from pzd.damper.element import relaxation, slip
from pzd.damper.flow import (
    breakaway,
    relief_slope,
    smooth_force_of,
    smooth_rise,
    straight,
    viscous_force,
    viscous_speed,
)
from pzd.damper.kernels import K, Row, interpolate, stroke_law, stroke_moves, stroke_slope, stroke_straight
from pzd.damper.regimes import RELIEF, STICK, deflection_on, speed_at, spring_force
from pzd.record import Array

_DIFFERENCE = 1e-3  # of a step, for the drift of the flow curve with moving parameters


class Step(NamedTuple):
    """One step: length h [s], extension speed from u0 to u1 [m/s], parameter rows from p0 to p1."""

    h: float
    u0: float
    u1: float
    p0: Row
    p1: Row
    moving: bool
    """Whether the two rows differ."""


@compiled
def row_in(step: Step, at: float) -> Row:
    """The parameter row at a moment [s] of the step."""
    return interpolate(step.p0, step.p1, at / step.h) if step.moving else step.p0


@compiled
def extension_speed(step: Step, at: float) -> float:
    """dx/dt [m/s] at a moment [s] of the step."""
    return step.u0 + (step.u1 - step.u0) * at / step.h


@compiled
def piece(
    e: float, w: float, at: float, dt: float, regime: int, side: float, step: Step, stages: Array
) -> tuple[float, float, float]:
    """Elastic deflection and flow speed after a piece of length dt, and its embedded error as a force [N]."""
    if regime == STICK:
        return e + dt * extension_speed(step, at + 0.5 * dt), 0.0, 0.0
    p = row_in(step, at)
    force = abs(spring_force(e, p))
    if not step.moving and stroke_straight(p) and (regime == RELIEF or straight(p)):
        slope = relief_slope(p, side) if regime == RELIEF else viscous_force(1.0, p, side)
        pull, pull_after = side * extension_speed(step, at), side * extension_speed(step, at + dt)
        end = slip(force, force - slope * w, pull, pull_after, relaxation(dt, slope, p[K]))
        return deflection_on(end, p, side), w + (end - force) / slope, 0.0
    y, error = _runge_kutta(
        force if regime == RELIEF else viscous_force(w, p, side), at, dt, regime, side, step, stages
    )
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
    y: float, at: float, dt: float, regime: int, side: float, step: Step, stages: Array
) -> tuple[float, float]:
    """The integrated variable after dt, and its embedded error."""
    end, error = y, 0.0
    for i in range(STAGES):
        change = 0.0
        for j in range(i):
            change += STAGE_WEIGHTS[i, j] * stages[j]
        end = y + dt * change
        stages[i] = _rate(end, at + TIMES[i] * dt, regime, side, step)
        error += ERROR_WEIGHTS[i] * stages[i]
    return end, dt * error


@compiled
def _rate(y: float, at: float, regime: int, side: float, step: Step) -> float:
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
def _behind_stroke(rate: float, force: float, at: float, p: Row, side: float, step: Step) -> float:
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
