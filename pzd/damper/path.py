"""One step of the damper's path: stick, slip and relief, with everything moving.

Over a step the extension speed u = dx/dt and the parameter row go linearly:

    de/dt = u(t) - side w(|F|),   F = k(t) s(e),   side = sign(F)

Where a piece of the path leaves its regime, the moment is found within a bracket and the piece is cut; so it is where
the rod turns round, for a force that leaves its regime and comes back would not be seen at the end.
"""

from __future__ import annotations

import math

from pzd.compiled import compiled
from pzd.damper.flow import breakaway, relief, smooth_force
from pzd.damper.kernels import T0, C, K, Row, interpolate, stroke_slope
from pzd.damper.path_sensitivities import Varied, carry
from pzd.damper.pieces import TimeStep, extension_speed, piece, row_in
from pzd.damper.regimes import (
    SMOOTH,
    STICK,
    beyond,
    onto_edge,
    over_yield,
    regime_of,
    speed_at,
    spring_energy,
    spring_force,
)
from pzd.record import Array

DEFLECTION, SPEED, DISSIPATED, VALVE_WORK = range(4)
"""The state: e [m], the last flow speed w [m/s], and the energies so far [J]."""
STATES = 4

_MOST_PIECES = 2000
_MOST_BRACKETS = 60
_NEWTON_STEPS = 12  # then bisection, which cannot creep
_ON_EDGE = 1e-13  # of the force
_OFF_EDGE = 1e-6  # of a piece
_SHORTEST_PIECE = 1e-13  # of a piece; not zero, so that the side it leaves to is seen
_SAME_FORCE = 1e-11  # of the force; a saved flow speed that gives it within this is kept


@compiled
def advance(state: Array, step: TimeStep, tolerance: float, booked: bool, v: Varied, sample: int) -> None:
    """Carry the state through one step.

    Parameters
    ----------
    state : (4,) elastic deflection, flow speed, dissipated energy, work of the valve; changed in place
    step : what happens in it
    tolerance : admissible error of a piece, as a share of the force
    booked : whether the energies are booked, which doubles the work
    v : what varies, its derivatives carried along; changed in place
    sample : before the step
    """
    e, w, at = state[DEFLECTION], state[SPEED], 0.0
    turn = step.u0 / (step.u0 - step.u1) * step.h if step.u0 * step.u1 < 0.0 else step.h
    dt = step.h
    force = abs(spring_force(e, step.p0))
    size = size_of(step)
    regime, side = regime_of(spring_force(e, step.p0), step.p0)
    if regime != SMOOTH or abs(smooth_force(w, step.p0, side) - force) > _SAME_FORCE * force:
        w = speed_at(force, step.p0, regime, side, w)
    for _ in range(_MOST_PIECES):
        dt = min(dt, step.h - at)
        if at < turn * (1.0 - 1e-14):
            dt = min(dt, turn - at)
        end, speed, error = piece(e, w, at, dt, regime, side, step)
        allowed = tolerance * (abs(spring_force(e, step.p1)) + size)
        if not error <= allowed and dt > 1e-7 * step.h:  # where what grows has overflowed there is no error to compare
            dt *= max(0.2, _growth(error, allowed)) if error > allowed else 0.2
            continue
        over, way = beyond(end, row_in(step, at + dt), regime, side)
        following, onto = regime, side
        if over > 0.0:
            dt = _crossing(e, w, at, dt, over, way, regime, side, step)
            end, speed, error = piece(e, w, at, dt, regime, side, step)
            p = row_in(step, at + dt)
            end, following, onto = onto_edge(end, p, regime, side, way)
            speed = speed_at(abs(spring_force(end, p)), p, following, onto, speed)
        if booked:
            _book(state, e, end, w, speed, at, dt, regime, side, step)
        if v.carried.size > 0:
            carry(v, e, end, w, speed, at, dt, regime, side, step, sample)
        e, w = end, speed
        at += dt
        if at >= step.h * (1.0 - 1e-14):
            break
        regime, side = following, onto
        dt = (step.h - at) if over > 0.0 else dt * min(4.0, _growth(error, allowed))
    state[DEFLECTION] = e
    state[SPEED] = w


@compiled
def _growth(error: float, allowed: float) -> float:
    """By which factor a piece may be longer for the error that is allowed, its error being of fifth order."""
    return 0.9 * math.pow(allowed / max(error, 1e-9 * allowed), 0.2)


@compiled
def size_of(step: TimeStep) -> float:
    """How large the force of a step is at least [N], where it passes through zero too: T0 + C |u|."""
    return step.p1[T0] + step.p1[C] * max(abs(step.u0), abs(step.u1))


@compiled
def _miss(e: float, p: Row, regime: int, side: float, way: int) -> float:
    """How far the state lies past the edge that is looked for [N], negative before it.

    In SMOOTH, which has two, that of the `way` alone: a piece may start on the other one.
    """
    if regime == STICK:
        return over_yield(e, p, side)
    if regime == SMOOTH:
        above_yield = over_yield(e, p, side)
        return above_yield + breakaway(p, side) - relief(p, side) if way > 0 else -above_yield
    return beyond(e, p, regime, side)[0]


@compiled
def _crossing(
    e: float, w: float, at: float, dt: float, over: float, way: int, regime: int, side: float, step: TimeStep
) -> float:
    """Length of the piece that ends on the edge of its regime: Newton's method within a bracket, then bisection."""
    size = abs(spring_force(e, step.p0)) + size_of(step)
    if regime == STICK:
        end, _, _ = piece(e, w, at, dt, regime, side, step)
        side = math.copysign(1.0, end)
    low, high, below, above = 0.0, dt, min(_miss(e, row_in(step, at), regime, side, way), 0.0), over
    if regime == STICK and below > -_ON_EDGE * size:  # it starts on this edge: look for where it comes back
        low = _OFF_EDGE * dt
        end, _, _ = piece(e, w, at, low, regime, side, step)
        below = _miss(end, row_in(step, at + low), regime, side, way)
        if below >= 0.0:
            return _SHORTEST_PIECE * dt
    time = (low * above - high * below) / (above - below)
    for i in range(_MOST_BRACKETS):
        if i > _NEWTON_STEPS or not low < time < high:
            time = 0.5 * (low + high)
        end, speed, _ = piece(e, w, at, time, regime, side, step)
        p = row_in(step, at + time)
        miss = _miss(end, p, regime, side, way)
        if abs(miss) <= _ON_EDGE * size or high - low <= 1e-15 * step.h:
            return time
        if miss > 0.0:
            high = time
        else:
            low = time
        lengthening = side * extension_speed(step, at + time) - speed
        time -= miss / (way * p[K] * stroke_slope(end, side, p) * lengthening)  # as if the parameters stood still
    return high


@compiled
def _book(
    state: Array,
    e0: float,
    e1: float,
    w0: float,
    w1: float,
    at: float,
    dt: float,
    regime: int,
    side: float,
    step: TimeStep,
) -> None:
    """Book the energies of a piece by Simpson's rule, its middle computed like its end."""
    em, wm, _ = piece(e0, w0, at, 0.5 * dt, regime, side, step)
    first, last = row_in(step, at), row_in(step, at + dt)
    middle = interpolate(first, last, 0.5)
    if regime != STICK:
        start, half, end = abs(spring_force(e0, first)), abs(spring_force(em, middle)), abs(spring_force(e1, last))
        state[DISSIPATED] += dt / 6.0 * (start * w0 + 4.0 * half * wm + end * w1)
    if step.moving:
        state[VALVE_WORK] += (
            _tightening(e0, first, last) + 4.0 * _tightening(em, first, last) + _tightening(e1, first, last)
        ) / 6.0


@compiled
def _tightening(e: float, first: Row, last: Row) -> float:
    """Work [J] of turning one row into another at an elastic deflection [m]."""
    return spring_energy(e, last, last[K]) - spring_energy(e, first, first[K])
