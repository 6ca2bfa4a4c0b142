"""Derivatives of the damper's path by parameters, carried along it piece by piece.

Equation: d(de)/dt = -(dW/de) de - (dW/dp) dp,  W = side w(|F|),  F = k s(e)
Source: Hairer, Norsett and Wanner 1993, Solving Ordinary Differential Equations I, section I.14: the variational
equation of de/dt = u(t) - W

W is continuous where a piece ends on the edge of its regime, so the moment of that adds nothing. How W goes with p is
taken from the explicit flow curve, w_p = (|F|_p - f_p)/f_w, so nothing is inverted, and every law is served.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pzd.compiled import compiled, inlined
from pzd.damper.element import relaxation
from pzd.damper.flow import relief, relief_slope, smooth_force, smooth_slope, smooth_speed
from pzd.damper.kernels import FLOW, K, Row, nudged, stroke_law, stroke_slope
from pzd.damper.pieces import TimeStep, row_in
from pzd.damper.regimes import RELIEF, STICK, spring_force
from pzd.record import Array

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
