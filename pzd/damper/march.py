"""The damper's path along a sampled motion: each step whole where it stays in one regime, else piece by piece."""

from __future__ import annotations

import math

import numpy as np

from pzd.compiled import compiled, inlined
from pzd.damper.compiled.kernels import K, Row, effects_alike, row_of, stroke_straight
from pzd.damper.element import Element, relaxation, slip
from pzd.damper.flow import breakaway, damping, straight
from pzd.damper.path import (
    DEFLECTION,
    NO_VARIABLES,
    SPEED,
    STATES,
    Sensitivities,
    Variables,
    advance,
    advance_sensitivities,
    begin_sensitivities,
    fill_slopes,
    sensitivities_to,
)
from pzd.damper.regimes import (
    RELIEF,
    SMOOTH,
    STICK,
    TimeStep,
    deflection_at,
    deflection_on,
    phi,
    regime_of,
    speed_at,
    spring_force,
)
from pzd.record import Array

# --- A whole step in one regime, with a straight flow curve and T0, C and k that vary ---
#
# Equation: ds/dt = u + side T0/C - (k/C) s,  F = k s      Source: Makowski and Knap 2021, eq. (1)-(3), y eliminated
#
# With the time tau, d tau = (k/C) dt, this is ds/dtau = g - s, where g = (u C + side T0)/k is the extension of the oil
# stiffness at which the flow is as fast as the rod. Over a step g is nearly a polynomial in tau, and with a polynomial
# the integral is a sum of the functions phi_k of an exponential integrator, however large k/C is.

NODES = (1.0 / 3.0, 2.0 / 3.0)
"""Shares of a step at which g and k/C are evaluated besides its ends, for a cubic through four values."""
UNSOLVED = (math.nan, math.nan)
"""Result of a step that has to be solved piece by piece."""


@compiled
def whole_step(e: float, step: TimeStep, tolerance: float) -> tuple[float, float]:
    """Compute elastic deflection [m] and flow speed [m/s] after a step that sticks or slips throughout.

    Parameters
    ----------
    e : elastic deflection at its start [m]
    step : between rows for which `is_straight` is true
    tolerance : admissible error, as a share of the force

    Returns
    -------
    both; NaN where the regime changes, the rod reverses, or g is not close enough to a polynomial
    """
    if step.u0 * step.u1 < 0.0:
        return UNSOLVED
    p, q = step.p0, step.p1
    force = spring_force(e, p)
    regime, side = regime_of(force, p)
    if regime == STICK:
        end = e + 0.5 * (step.u0 + step.u1) * step.h
        return (end, 0.0) if regime_of(spring_force(end, q), q)[0] == STICK else UNSOLVED
    if regime == RELIEF:
        return UNSOLVED
    first = Element(side * breakaway(p, side), damping(p, side), p[K])
    if step.moving:
        last = Element(side * breakaway(q, side), damping(q, side), q[K])
        spring, error = _slipped(force / p[K], first, last, step)
        if error > tolerance * abs(force / p[K]):
            return UNSOLVED
    else:
        last = first
        spring = slip(force, first.T0, step.u0, step.u1, relaxation(step.h, first.C, first.k)) / first.k
    end = deflection_on(side * last.k * spring, q, side)
    if side * spring <= 0.0 or regime_of(last.k * spring, q)[0] != SMOOTH:
        return UNSOLVED
    return end, (last.k * spring - last.T0) * side / last.C


@compiled
def is_straight(p: Row, q: Row) -> bool:
    """Return whether the flow curve has straight branches alone, and T0, C and k alone differ between two rows."""
    return effects_alike(p, q) and stroke_straight(p) and straight(p)


@inlined
def _slipped(e: float, first: Element, last: Element, step: TimeStep) -> tuple[float, float]:
    """Compute the extension s [m] after slip over one step, and its error: the contribution of the third order.

    Parameters
    ----------
    e : at its start [m]
    first, last : elements at start and end, with the direction of flow as the sign of T0
    step : the step
    """
    start, rate = _g_and_rate(first, step.u0)
    second, rate_b = _between(first, last, step, NODES[0])
    third, rate_c = _between(first, last, step, NODES[1])
    end, rate_d = _g_and_rate(last, step.u1)
    span = step.h * (rate + 3.0 * (rate_b + rate_c) + rate_d) / 8.0
    b = step.h * (9.0 * rate + 19.0 * rate_b - 5.0 * rate_c + rate_d) / 72.0 / span
    c = step.h * (rate + 4.0 * rate_b + rate_c) / 9.0 / span
    by_b = (second - start) / b
    bend = (end - start - by_b) / (1.0 - b)
    twist = (bend - ((third - start) / c - by_b) / (c - b)) / (1.0 - c)
    over = phi(-span)
    slipped = e + span * ((start - e) * over.one + (by_b - bend * b) * over.two + 2.0 * bend * over.three)
    added = span * twist * (b * over.two - 2.0 * (1.0 + b) * over.three + 6.0 * over.four)
    return slipped + added, abs(added)


@inlined
def _g_and_rate(at: Element, u: float) -> tuple[float, float]:
    """Compute g, the extension [m] at which the flow is as fast as the rod, u [m/s], and k/C [1/s]."""
    return (u * at.C + at.T0) / at.k, at.k / at.C


@inlined
def _between(first: Element, last: Element, step: TimeStep, share: float) -> tuple[float, float]:
    """Compute g and k/C at a share of a step."""
    at = Element(
        first.T0 + (last.T0 - first.T0) * share,
        first.C + (last.C - first.C) * share,
        first.k + (last.k - first.k) * share,
    )
    return _g_and_rate(at, step.u0 + (step.u1 - step.u0) * share)


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
    v, state, initial_slopes = sensitivities_to(variables, rows), np.zeros(STATES), variables.initial_slopes
    _march(displacement, velocity, steps, rows, initial_force, initial_slopes, tolerance, state, force, v, slopes)
    return force, slopes


def deflections(force: Array, rows: Array) -> Array:
    """Compute the (n,) elastic deflections [m] of an element that carries (n,) forces [N], by (n, r) or (1, r) rows."""
    found = np.empty(force.size)
    _fill_deflections(force, rows, found)
    return found


@compiled
def _fill_deflections(force: Array, rows: Array, found: Array) -> None:
    """Fill the (n,) deflections of (n,) forces."""
    for i in range(force.size):
        found[i] = deflection_at(force[i], row_of(rows[min(i, rows.shape[0] - 1)]))


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
    state[DEFLECTION] = deflection_at(initial_force, p0)
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
        end, speed = whole_step(state[DEFLECTION], step, tolerance) if is_straight(p0, p1) else UNSOLVED
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
    regime, side = regime_of(spring_force(e, step.p0), step.p0)
    w = speed_at(abs(spring_force(e, step.p0)), step.p0, regime, side, speed)
    advance_sensitivities(v, e, end, w, speed, 0.0, step.h, regime, side, step, sample)
