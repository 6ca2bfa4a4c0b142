"""The damper's path along a record: step by step, each whole where it stays in one regime, else piece by piece."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pzd.compiled import compiled
from pzd.damper.kernels import row_of
from pzd.damper.moving_element import UNSOLVED, goes_straight, whole_step
from pzd.damper.path import DEFLECTION, SPEED, STATES, advance
from pzd.damper.path_sensitivities import Varied, begin, carry, fill_slopes, not_varied, varied
from pzd.damper.pieces import TimeStep
from pzd.damper.regimes import deflection_at, regime_of, speed_at, spring_force
from pzd.record import Array

_HELD = np.zeros(0)  # nothing varies, the initial force neither


def march(
    displacement: Array, velocity: Array, steps: Array, rows: Array, initial_force: float, tolerance: float
) -> Array:
    """Force of the element and its stroke and flow effects along a record.

    Parameters
    ----------
    displacement : (n,) extension [m]
    velocity : (n,) extension speed [m/s], whose change bends the displacement inside a step; (1,) for straight
    steps : (n - 1,) or (1,) sampling intervals [s]
    rows : (n, r) or (1, r) parameter rows, see `kernels.Row`, linear between samples
    initial_force : force of the oil spring at the first sample [N]
    tolerance : admissible error of a piece, as a share of the force

    Returns
    -------
    (n,) force [N]
    """
    force = np.empty(displacement.size)
    none = np.empty((force.size, 0))
    state, still = np.zeros(STATES), not_varied()
    _march(displacement, velocity, steps, rows, initial_force, _HELD, tolerance, state, force, still, none)
    return force


def march_sensitivities(
    displacement: Array,
    velocity: Array,
    steps: Array,
    rows: Array,
    initial_force: float,
    initial_slopes: Array,
    tolerance: float,
    columns: NDArray[np.int64],
    along: Array,
) -> tuple[Array, Array]:
    """The same force, and its derivatives by v variables that move c columns of the rows and the initial force.

    Parameters
    ----------
    displacement, velocity, steps, rows, initial_force : as `march`
    initial_slopes : (v,) derivatives of the initial force by each variable [N]
    tolerance : as `march`
    columns : (c,) places in the row
    along : (n, v, c) or (1, v, c) derivatives of these columns by each variable

    Returns
    -------
    (n,) force [N] and (n, v) its derivatives [N]
    """
    force, slopes = np.empty(displacement.size), np.empty((displacement.size, along.shape[1]))
    v = varied(rows, columns, along)
    state = np.zeros(STATES)
    _march(displacement, velocity, steps, rows, initial_force, initial_slopes, tolerance, state, force, v, slopes)
    return force, slopes


def deflections(force: Array, rows: Array) -> Array:
    """(n,) elastic deflection [m] at which the oil spring carries (n,) forces [N], by (n, r) or (1, r) rows."""
    found = np.empty(force.size)
    _fill_deflections(force, rows, found)
    return found


@compiled
def _fill_deflections(force: Array, rows: Array, found: Array) -> None:
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
    v: Varied,
    slopes: Array,
) -> None:
    """Fill the force and, where something varies, the slopes."""
    p0 = row_of(rows[0])
    p1 = p0
    state[DEFLECTION] = deflection_at(initial_force, p0)
    force[0] = spring_force(state[DEFLECTION], p0)
    begin(v, state[DEFLECTION], p0, initial_slopes)
    if v.carried.size > 0:
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
        end, speed = whole_step(state[DEFLECTION], step, tolerance) if goes_straight(p0, p1) else UNSOLVED
        if math.isnan(end):
            advance(state, step, tolerance, False, v, i - 1)
        else:
            if v.carried.size > 0:
                _carry_whole(v, state[DEFLECTION], end, speed, step, i - 1)
            state[DEFLECTION], state[SPEED] = end, speed
        force[i] = spring_force(state[DEFLECTION], p1)
        if v.carried.size > 0:
            fill_slopes(v, state[DEFLECTION], p1, i, slopes[i])


@compiled
def _carry_whole(v: Varied, e: float, end: float, speed: float, step: TimeStep, sample: int) -> None:
    """Bring the derivatives through a step that lies in one regime."""
    regime, side = regime_of(spring_force(e, step.p0), step.p0)
    w = speed_at(abs(spring_force(e, step.p0)), step.p0, regime, side, speed)
    carry(v, e, end, w, speed, 0.0, step.h, regime, side, step, sample)
