"""The paper's Bingham element, integrated exactly for a displacement that is linear or a parabola between samples.

Equation: F = k (x - y),  C dy/dt + T0 sign(dy/dt) = F      Source: Makowski and Knap 2021, eq. (1)-(3)

Eliminating y gives dF/dt = k dx/dt - (k/C) soft(F, T0), whose right-hand side is continuous. While the rod does not
turn round, G = F sign(dx/dt) passes through slip against the motion, stick, and slip with it, in this order: `stick`
and `slip` are their closed forms, and all that there is.

The limits of the law are in it. With 1/k = 0 the damper is rigid, F = T0 sign(dx/dt) + C dx/dt, and holds any force up
to T0 at rest; with C = 0 it is elasto-plastic; with T0 = 0 a Maxwell element.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pzd.compiled import compiled, inlined
from pzd.record import Array

STIFFEST = 1e13
"""Stiffness of a rigid damper where a number is needed [N/m]: 1e8 N, more than any damper gives, bend it by 10 um."""
_STRAIGHT = np.zeros(1)  # no velocities: the displacement is linear between samples
_NO_SLOPES = np.empty((0, 3))
_SMALL_Z = 1e-3  # below it the quotients are taken from their series: (e^z - 1)/z loses digits like 1/z
_NEWTON_STEPS = 60  # bisection alone needs 53 for all digits of a double
_INSTANT = 1e-15  # of a piece: how closely the moment of sticking is found


def element_force(
    displacement: Array,
    step: Array | float,
    friction: float,
    damping: float,
    stiffness: float,
    initial_force: float = 0.0,
    velocity: Array | None = None,
    every: int = 1,
) -> Array:
    """Compute the force of the Bingham element under a sampled displacement.

    Equation: dF/dt = k dx/dt - (k/C) sign(F) max(|F| - T0, 0)      Source: eq. (1)-(3), y eliminated

    Parameters
    ----------
    displacement : (n,) extension x [m]
    step : sampling interval [s], or (n - 1,) of them
    friction : T0 >= 0 [N]
    damping : C >= 0 [N s/m]
    stiffness : k > 0 [N/m], infinite for a rigid damper
    initial_force : F at the first sample [N]
    velocity : (n,) extension speed [m/s], whose change bends the displacement to a parabola inside each step;
        None: linear between samples
    every : n to keep the force of every n-th sample alone, the first among them

    Returns
    -------
    (n,) force [N], or as many of them as are kept

    Examples
    --------
    A slow pull of 1 mm winds k up to T0, and then slips:

    >>> element_force(np.array([0.0, 0.001, 0.002]), 1.0, 300.0, 2700.0, 2e5).round(3).tolist()
    [0.0, 200.0, 302.7]
    """
    force = np.empty(displacement[::every].size)
    bend, steps = _STRAIGHT if velocity is None else velocity, np.atleast_1d(np.asarray(step, dtype=np.float64))
    _march(displacement, bend, steps, friction, damping, stiffness, initial_force, force, _NO_SLOPES, every)
    return force


def element_forces(displacement: Array, step: float, elements: Array) -> Array:
    """Compute the forces of many Bingham elements under one displacement, linear between samples, from zero force.

    Parameters
    ----------
    displacement : (n,) extension x [m]
    step : sampling interval [s]
    elements : (m, 3) T0 [N], C [N s/m] and k [N/m]

    Returns
    -------
    (m, n) force [N]
    """
    forces = np.empty((len(elements), displacement.size))
    _march_many(displacement, _STRAIGHT, np.array([step]), elements, forces, _NO_SLOPES)
    return forces


def element_force_sensitivities(
    displacement: Array,
    step: Array | float,
    friction: float,
    damping: float,
    stiffness: float,
    initial_force: float = 0.0,
    velocity: Array | None = None,
    every: int = 1,
) -> tuple[Array, Array]:
    """Compute the force of the Bingham element and its derivatives by T0, C and 1/k at a fixed initial force.

    Each piece of the closed form is differentiated at fixed duration; the field is continuous at
    |F| = T0, so the moving switching times add nothing. By the compliance 1/k the derivative is finite in a rigid
    damper too, where it is -C^2 d2x/dt2 but at the instant of a reversal.

    Parameters
    ----------
    displacement, step, friction, damping, stiffness, initial_force, velocity, every : as `element_force`

    Returns
    -------
    (n,) force [N] and (n, 3) dF/dT0 [-], dF/dC [m/s], dF/d(1/k) [N2/m], or as many of them as are kept
    """
    kept = displacement[::every].size
    force, slopes = np.empty(kept), np.empty((kept, 3))
    bend, steps = _STRAIGHT if velocity is None else velocity, np.atleast_1d(np.asarray(step, dtype=np.float64))
    _march(displacement, bend, steps, friction, damping, stiffness, initial_force, force, slopes, every)
    return force, slopes


class Element(NamedTuple):
    """T0 [N], C [N s/m] and k [N/m], infinite for a rigid damper."""

    T0: float
    C: float
    k: float


class Relaxation(NamedTuple):
    """Coefficients of the force after slip over one time step, see `slip`."""

    time: float
    """[s]"""
    decay: float
    """exp(-k time/C), the remaining share of the force [-]."""
    rise: float
    """1 - decay."""
    mean: float
    """Mean of the decay over the time, rise/|z| [-]; 0 where the force settles at once."""
    by_speed: float
    """Derivative of the force by the extension speed at the start [N s/m]."""
    by_change: float
    """Derivative of the force by the change of the extension speed [N s/m]."""


@inlined
def relaxation(time: float, C: float, k: float) -> Relaxation:
    """Compute the coefficients of the force after slip over a time step [s].

    Equation: by_speed = C (1 - e^z), by_change = C (1 - (e^z - 1)/z) at z = -k time/C; finite for k -> inf and C -> 0
    Source: Hochbruck and Ostermann 2010, Acta Numerica 19, eq. (2.10), phi_1 and phi_2 of z
    """
    z = -math.inf if C == 0.0 or math.isinf(k) else -k / C * time
    if z > -_SMALL_Z:
        second = 0.5 + z * (1.0 / 6.0 + z * (1.0 / 24.0 + z / 120.0))
        first = 1.0 + z * second
        return Relaxation(time, 1.0 + z * first, -z * first, first, k * time * first, k * time * second)
    rise = -math.expm1(z)
    first = -rise / z
    return Relaxation(time, 1.0 - rise, rise, first, C * rise, C * (1.0 - first))


@inlined
def slip(F: float, friction: float, u0: float, u1: float, over: Relaxation) -> float:
    """Compute the force [N] after slip over one time step, the extension speed going linearly from u0 to u1 [m/s].

    Equation: dF/dt = k u - (k/C) (F - friction)      Source: eq. (1)-(3), slipping; closed form

    Parameters
    ----------
    F : at the start [N]
    friction : T0 sign(F) [N]
    u0, u1 : extension speed at the start and at the end [m/s]
    over : coefficients of the time step
    """
    return over.decay * F + (over.rise * friction + over.by_speed * u0 + over.by_change * (u1 - u0))


@inlined
def stick(F: float, k: float, u0: float, u1: float, time: float) -> float:
    """Compute the force [N] after sticking over a time [s], the extension speed going linearly from u0 to u1 [m/s].

    Equation: dF/dt = k u      Source: eq. (1), dy/dt = 0
    """
    travel = 0.5 * (u0 + u1) * time
    return F if travel == 0.0 else F + k * travel  # a rigid damper at rest holds its force


@compiled
def _march(
    x: Array, v: Array, steps: Array, T0: float, C: float, k: float, F: float, force: Array, slopes: Array, every: int
) -> None:
    """Fill force and, where it is not empty, slopes: most steps lie in one regime, the others are cut.

    One in `every` samples has a row. A row of slopes is advanced in place from one of these samples to the next.
    """
    element, over = Element(T0, C, k), relaxation(steps[0], C, k)
    force[0] = F
    for column in range(3 if slopes.size else 0):
        slopes[0, column] = 0.0
    side, row, left = _side(F, T0), 0, 0
    for i in range(1, x.size):
        if left == 0:
            row, left = row + 1, every
            for column in range(3 if row < len(slopes) else 0):
                slopes[row, column] = slopes[row - 1, column]
        if row == force.size:
            break  # no sample is kept any more
        left -= 1
        h = steps[min(i - 1, steps.size - 1)]
        if h != over.time:
            over = relaxation(h, C, k)
        mean = (x[i] - x[i - 1]) / h
        half = 0.5 * (v[i] - v[i - 1]) if v.size > 1 else 0.0
        u0, u1 = mean - half, mean + half
        if side == 0.0:
            end = stick(F, k, u0, u1, h)
            whole = abs(end) <= T0 and u0 * u1 >= 0.0
        else:
            end = slip(F, side * T0, u0, u1, over)
            whole = side * end > T0 and (side * u0 >= 0.0 or side * u1 <= 0.0)
        if slopes.size and whole:
            _advance_slopes(slopes[row : row + 1], F, side, u0, u1, element, over)
        if not whole:
            end = _cut(F, u0, u1, h, element, slopes[row : row + 1])
            side = _side(end, T0)
        F = end
        force[row] = F


@compiled
def _march_many(x: Array, v: Array, steps: Array, elements: Array, forces: Array, slopes: Array) -> None:
    """Fill the forces (m, n) of elements (m, 3), each from zero; `slopes` are empty."""
    for i in range(len(elements)):
        _march(x, v, steps, elements[i, 0], elements[i, 1], elements[i, 2], 0.0, forces[i], slopes, 1)


@inlined
def _side(F: float, T0: float) -> float:
    """Return the direction of flow, +1 or -1; 0 where it sticks."""
    return 0.0 if abs(F) <= T0 else math.copysign(1.0, F)


@compiled
def _cut(F: float, u0: float, u1: float, h: float, element: Element, slopes: Array) -> float:
    """Compute the force [N] after a step with changes of regime, cut at a reversal of the rod and at each change.

    Where they are not empty, the (1, 3) slopes are advanced too.
    """
    T0, C, k = element
    bend, start = (u1 - u0) / h, 0.0
    turn = u0 / (u0 - u1) * h if u0 * u1 < 0.0 else h
    for stop in (turn, h):
        s = 1.0 if u0 + 0.5 * bend * (start + stop) >= 0.0 else -1.0
        for regime in (-1.0, 0.0, 1.0):
            G, left = s * F, stop - start
            if left <= 0.0 or (regime < 0.0 and G >= -T0) or (regime == 0.0 and G > T0):
                continue
            u, last, used, leaves = u0 + bend * start, u0 + bend * stop, left, False
            if regime < 0.0:
                leaves = s * slip(F, -s * T0, u, last, relaxation(left, C, k)) >= -T0
                used = _until_stuck(G, s * u, s * last, left, element) if leaves else left
            elif regime == 0.0:
                leaves = s * stick(F, k, u, last, left) > T0
                used = min(_until_risen((T0 - G) / k, s * u, s * bend), left) if leaves else left
            over, last = relaxation(used, C, k), u + bend * used
            if slopes.size:
                _advance_slopes(slopes, F, regime * s, u, last, element, over)
            F = stick(F, k, u, last, used) if regime == 0.0 else slip(F, regime * s * T0, u, last, over)
            if leaves:
                F = -s * T0 if regime < 0.0 else s * T0  # exactly on the edge of the next regime
            start = stop if used >= left else start + used
    return F


@compiled
def _until_stuck(G: float, u0: float, u1: float, left: float, element: Element) -> float:
    """Find the time [s] after which slip against the motion ends, G = -T0, by Newton's method within a bracket.

    Parameters
    ----------
    G : force in the direction of the motion [N], below -T0
    u0, u1 : speed of the motion at the start and after `left`, not below 0 [m/s]
    left : time in which it ends for certain [s]
    element : T0, C, k
    """
    T0, C, k = element
    if C == 0.0 or math.isinf(k):
        return 0.0
    low, high = 0.0, left
    time = min(C / k * math.log1p(max(-T0 - G, 0.0) / (C * (0.5 * (u0 + u1)))), left)
    for _ in range(_NEWTON_STEPS):
        u = u0 + (u1 - u0) * time / left
        residual = slip(G, -T0, u0, u, relaxation(time, C, k)) + T0
        if residual < 0.0:
            low = time
        else:
            high = time
        following = time - residual / (k * u - k / C * residual)
        if not low <= following <= high:
            following = 0.5 * (low + high)
        if abs(following - time) <= _INSTANT * left:
            return following
        time = following
    return time


@inlined
def _until_risen(distance: float, u: float, bend: float) -> float:
    """Solve for the time [s] in which a speed u + bend t [m/s] covers a distance [m]: the smaller root."""
    if distance <= 0.0:
        return 0.0
    return 2.0 * distance / (u + math.sqrt(max(u * u + 2.0 * bend * distance, 0.0)))


@inlined
def _advance_slopes(
    slopes: Array, F: float, side: float, u0: float, u1: float, element: Element, over: Relaxation
) -> None:
    """Advance the (3,) derivatives of the force by T0, C and the compliance s = 1/k over one piece of fixed duration.

    Equation: those of `slip` and `stick` differentiated: d(dF/ds)/dt = -(k/C) dF/ds - k^2 (u - w),
    d(dF/dC)/dt = (k/C) (w - dF/dC), w = (F - T0 side)/C; while it sticks, d(dF/ds)/dt = -k^2 u

    Parameters
    ----------
    slopes : (1, 3) changed in place
    F : force at the start [N]
    side : direction of flow; 0 where it sticks
    u0, u1 : extension speed at the start and at the end [m/s]
    element : T0, C, k
    over : coefficients of its duration
    """
    T0, C, k = element
    if over.time <= 0.0:
        return
    change = u1 - u0
    if side == 0.0:
        if not math.isinf(k):
            slopes[0, 2] -= k * stick(0.0, k, u0, u1, over.time)
        return
    decay = over.decay
    late, late_by_compliance = 0.0, 0.0
    if decay > 0.0:  # never in a limit, where C or 1/k is zero
        late = k / C * over.time * decay * (u0 - (F - side * T0) / C - C / k * change / over.time)
        late_by_compliance = C * k * late
    slopes[0, 0] = decay * slopes[0, 0] + over.rise * side
    slopes[0, 1] = decay * slopes[0, 1] + over.rise * u0 + (1.0 - 2.0 * over.mean) * change - late
    slopes[0, 2] = decay * slopes[0, 2] - late_by_compliance - C * C * over.rise * change / over.time
