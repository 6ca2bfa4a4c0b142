"""The damper's path through one step: stick, slip and relief, with everything moving.

State is the elastic deflection e = x - y (paper, eq. 1), so a stiffness that moves with the
voltage moves the force and nothing else. Over a step the speed u = dx/dt and the parameter row
go linearly:

    de/dt = u(t) - side w(|F|),   F = k(t) dead_zone(e),   side = sign(F)

A regime is where the flow has one smooth law. Straight pieces with standing parameters are
solved in closed form. The others are integrated by Dormand and Prince's pair of order 5(4) in the
viscous force s = visc(w), in which w(s) and F(s) are both explicit and dF/ds >= 1, so that nothing
is inverted. Where a piece leaves its regime, the moment is found by bracketing and the piece is cut.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pzd.damper.compiled import compiled
from pzd.damper.flow import (
    C_R,
    DELTA,
    K,
    N,
    Q,
    T0,
    W_S,
    Row,
    breakaway,
    relief,
    smooth_force,
    smooth_force_of,
    smooth_rise,
    smooth_speed,
    spring_extension,
    viscous_force,
    viscous_speed,
)

Array = NDArray[np.float64]

STICK, SMOOTH, RELIEF = 0, 1, 2
"""The regimes: nothing flows; it flows along the smooth curve; the relief valve is open."""

DEFLECTION, SPEED, DISSIPATED, VALVE_WORK = range(4)
"""The state: e [m], the last flow speed w [m/s], and the energies so far [J]."""
STATES = 4
STAGES = 7

# Dormand and Prince 1980, J. Comput. Appl. Math. 6(1), table 2: nodes, stages, and error weights.
_NODES = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
_STAGES = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0],
        [3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0],
        [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0],
        [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
_ERROR = np.array([-71 / 57600, 0.0, 71 / 16695, -71 / 1920, 17253 / 339200, -22 / 525, 1 / 40])

_MOST_PIECES = 10000
_MOST_BRACKETS = 60
_ON_EDGE = 1e-13  # of the force
_SAME_FORCE = 1e-11  # relative; a saved flow speed that gives the force within this is kept
_DIFFERENCE = 1e-3  # of a step, for the drift of the flow curve with moving parameters


@compiled
def _mix(a: float, b: float, share: float) -> float:
    return a if a == b else a + (b - a) * share  # equal infinities stand


@compiled
def interpolate(p: Row, q: Row, t: float) -> Row:
    """The parameter row at a share t of the way from p to q."""
    return (
        _mix(p[0], q[0], t),
        _mix(p[1], q[1], t),
        _mix(p[2], q[2], t),
        _mix(p[3], q[3], t),
        _mix(p[4], q[4], t),
        _mix(p[5], q[5], t),
        _mix(p[6], q[6], t),
        _mix(p[7], q[7], t),
        _mix(p[8], q[8], t),
        _mix(p[9], q[9], t),
    )


@compiled
def row_of(a: Array) -> Row:
    """A (10,) array as a parameter row."""
    return (a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8], a[9])


@compiled
def spring_force(e: float, p: Row) -> float:
    """Force of the oil spring [N] at an elastic deflection [m]; eq. (1) behind the lash."""
    return p[K] * spring_extension(e, p[DELTA])


@compiled
def deflection_at(force: float, p: Row) -> float:
    """Elastic deflection [m] at which the oil spring carries `force` [N], the nearest to zero."""
    return force / p[K] + (0.0 if force == 0.0 else math.copysign(0.5 * p[DELTA], force))


@compiled
def _regime(force: float, p: Row) -> tuple[int, float]:
    side = 1.0 if force >= 0.0 else -1.0
    if abs(force) <= breakaway(p, side):
        return STICK, side
    return (RELIEF if abs(force) > relief(p, side) else SMOOTH), side


@compiled
def _beyond(e: float, p: Row, regime: int, side: float) -> tuple[float, int]:
    """How far the state lies outside its regime, as a force [N], and past which edge: -1 low, 1 high.

    Negative inside; inside the lash the force counts on below zero, so that its edges are seen.
    """
    if regime == STICK:
        return p[K] * (abs(e) - 0.5 * p[DELTA]) - breakaway(p, math.copysign(1.0, e)), 1
    force = p[K] * (side * e - 0.5 * p[DELTA])
    if regime == RELIEF:
        return relief(p, side) - force, -1
    below, above = breakaway(p, side) - force, force - relief(p, side)
    return (below, -1) if below > above else (above, 1)


@compiled
def _edge(e: float, p: Row, regime: int, side: float, way: int) -> tuple[float, int, float]:
    """The deflection on the edge that is crossed, and the regime and side beyond it."""
    if regime == STICK:
        side = math.copysign(1.0, e)
    low, high = breakaway(p, side), relief(p, side)
    edge = high if (regime == RELIEF or (regime == SMOOTH and way > 0)) else low
    onto = side * (0.5 * p[DELTA] + edge / p[K])
    if way > 0:
        return onto, (SMOOTH if regime == STICK and high > low else RELIEF), side
    if regime == RELIEF and high > low:
        return onto, SMOOTH, side
    if low <= 0.0 and p[DELTA] <= 0.0:
        return 0.0, (SMOOTH if relief(p, -side) > 0.0 else RELIEF), -side
    return onto, STICK, side


@compiled
def _speed(force: float, p: Row, regime: int, side: float, guess: float) -> float:
    """Flow speed [m/s] of a regime's own law at |F| = force."""
    if regime == STICK:
        return 0.0
    if regime == RELIEF:
        edge = relief(p, side)
        return smooth_speed(edge, p, side, guess) + (force - edge) / p[C_R]
    return smooth_speed(force, p, side, guess)


@compiled
def _straight(force: float, k: float, slope: float, approach: float, bend: float, dt: float) -> float:
    """|F| after dt on a straight piece of the flow curve.

    Equation: d|F|/dt = approach + k bend t - (k/slope) (|F| - |F|_0), closed form
    """
    z = -k / slope * dt
    if z > -1e-3:
        second = 0.5 + z * (1.0 / 6.0 + z * (1.0 / 24.0 + z / 120.0))
        first = 1.0 + z * second
    else:
        first = math.expm1(z) / z
        second = (first - 1.0) / z
    return force + dt * (first * approach + dt * second * k * bend)


@compiled
def _rate(y: float, pull: float, p: Row, regime: int, side: float) -> float:
    """Rate of the integrated variable with standing parameters: of s in SMOOTH, of |F| in RELIEF."""
    if regime == RELIEF:
        return p[K] * (pull - _speed(y, p, regime, side, 0.0))
    s = max(y, 0.0)
    w = viscous_speed(s, p, side)
    return p[K] * (pull - w) / smooth_rise(s, w, p, side)


@compiled
def _rate_moving(y: float, pull: float, share: float, h: float, p0: Row, p1: Row, regime: int, side: float) -> float:
    """The same while the parameters move: k(t) pulls on e, and the flow curve itself drifts."""
    p = interpolate(p0, p1, share)
    softening = (p1[K] - p0[K]) / (h * p[K])
    if regime == RELIEF:
        return p[K] * (pull - _speed(y, p, regime, side, 0.0)) + softening * y
    s = max(y, 0.0)
    w = viscous_speed(s, p, side)
    ahead = smooth_force_of(s, interpolate(p0, p1, share + _DIFFERENCE), side)
    behind = smooth_force_of(s, interpolate(p0, p1, share - _DIFFERENCE), side)
    drift = (ahead - behind) / (2.0 * _DIFFERENCE * h) - softening * smooth_force_of(s, p, side)
    return (p[K] * (pull - w) - drift) / smooth_rise(s, w, p, side)


@compiled
def _runge_kutta(
    y: float,
    at: float,
    dt: float,
    h: float,
    u0: float,
    u1: float,
    regime: int,
    side: float,
    p0: Row,
    p1: Row,
    moving: bool,
    stages: Array,
) -> tuple[float, float]:
    """The integrated variable after dt, and its embedded error."""
    end, error = y, 0.0
    for i in range(STAGES):
        change = 0.0
        for j in range(i):
            change += _STAGES[i, j] * stages[j]
        end = y + dt * change
        share = (at + _NODES[i] * dt) / h
        pull = side * (u0 + (u1 - u0) * share)
        if moving:
            stages[i] = _rate_moving(end, pull, share, h, p0, p1, regime, side)
        else:
            stages[i] = _rate(end, pull, p0, regime, side)
        error += _ERROR[i] * stages[i]
    return end, dt * error


@compiled
def _piece(
    e: float,
    w: float,
    at: float,
    dt: float,
    h: float,
    u0: float,
    u1: float,
    regime: int,
    side: float,
    p0: Row,
    p1: Row,
    moving: bool,
    stages: Array,
) -> tuple[float, float, float]:
    """Elastic deflection and flow speed after a piece of length dt, and its embedded error as a force [N]."""
    if regime == STICK:
        return e + dt * (u0 + (u1 - u0) * (at + 0.5 * dt) / h), 0.0, 0.0
    p = interpolate(p0, p1, at / h) if moving else p0
    force = abs(spring_force(e, p))
    if not moving and (regime == RELIEF or (p[Q] == 0.0 and p[N] == 1.0 and p[W_S] <= 0.0)):
        slope = p[C_R] if regime == RELIEF else viscous_force(1.0, p, side)
        pull = side * (u0 + (u1 - u0) * at / h)
        end = _straight(force, p[K], slope, p[K] * (pull - w), side * (u1 - u0) / h, dt)
        return side * (end / p[K] + 0.5 * p[DELTA]), w + (end - force) / slope, 0.0
    y = force if regime == RELIEF else viscous_force(w, p, side)
    y, error = _runge_kutta(y, at, dt, h, u0, u1, regime, side, p0, p1, moving, stages)
    p = interpolate(p0, p1, (at + dt) / h) if moving else p0
    if regime == RELIEF:
        return side * (y / p[K] + 0.5 * p[DELTA]), _speed(y, p, regime, side, w), abs(error)
    if y < 0.0:
        return side * (0.5 * p[DELTA] + (breakaway(p, side) + y) / p[K]), 0.0, abs(error)
    w = viscous_speed(y, p, side)
    error *= smooth_rise(y, w, p, side)
    return side * (smooth_force_of(y, p, side) / p[K] + 0.5 * p[DELTA]), w, abs(error)


@compiled
def _outside(
    e: float, at: float, dt: float, h: float, regime: int, side: float, p0: Row, p1: Row, moving: bool
) -> tuple[float, int]:
    """`_beyond` at the end of a trial piece."""
    return _beyond(e, interpolate(p0, p1, (at + dt) / h) if moving else p0, regime, side)


@compiled
def _crossing(
    e: float,
    w: float,
    at: float,
    dt: float,
    start: float,
    over: float,
    h: float,
    u0: float,
    u1: float,
    regime: int,
    side: float,
    p0: Row,
    p1: Row,
    moving: bool,
    stages: Array,
) -> float:
    """Length of the piece that ends on the edge of its regime: Illinois' false position on `_beyond`."""
    low, high, below, above = 0.0, dt, min(start, 0.0), over
    for i in range(_MOST_BRACKETS):
        middle = (low * above - high * below) / (above - below)
        if i > 12 or not low < middle < high:
            middle = 0.5 * (low + high)
        end, _, _ = _piece(e, w, at, middle, h, u0, u1, regime, side, p0, p1, moving, stages)
        miss, _ = _outside(end, at, middle, h, regime, side, p0, p1, moving)
        if abs(miss) <= _ON_EDGE * (abs(spring_force(end, p0)) + p0[T0]) or high - low <= 1e-15 * h:
            return middle
        if miss > 0.0:
            high, above = middle, miss
            below *= 0.5
        else:
            low, below = middle, miss
            above *= 0.5
    return high


@compiled
def advance(
    state: Array,
    p0: Row,
    p1: Row,
    moving: bool,
    h: float,
    u0: float,
    u1: float,
    tolerance: float,
    stages: Array,
    booked: bool,
) -> None:
    """Carry the state through one step of length h [s], the extension speed going from u0 to u1 [m/s].

    Parameters
    ----------
    state : (4,) elastic deflection, flow speed, dissipated energy, work of the valve; changed in place
    p0, p1 : parameter rows at the start and the end of the step
    moving : whether the two rows differ
    h : length of the step [s]
    u0, u1 : extension speed at its two ends [m/s]
    tolerance : admissible error of a piece, as a share of the force
    stages : (STAGES,) to work in
    booked : whether the energies are booked, which doubles the work
    """
    e, w, at, dt = state[DEFLECTION], state[SPEED], 0.0, h
    force = abs(spring_force(e, p0))
    regime, side = _regime(spring_force(e, p0), p0)
    if regime != SMOOTH or abs(smooth_force(w, p0, side) - force) > _SAME_FORCE * force:
        w = _speed(force, p0, regime, side, w)
    for _ in range(_MOST_PIECES):
        dt = min(dt, h - at)
        end, speed, error = _piece(e, w, at, dt, h, u0, u1, regime, side, p0, p1, moving, stages)
        allowed = tolerance * (abs(spring_force(e, p1)) + p1[T0])
        if error > allowed and dt > 1e-7 * h:
            dt *= max(0.2, 0.9 * (allowed / error) ** 0.2)
            continue
        over, way = _outside(end, at, dt, h, regime, side, p0, p1, moving)
        following, beyond = regime, side
        if over > 0.0:
            start, _ = _outside(e, at, 0.0, h, regime, side, p0, p1, moving)
            dt = _crossing(e, w, at, dt, start, over, h, u0, u1, regime, side, p0, p1, moving, stages)
            end, speed, error = _piece(e, w, at, dt, h, u0, u1, regime, side, p0, p1, moving, stages)
            p = interpolate(p0, p1, (at + dt) / h) if moving else p0
            end, following, beyond = _edge(end, p, regime, side, way)
            speed = _speed(abs(spring_force(end, p)), p, following, beyond, speed)
        if booked:
            _book(state, e, end, w, speed, at, dt, h, u0, u1, regime, side, p0, p1, moving, stages)
        e, w = end, speed
        at += dt
        if at >= h * (1.0 - 1e-14):
            break
        regime, side = following, beyond
        dt = (h - at) if over > 0.0 else 4.0 * dt
    state[DEFLECTION] = e
    state[SPEED] = w


@compiled
def _book(
    state: Array,
    e0: float,
    e1: float,
    w0: float,
    w1: float,
    at: float,
    dt: float,
    h: float,
    u0: float,
    u1: float,
    regime: int,
    side: float,
    p0: Row,
    p1: Row,
    moving: bool,
    stages: Array,
) -> None:
    """Book the energies of a piece by Simpson's rule, its middle computed like its end."""
    em, wm, _ = _piece(e0, w0, at, 0.5 * dt, h, u0, u1, regime, side, p0, p1, moving, stages)
    first, last = interpolate(p0, p1, at / h), interpolate(p0, p1, (at + dt) / h)
    middle = interpolate(first, last, 0.5)
    if regime != STICK:
        start, half, end = abs(spring_force(e0, first)), abs(spring_force(em, middle)), abs(spring_force(e1, last))
        state[DISSIPATED] += dt / 6.0 * (start * w0 + 4.0 * half * wm + end * w1)
    if moving:
        s0, s1 = spring_extension(e0, first[DELTA]), spring_extension(e1, last[DELTA])
        sm = spring_extension(em, middle[DELTA])
        state[VALVE_WORK] += (last[K] - first[K]) / 12.0 * (s0 * s0 + 4.0 * sm * sm + s1 * s1)


@compiled
def march(
    displacement: Array, velocity: Array, steps: Array, rows: Array, initial_force: float, tolerance: float
) -> Array:
    """Force of the element and its stroke and flow effects along a record.

    Parameters
    ----------
    displacement : (n,) extension [m]
    velocity : (n,) extension speed [m/s], whose change bends the displacement inside a step; (1,) for straight
    steps : (n - 1,) or (1,) sampling intervals [s]
    rows : (n, 10) or (1, 10) parameter rows, linear between samples
    initial_force : force of the oil spring at the first sample [N]
    tolerance : admissible error of a piece, as a share of the force

    Returns
    -------
    (n,) force [N]
    """
    state, stages = np.zeros(STATES), np.empty(STAGES)
    force = np.empty(displacement.size)
    p0 = row_of(rows[0])
    p1 = p0
    state[DEFLECTION] = deflection_at(initial_force, p0)
    force[0] = spring_force(state[DEFLECTION], p0)
    moving = False
    for i in range(1, displacement.size):
        if rows.shape[0] > 1:
            p0, p1 = p1, row_of(rows[i])
            moving = p0 != p1
        h = steps[min(i - 1, steps.size - 1)]
        mean = (displacement[i] - displacement[i - 1]) / h
        half = 0.5 * (velocity[i] - velocity[i - 1]) if velocity.size > 1 else 0.0
        advance(state, p0, p1, moving, h, mean - half, mean + half, tolerance, stages, False)
        force[i] = spring_force(state[DEFLECTION], p1)
    return force


@compiled
def row_at(voltages: Array, rows: Array, voltage: float) -> Row:
    """The parameter row at a voltage felt, linear between the (m,) nodes, held beyond them."""
    last = voltages.size - 1
    if last == 0 or voltage <= voltages[0]:
        return row_of(rows[0])
    if voltage >= voltages[last]:
        return row_of(rows[last])
    i = np.searchsorted(voltages, voltage, side="right") - 1
    share = (voltage - voltages[i]) / (voltages[i + 1] - voltages[i])
    return interpolate(row_of(rows[i]), row_of(rows[i + 1]), share)
