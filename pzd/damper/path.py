"""The damper's path through stick, slip and relief along a sampled motion, with its derivatives by parameters.

Between two samples the extension speed u = dx/dt and the parameter row are linear:

    de/dt = u(t) - side w(|F|),   F = k(t) s(e),   side = sign(F)

A step that stays in one regime is solved as a whole where there is a closed form, else piece by piece. Where a piece
leaves its regime, the moment is found within a bracket and the piece ends there. It also ends where the rod reverses: a
force that leaves its regime and returns within a piece would not show at its end.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pzd.compiled import compiled, inlined
from pzd.damper import regimes
from pzd.damper.compiled.kernels import FLOW, T0, C, K, Row, nudged, row_of, stroke_law, stroke_slope
from pzd.damper.element import relaxation
from pzd.damper.flow import breakaway, relief, relief_slope, rounded, smooth_force, smooth_slope, smooth_speed
from pzd.damper.regimes import (
    RELIEF,
    SMOOTH,
    STICK,
    UNSOLVED,
    TimeStep,
    extension_speed,
    row_in,
    speed_at,
    spring_force,
)
from pzd.record import Array

DEFLECTION, SPEED = range(2)
"""The state: elastic deflection e [m] and the last flow speed w [m/s], where the next search for it begins."""
STATES = 2


class Variables(NamedTuple):
    """v variables by which a force is differentiated, each of which changes c columns of the parameter row."""

    columns: NDArray[np.int64]
    """(c,) columns of the parameter row."""
    along: Array
    """(n, v, c) or (1, v, c) derivatives of these columns by each variable, linear between samples; for k those of the
    compliance 1/k, which are finite in a rigid damper too."""
    initial_slopes: Array
    """(v,) derivatives of the initial force by each variable [N]."""


NO_VARIABLES = Variables(np.zeros(0, dtype=np.int64), np.zeros((1, 0, 0)), np.zeros(0))


class Sensitivities(NamedTuple):
    """Derivatives of the elastic deflection by v variables, and what advances them; see `Variables`."""

    columns: NDArray[np.int64]
    """(c,) columns of the parameter row."""
    nudges: Array
    """(c,) change of each for its derivative, in its own unit."""
    along: Array
    """(n, v, c) or (1, v, c) derivatives of these columns by each variable, linear between samples."""
    partial: Array
    """(c,) working array: derivatives of one quantity by each column."""
    deflection: Array
    """(v,) the derivatives of the elastic deflection [m]."""
    first: Array
    """(1 + v,) at the start of a piece: dW/de [1/s], and the derivatives of -W by each variable [m/s]."""
    last: Array
    """(1 + v,) the same at its end."""
    place: Array
    """(2,) regime and side of `last`, which starts the next piece of the same; NaN before the first piece."""


# --- A sampled motion ---


def march(
    displacement: Array, velocity: Array, steps: Array, rows: Array, initial_force: float, tolerance: float
) -> Array:
    """Compute the force of the element with its stroke and flow effects along a motion.

    Parameters
    ----------
    displacement : (n,) extension [m]
    velocity : (n,) extension speed [m/s], whose change bends the displacement inside a step; (1,) for straight
    steps : (n - 1,) or (1,) sampling intervals [s]
    rows : (n, r) or (1, r) parameter rows, see `kernels.Row`, linear between samples
    initial_force : force of the element at the first sample [N]
    tolerance : admissible error of a piece, as a share of the force

    Returns
    -------
    (n,) force [N]
    """
    return march_sensitivities(displacement, velocity, steps, rows, initial_force, tolerance, NO_VARIABLES)[0]


def march_sensitivities(
    displacement: Array,
    velocity: Array,
    steps: Array,
    rows: Array,
    initial_force: float,
    tolerance: float,
    variables: Variables,
) -> tuple[Array, Array]:
    """Compute the same force, and its derivatives by v variables.

    Parameters
    ----------
    displacement, velocity, steps, rows, initial_force, tolerance : as `march`
    variables : what they change

    Returns
    -------
    (n,) force [N] and (n, v) its derivatives [N]
    """
    force, slopes = np.empty(displacement.size), np.empty((displacement.size, variables.initial_slopes.size))
    rows = _off_the_limits(rows)
    v, state, initial_slopes = sensitivities_to(variables, rows), np.zeros(STATES), variables.initial_slopes
    _march(displacement, velocity, steps, rows, initial_force, initial_slopes, tolerance, state, force, v, slopes)
    return force, slopes


RIGID = 1e-6
"""Deflection [m] of a rigid damper's oil spring on its path, by T0 + C v at 1 m/s: less than any displacement sensor
shows, and not so stiff that rounding of the deflection shows in the force."""
LEAST_DAMPING = 1e-2
"""Least C on its path [N s/m], and least C v at 1 m/s as a share of T0: the flow curve has to rise, to be inverted."""


def _off_the_limits(rows: Array) -> Array:
    """Return (n, r) rows in which a rigid damper is hardly elastic, and one without damping hardly damps."""
    moved = rows.copy()
    moved[:, C], moved[:, K] = off_the_limits(rows[:, T0], rows[:, C], rows[:, K])
    return moved


Numbers = Array | float


def off_the_limits(friction: Numbers, damping: Numbers, stiffness: Numbers) -> tuple[Numbers, Numbers]:
    """Return C [N s/m] and k [N/m] of a path, from T0 [N], C and k, one or more of each."""
    damps = np.maximum(damping, LEAST_DAMPING * np.maximum(friction, 1.0))
    return damps, np.minimum(stiffness, (friction + damps) / RIGID)


def deflections(force: Array, rows: Array) -> Array:
    """Compute the (n,) elastic deflections [m] of an element that carries (n,) forces [N], by (n, r) or (1, r) rows."""
    rows, found = _off_the_limits(rows), np.empty(force.size)
    _fill_deflections(force, rows, found)
    return found


@compiled
def _fill_deflections(force: Array, rows: Array, found: Array) -> None:
    """Fill the (n,) deflections of (n,) forces."""
    for i in range(force.size):
        found[i] = regimes.deflection_at(force[i], row_of(rows[min(i, rows.shape[0] - 1)]))


@compiled
def _march(
    displacement: Array,
    velocity: Array,
    steps: Array,
    rows: Array,
    initial_force: float,
    initial_slopes: Array,
    tolerance: float,
    state: Array,
    force: Array,
    v: Sensitivities,
    slopes: Array,
) -> None:
    """Fill the (n,) force and, where there are variables, the (n, v) slopes."""
    p0 = row_of(rows[0])
    p1 = p0
    state[DEFLECTION] = regimes.deflection_at(initial_force, p0)
    force[0] = spring_force(state[DEFLECTION], p0)
    begin_sensitivities(v, state[DEFLECTION], p0, initial_slopes)
    if v.deflection.size > 0:
        fill_slopes(v, state[DEFLECTION], p0, 0, slopes[0])
    moving = False
    for i in range(1, displacement.size):
        if rows.shape[0] > 1:
            p0, p1 = p1, row_of(rows[i])
            moving = p0 != p1
        h = steps[min(i - 1, steps.size - 1)]
        mean = (displacement[i] - displacement[i - 1]) / h
        half = 0.5 * (velocity[i] - velocity[i - 1]) if velocity.size > 1 else 0.0
        step = TimeStep(h, mean - half, mean + half, p0, p1, moving)
        end, speed = regimes.whole_step(state[DEFLECTION], step, tolerance) if regimes.is_straight(p0, p1) else UNSOLVED
        if math.isnan(end):
            advance(state, step, tolerance, v, i - 1)
        else:
            if v.deflection.size > 0:
                _advance_whole_step(v, state[DEFLECTION], end, speed, step, i - 1)
            state[DEFLECTION], state[SPEED] = end, speed
        force[i] = spring_force(state[DEFLECTION], p1)
        if v.deflection.size > 0:
            fill_slopes(v, state[DEFLECTION], p1, i, slopes[i])


@compiled
def _advance_whole_step(v: Sensitivities, e: float, end: float, speed: float, step: TimeStep, sample: int) -> None:
    """Advance the derivatives over a step in one regime."""
    regime, side = regimes.regime_of(spring_force(e, step.p0), step.p0)
    w = speed_at(abs(spring_force(e, step.p0)), step.p0, regime, side, speed)
    advance_sensitivities(v, e, end, w, speed, 0.0, step.h, regime, side, step, sample)


# --- One step, piece by piece ---

_MOST_PIECES = 2000  # per step; one of usual length takes less than ten
_BRACKET_STEPS = 60  # bisection alone needs 53 for all digits of a double
_NEWTON_STEPS = 12  # then bisection, which converges in any case
_ON_EDGE = 1e-13  # share of the force: a few times its rounding
_OFF_EDGE = 1e-6  # share of a piece at which a state that starts on the edge has left it
_SHORTEST_PIECE = 1e-13  # share of a piece; not zero, so that the side to which it leaves shows
_SAME_FORCE = 1e-11  # share of the force; a saved flow speed that gives it within this is used again
_REST = 1e-14  # share of a step; what is left is rounding
_LEAST_SHARE = 1e-7  # of a step; pieces are not shortened further
_SHORTENED, _LENGTHENED = 0.2, 4.0  # limits of the change of length from piece to piece


@compiled
def advance(state: Array, step: TimeStep, tolerance: float, v: Sensitivities, sample: int) -> None:
    """Advance the state over one step.

    Parameters
    ----------
    state : (2,) elastic deflection and flow speed; changed in place
    step : the step
    tolerance : admissible error of a piece, as a share of the force
    v : sensitivities, advanced too where there are variables; changed in place
    sample : index of the sample before the step
    """
    e, w, at = state[DEFLECTION], state[SPEED], 0.0
    turn = step.u0 / (step.u0 - step.u1) * step.h if step.u0 * step.u1 < 0.0 else step.h
    dt = step.h
    force = abs(spring_force(e, step.p0))
    size = size_of(step)
    regime, side = regimes.regime_of(spring_force(e, step.p0), step.p0)
    inverted = regime == SMOOTH and not rounded(step.p0)
    if not inverted or abs(smooth_force(w, step.p0, side) - force) > _SAME_FORCE * force:
        w = speed_at(force, step.p0, regime, side, w)
    for _ in range(_MOST_PIECES):
        dt = min(dt, step.h - at)
        if at < turn * (1.0 - _REST):
            dt = min(dt, turn - at)
        end, speed, error = regimes.piece(e, w, at, dt, regime, side, step)
        allowed = tolerance * (abs(spring_force(e, step.p1)) + size)
        if not error <= allowed and dt > _LEAST_SHARE * step.h:  # not `error > allowed`: an overflow leaves NaN
            dt *= max(_SHORTENED, _growth(error, allowed)) if error > allowed else _SHORTENED
            continue
        over, way = regimes.beyond(end, row_in(step, at + dt), regime, side)
        following, onto = regime, side
        if over > 0.0:
            dt = _crossing(e, w, at, dt, over, way, regime, side, step)
            end, speed, error = regimes.piece(e, w, at, dt, regime, side, step)
            p = row_in(step, at + dt)
            end, following, onto = regimes.onto_edge(end, p, regime, side, way)
            speed = speed_at(abs(spring_force(end, p)), p, following, onto, speed)
        if v.deflection.size > 0:
            advance_sensitivities(v, e, end, w, speed, at, dt, regime, side, step, sample)
        e, w = end, speed
        at += dt
        if at >= step.h * (1.0 - _REST):
            break
        regime, side = following, onto
        dt = (step.h - at) if over > 0.0 else dt * min(_LENGTHENED, _growth(error, allowed))
    state[DEFLECTION] = e
    state[SPEED] = w


@compiled
def _growth(error: float, allowed: float) -> float:
    """Return the factor on the length of a piece that brings its error, of fifth order, to the allowed one."""
    return 0.9 * math.pow(allowed / max(error, 1e-9 * allowed), 0.2)


@compiled
def size_of(step: TimeStep) -> float:
    """Return T0 + C |u|, the scale of the force in a step [N], which holds where the force passes through zero too."""
    return step.p1[T0] + step.p1[C] * max(abs(step.u0), abs(step.u1))


@compiled
def _distance_beyond(e: float, p: Row, regime: int, side: float, way: int) -> float:
    """Compute the distance of the force beyond the edge that is searched for [N], negative before it.

    In SMOOTH, which has two edges, that in the direction `way` alone: a piece may start on the other one.
    """
    if regime == STICK:
        return regimes.over_yield(e, p, side)
    if regime == SMOOTH:
        above_yield = regimes.over_yield(e, p, side)
        return above_yield + breakaway(p, side) - relief(p, side) if way > 0 else -above_yield
    return regimes.beyond(e, p, regime, side)[0]


@compiled
def _crossing(
    e: float, w: float, at: float, dt: float, over: float, way: int, regime: int, side: float, step: TimeStep
) -> float:
    """Find the length of the piece up to the edge of its regime by Newton's method in a bracket, then bisection."""
    size = abs(spring_force(e, step.p0)) + size_of(step)
    if regime == STICK:
        end, _, _ = regimes.piece(e, w, at, dt, regime, side, step)
        side = math.copysign(1.0, end)
    low, high, below, above = 0.0, dt, min(_distance_beyond(e, row_in(step, at), regime, side, way), 0.0), over
    if regime == STICK and below > -_ON_EDGE * size:  # it starts on this edge: search for its return
        low = _OFF_EDGE * dt
        end, _, _ = regimes.piece(e, w, at, low, regime, side, step)
        below = _distance_beyond(end, row_in(step, at + low), regime, side, way)
        if below >= 0.0:
            return _SHORTEST_PIECE * dt
    time = (low * above - high * below) / (above - below)
    for i in range(_BRACKET_STEPS):
        if i > _NEWTON_STEPS or not low < time < high:
            time = 0.5 * (low + high)
        end, speed, _ = regimes.piece(e, w, at, time, regime, side, step)
        p = row_in(step, at + time)
        residual = _distance_beyond(end, p, regime, side, way)
        if abs(residual) <= _ON_EDGE * size or high - low <= 1e-15 * step.h:
            return time
        if residual > 0.0:
            high = time
        else:
            low = time
        lengthening = side * extension_speed(step, at + time) - speed
        time -= residual / (way * p[K] * stroke_slope(end, side, p) * lengthening)  # as if the parameters were constant
    return high


# --- Derivatives of the path by parameters, advanced piece by piece ---
#
# Equation: d(de)/dt = -(dW/de) de - (dW/dp) dp,  W = side w(|F|),  F = k s(e)
# Source: Hairer, Norsett and Wanner 1993, Solving Ordinary Differential Equations I, section I.14: the variational
# equation of de/dt = u(t) - W
#
# W is continuous where a piece ends on the edge of its regime, so the moment of that adds nothing. The derivative of W
# by p follows from the explicit flow curve f, w_p = (|F|_p - f_p)/f_w, so nothing is inverted, for any law.

_NUDGE = 1e-6
"""Change of a column for its derivatives, as a share of itself or of its derivative by a variable: half the digits of a
double."""
_SAMPLES_FOR_NUDGES = 100  # samples that show how large these derivatives are
_VANISHING = 1e-9  # of the larger slope at the ends of a piece: hardly any flow there, and no steady state


def sensitivities_to(variables: Variables, rows: Array) -> Sensitivities:
    """Return the sensitivities to variables before the first step along (n, r) or (1, r) parameter rows."""
    columns, along, _ = variables
    samples, count = along.shape[:2]
    own, some = np.abs(rows[0, columns]), along[:: max(samples // _SAMPLES_FOR_NUDGES, 1)]
    largest = np.maximum(np.max(np.abs(some), axis=(0, 1), initial=0.0), np.where(np.isfinite(own), own, 0.0))
    largest = np.where(columns == K, own, largest)  # its variable is 1/k
    nudges = _NUDGE * np.where(largest > 0.0, largest, 1.0)
    ends = np.zeros((2, 1 + count))
    place = np.full(2, np.nan)
    return Sensitivities(
        columns, nudges, np.ascontiguousarray(along), np.zeros(columns.size), np.zeros(count), ends[0], ends[1], place
    )


@inlined
def _by_variable(v: Sensitivities, variable: int, sample: int, share: float) -> float:
    """Apply the chain rule: derivative by a variable from `partial`, at a share of the way between two samples."""
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
def begin_sensitivities(v: Sensitivities, e: float, p: Row, initial_slopes: Array) -> None:
    """Start at an elastic deflection [m] from the (v,) derivatives of its force [N] by each variable."""
    if v.deflection.size > 0:
        by_deflection = _force_derivative(v, e, p)
        for j in range(v.deflection.size):
            rest = initial_slopes[j] - _by_variable(v, j, 0, 0.0)
            v.deflection[j] = rest / by_deflection if by_deflection > 0.0 else 0.0


@compiled
def fill_slopes(v: Sensitivities, e: float, p: Row, sample: int, slopes: Array) -> None:
    """Fill the (v,) derivatives of the force F = k s(e) [N] by each variable at a sample."""
    by_deflection = _force_derivative(v, e, p)
    for j in range(v.deflection.size):
        slopes[j] = by_deflection * v.deflection[j] + _by_variable(v, j, sample, 0.0)


@compiled
def _force_derivative(v: Sensitivities, e: float, p: Row) -> float:
    """Return the derivative of F = k s(e) by the deflection [N/m]; those by the columns go to `partial`."""
    side, force = math.copysign(1.0, e), spring_force(e, p)
    for c in range(v.columns.size):
        by = v.nudges[c]
        moves = K <= v.columns[c] < FLOW
        v.partial[c] = (spring_force(e, nudged(p, v.columns[c], by)) - force) / by if moves else 0.0
        if v.columns[c] == K:
            v.partial[c] *= -p[K] * p[K]  # by 1/k
    return p[K] * stroke_slope(e, side, p) if force != 0.0 else 0.0


@compiled
def _w_derivatives(
    v: Sensitivities, e: float, w: float, p: Row, regime: int, side: float, sample: int, share: float, found: Array
) -> None:
    """Fill (1 + v,) dW/de [1/s] and the derivatives of -W by each variable [m/s] at one moment."""
    if regime == STICK:
        found[:] = 0.0
        return
    pull, edge = side * p[K] * stroke_law(e, side, p), 0.0
    rise = relief_slope(p, side) if regime == RELIEF else smooth_slope(w, pull, p, side)
    found[0] = p[K] * stroke_slope(e, side, p) / rise
    if regime == RELIEF:
        edge = smooth_speed(relief(p, side), p, side, w)
    by_speed = rounded(p)
    curve = 0.0 if by_speed else _curve(w, p, edge, regime, side)
    for c in range(v.columns.size):
        q = nudged(p, v.columns[c], v.nudges[c])
        if K <= v.columns[c] < FLOW:
            change = side * q[K] * stroke_law(e, side, q) - pull
        elif by_speed:  # the curve gives the speed at a force, and no force at a speed
            shift = breakaway(q, side) - breakaway(p, side)  # below the breakaway force no speed would show it
            change = rise * (speed_at(pull + shift, q, regime, side, w) - w) - shift
        else:
            change = curve - _curve(w, q, edge, regime, side)
        v.partial[c] = -side * change / (rise * v.nudges[c])
        if v.columns[c] == K:
            v.partial[c] *= -p[K] * p[K]  # by 1/k
    for j in range(v.deflection.size):
        found[1 + j] = _by_variable(v, j, sample, share)


@inlined
def _curve(w: float, p: Row, edge: float, regime: int, side: float) -> float:
    """Compute the force [N] at a flow speed [m/s] by the law of a regime, also beyond its edge.

    Parameters
    ----------
    w : the flow speed
    p : parameter row
    edge : flow speed at which the relief valve opens, that of a row which differs by a nudge at most: a step of
        Newton's method takes it to this row's [m/s]
    regime, side : see `pzd.damper.regimes`
    """
    if regime == RELIEF:
        opens = relief(p, side)
        edge -= (smooth_force(edge, p, side) - opens) / smooth_slope(edge, opens, p, side)
        return opens + relief_slope(p, side) * (w - edge)
    return smooth_force(w, p, side)


@compiled
def advance_sensitivities(
    v: Sensitivities,
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
    """Advance the derivatives of the deflection over a piece of the path.

    Over the time tau, d tau = (dW/de) dt, the derivative tends to g = -(dW/dp) dp / (dW/de), taken as linear in tau.

    Parameters
    ----------
    v : the sensitivities; changed in place
    e, end : elastic deflection at its start and end [m]
    w, speed : flow speed there [m/s]
    at, dt : where in the step it begins, and its length [s]
    regime, side : see `pzd.damper.regimes`
    step : the step that holds it
    sample : index of the sample before that step
    """
    if v.place[0] == regime and v.place[1] == side:
        for i in range(v.first.size):
            v.first[i] = v.last[i]
    else:
        _w_derivatives(v, e, w, row_in(step, at), regime, side, sample, at / step.h, v.first)
    v.place[0], v.place[1] = regime, side
    _w_derivatives(v, end, speed, row_in(step, at + dt), regime, side, sample, (at + dt) / step.h, v.last)
    slope, slope_after = v.first[0], v.last[0]
    if slope == 0.0 and slope_after == 0.0:
        return
    z = 0.5 * (slope + slope_after) * dt
    over = relaxation(1.0, 1.0, z)
    if min(slope, slope_after) > _VANISHING * max(slope, slope_after):
        early, late = (over.by_speed - over.by_change) / slope, over.by_change / slope_after
    else:
        early, late = (over.by_speed - over.by_change) / z * dt, over.by_change / z * dt
    for j in range(v.deflection.size):
        v.deflection[j] = over.decay * v.deflection[j] + early * v.first[1 + j] + late * v.last[1 + j]
