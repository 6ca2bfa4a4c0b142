"""One step of the damper's path: stick, slip and relief, with everything moving.

Over a step the extension speed u = dx/dt and the parameter row go linearly:

    de/dt = u(t) - side w(|F|),   F = k(t) s(e),   side = sign(F)

Where a piece of the path leaves its regime, the moment is found within a bracket and the piece is cut; so it is where
the rod turns round, for a force that leaves its regime and comes back would not be seen at the end.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pzd.compiled import compiled, inlined
from pzd.damper.compiled.kernels import FLOW, T0, C, K, Row, interpolate, nudged, stroke_law, stroke_slope
from pzd.damper.element import relaxation
from pzd.damper.flow import breakaway, relief, relief_slope, smooth_force, smooth_slope, smooth_speed
from pzd.damper.regimes import (
    RELIEF,
    SMOOTH,
    STICK,
    TimeStep,
    beyond,
    extension_speed,
    onto_edge,
    over_yield,
    piece,
    regime_of,
    row_in,
    speed_at,
    spring_energy,
    spring_force,
)
from pzd.record import Array

# ----------------------------------------------------------------------------------------------------
# Derivatives of the damper's path by parameters, carried along it piece by piece.
#
# Equation: d(de)/dt = -(dW/de) de - (dW/dp) dp,  W = side w(|F|),  F = k s(e)
# Source: Hairer, Norsett and Wanner 1993, Solving Ordinary Differential Equations I, section I.14: the variational
# equation of de/dt = u(t) - W
#
# W is continuous where a piece ends on the edge of its regime, so the moment of that adds nothing. How W goes with p is
# taken from the explicit flow curve, w_p = (|F|_p - f_p)/f_w, so nothing is inverted, and every law is served.


_NUDGE = 1e-6
"""Change of a column for its derivatives, as a share of itself or of what a variable changes it by: about half the
digits of a double."""
_LOOKED_AT = 100  # samples that show how large these changes are
_VANISHING = 1e-9  # of the larger slope at the ends of a piece: the oil hardly flows there, and has no steady state


class Varied(NamedTuple):
    """Which parameters vary, and what that makes of the elastic deflection."""

    columns: NDArray[np.int64]
    """(c,) columns of the parameter row that vary."""
    nudges: Array
    """(c,) change of each for its derivative, in its own unit."""
    along: Array
    """(n, v, c) or (1, v, c) derivatives of these columns by each variable, linear between samples."""
    partial: Array
    """(c,) derivatives by each column, of whatever is looked at."""
    carried: Array
    """(v,) derivative of the elastic deflection by each variable [m]."""
    first: Array
    """(1 + v,) at the start of a piece: derivatives of W by the deflection [1/s], and by each variable, taken off."""
    last: Array
    """(1 + v,) the same at its end."""
    place: Array
    """(2,) regime and side to which `last` belongs; NaN before the first piece."""


def varied(rows: Array, columns: NDArray[np.int64], along: Array) -> Varied:
    """What is carried along for the derivatives by v variables that move c columns of the parameter row.

    Parameters
    ----------
    rows : (n, r) or (1, r) parameter rows
    columns : (c,) places in the row
    along : (n, v, c) or (1, v, c) derivatives of these columns by each variable
    """
    samples, variables, count = along.shape
    own, some = np.abs(rows[0, columns]), along[:: max(samples // _LOOKED_AT, 1)]
    largest = np.maximum(np.max(np.abs(some), axis=(0, 1), initial=0.0), np.where(np.isfinite(own), own, 0.0))
    nudges = _NUDGE * np.where(largest > 0.0, largest, 1.0)
    ends = np.zeros((2, 1 + variables))
    place = np.full(2, np.nan)
    return Varied(
        columns,
        nudges,
        np.ascontiguousarray(along),
        np.zeros(count),
        np.zeros(variables),
        ends[0],
        ends[1],
        place,
    )


def not_varied() -> Varied:
    """No variables: nothing is carried along."""
    return varied(np.zeros((1, 0)), np.zeros(0, dtype=np.int64), np.zeros((1, 0, 0)))


@inlined
def _by_variable(v: Varied, variable: int, sample: int, share: float) -> float:
    """What the `partial` derivatives make of a variable, at a share of the way from one sample to the next."""
    found, last = 0.0, v.along.shape[0] - 1
    if last == 0 or share == 0.0 or share >= 1.0:
        at = min(sample if share < 1.0 else sample + 1, last)
        for c in range(v.columns.size):
            found += v.partial[c] * v.along[at, variable, c]
    else:
        for c in range(v.columns.size):
            before, after = v.along[sample, variable, c], v.along[sample + 1, variable, c]
            found += v.partial[c] * (before + (after - before) * share)
    return found


@compiled
def begin(v: Varied, e: float, p: Row, initial_slopes: Array) -> None:
    """Begin at an elastic deflection [m] whose force goes with each variable by (v,) initial slopes [N]."""
    if v.carried.size > 0:
        by_deflection = _of_force(v, e, p)
        for j in range(v.carried.size):
            rest = initial_slopes[j] - _by_variable(v, j, 0, 0.0)
            v.carried[j] = rest / by_deflection if by_deflection > 0.0 else 0.0


@compiled
def fill_slopes(v: Varied, e: float, p: Row, sample: int, slopes: Array) -> None:
    """Fill derivatives of the force of the oil spring [N] by each variable, (v,), at a sample."""
    by_deflection = _of_force(v, e, p)
    for j in range(v.carried.size):
        slopes[j] = by_deflection * v.carried[j] + _by_variable(v, j, sample, 0.0)


@compiled
def _of_force(v: Varied, e: float, p: Row) -> float:
    """Derivative of the force of the oil spring by the deflection [N/m]; those by the columns go to `partial`."""
    side, force = math.copysign(1.0, e), spring_force(e, p)
    for c in range(v.columns.size):
        by = v.nudges[c]
        moves = K <= v.columns[c] < FLOW
        v.partial[c] = (spring_force(e, nudged(p, v.columns[c], by)) - force) / by if moves else 0.0
    return p[K] * stroke_slope(e, side, p) if force != 0.0 else 0.0


@compiled
def _rates(
    v: Varied, e: float, w: float, p: Row, regime: int, side: float, sample: int, share: float, found: Array
) -> None:
    """Fill (1 + v,) derivatives of W by the deflection [1/s] and, taken off, by each variable, at one moment."""
    if regime == STICK:
        found[:] = 0.0
        return
    rise = relief_slope(p, side) if regime == RELIEF else smooth_slope(w, p, side)
    found[0] = p[K] * stroke_slope(e, side, p) / rise
    pull, curve = side * p[K] * stroke_law(e, side, p), _curve(w, p, regime, side)
    for c in range(v.columns.size):
        q = nudged(p, v.columns[c], v.nudges[c])
        if K <= v.columns[c] < FLOW:
            change = side * q[K] * stroke_law(e, side, q) - pull
        else:
            change = curve - _curve(w, q, regime, side)
        v.partial[c] = -side * change / (rise * v.nudges[c])
    for j in range(v.carried.size):
        found[1 + j] = _by_variable(v, j, sample, share)


@inlined
def _curve(w: float, p: Row, regime: int, side: float) -> float:
    """Force [N] that drives the oil at a flow speed [m/s] by a regime's own law."""
    if regime == RELIEF:
        edge = relief(p, side)
        return edge + relief_slope(p, side) * (w - smooth_speed(edge, p, side, w))
    return smooth_force(w, p, side)


@compiled
def carry(
    v: Varied,
    e: float,
    end: float,
    w: float,
    speed: float,
    at: float,
    dt: float,
    regime: int,
    side: float,
    step: TimeStep,
    sample: int,
) -> None:
    """Bring the derivatives of the deflection through a piece of the path.

    Over the time tau, d tau = (dW/de) dt, the derivative goes to g = -(dW/dp) dp / (dW/de), which is taken as linear.

    Parameters
    ----------
    v : what varies; changed in place
    e, end : elastic deflection at its start and end [m]
    w, speed : flow speed there [m/s]
    at, dt : where in the step it begins, and its length [s]
    regime, side : see `pzd.damper.regimes`
    step : in which it lies
    sample : before that step
    """
    if v.place[0] == regime and v.place[1] == side:
        for i in range(v.first.size):
            v.first[i] = v.last[i]
    else:
        _rates(v, e, w, row_in(step, at), regime, side, sample, at / step.h, v.first)
    v.place[0], v.place[1] = regime, side
    _rates(v, end, speed, row_in(step, at + dt), regime, side, sample, (at + dt) / step.h, v.last)
    slope, slope_after = v.first[0], v.last[0]
    if slope == 0.0 and slope_after == 0.0:
        return
    z = 0.5 * (slope + slope_after) * dt
    over = relaxation(1.0, 1.0, z)
    if min(slope, slope_after) > _VANISHING * max(slope, slope_after):
        early, late = (over.by_speed - over.by_change) / slope, over.by_change / slope_after
    else:
        early, late = (over.by_speed - over.by_change) / z * dt, over.by_change / z * dt
    for j in range(v.carried.size):
        v.carried[j] = over.decay * v.carried[j] + early * v.first[1 + j] + late * v.last[1 + j]


# ----------------------------------------------------------------------------------------------------


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
