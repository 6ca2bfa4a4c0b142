"""One step of integration: Dormand and Prince 5(4) with its own error control, cut where an axle sticks or slips.

The right-hand side is continuous but for the crossing of V = 0 where a dry friction turns round:
there the step is cut at the crossing, and the axle goes on slipping or sticks. Everywhere else the
embedded error halves the step as often as the tolerance asks.
"""

from __future__ import annotations

import math

import numpy as np

from pzd.compiled import compiled, inlined
from pzd.record import Array
from pzd.simulate.dormand_prince import ERROR_WEIGHTS, STAGE_WEIGHTS, STAGES, TIMES
from pzd.simulate.equations import motion, remember_step
from pzd.simulate.ride_model import (
    COMPRESSION_PUSH,
    DYNAMIC,
    HEAVE_RATE,
    PITCH_RATE,
    RATE,
    REBOUND_PUSH,
    SIDE,
    WHEEL_RATE_1,
    RideModel,
)

SCALES = np.array([1e-2, 1e-2, 1e-1, 1e-1, 1e-3, 1e-3, 10.0, 10.0, 10.0, 10.0, 1e-2, 1e-2, 1e-1, 1e-1, 10.0])
"""A motion of ordinary size, below which the error is absolute: m, rad, m/s, rad/s, m, J; wheels: m, m/s, J."""

_CROSSED = 1e-9  # m/s on the other side of zero
_SMALLEST = 1e-6  # of the step: what is taken whatever the error
_SHARP = 1e-13  # of the step: how closely the moment is found at which an axle turns round or sticks
_MOST_CUTS = 50


@inlined
def trial(
    time: float, dt: float, y: Array, model: RideModel, control: Array, workspace: Array, stages: Array, end: Array
) -> float:
    """Fill `end` with the state after dt; the workspace is left as it is there.

    Source: Dormand and Prince 1980, J. Comput. Appl. Math. 6(1), table 2

    Parameters
    ----------
    time, dt : [s]
    y : (n,) state
    model, control, workspace : see `ride_model`
    stages : (STAGES, n) room to work in
    end : (n,) filled

    Returns
    -------
    largest embedded error, as a share of |y| + `SCALES`
    """
    for i in range(STAGES):
        for n in range(y.size):
            change = 0.0
            for j in range(i):
                change += STAGE_WEIGHTS[i, j] * stages[j, n]
            end[n] = y[n] + dt * change
        motion(time + TIMES[i] * dt, end, model, control, workspace, stages[i])
    worst = 0.0
    for n in range(y.size):
        error = 0.0
        for i in range(STAGES):
            error += ERROR_WEIGHTS[i] * stages[i, n]
        worst = max(worst, abs(dt * error) / (SCALES[n] + abs(y[n])))
    return worst


@compiled
def choose_side(
    axle: int, time: float, y: Array, model: RideModel, control: Array, workspace: Array, dy: Array
) -> None:
    """Stop the suspension of an axle that is at V = 0, and let it slip to whichever side its forces push it."""
    car = model.car
    impulse = workspace[RATE, axle] / car.mobility[axle]
    y[HEAVE_RATE] -= impulse / car.mass
    y[PITCH_RATE] -= impulse * car.arms[axle] / car.inertia
    if car.wheels:
        y[WHEEL_RATE_1 + axle] += impulse / car.unsprung[axle]
    control[SIDE, axle] = 0.0
    motion(time, y, model, control, workspace, dy)
    if workspace[REBOUND_PUSH, axle] > 0.0:
        control[SIDE, axle] = 1.0
    elif workspace[COMPRESSION_PUSH, axle] > 0.0:
        control[SIDE, axle] = -1.0


@inlined
def leaver(control: Array, workspace: Array) -> int:
    """The first axle that has left its side of V = 0 or its stick, by the workspace as it is; -1 where none has."""
    for i in range(2):
        side = control[SIDE, i]
        if side == 0.0 and max(workspace[REBOUND_PUSH, i], workspace[COMPRESSION_PUSH, i]) > 0.0:
            return i
        if side * workspace[RATE, i] < -_CROSSED:
            return i
    return -1


@compiled
def advance(
    time: float,
    h: float,
    y: Array,
    model: RideModel,
    control: Array,
    workspace: Array,
    tolerance: float,
    first: float,
    stages: Array,
    end: Array,
) -> float:
    """Carry the state through one step of integration.

    Parameters
    ----------
    time, h : start and length of the step [s]
    y : (n,) state; changed in place
    model, control, workspace : see `ride_model`
    tolerance : largest local error as a share of the motion; infinite for a fixed step
    first : length of the first piece to try [s]
    stages, end : room to work in, (STAGES + 1, n) and (n,)

    Returns
    -------
    length of the piece to try next [s]
    """
    done, dt, cuts = 0.0, first, 0
    shortest, longest = 0.0, math.inf
    while done < h * (1.0 - 1e-12):
        dt = min(dt, h - done)
        worst = trial(time + done, dt, y, model, control, workspace, stages, end)
        growth = 0.9 * (tolerance / max(worst, 1e-3 * tolerance)) ** 0.2 if tolerance < math.inf else 5.0
        if worst > tolerance and dt > _SMALLEST * h and longest == math.inf:
            dt *= max(growth, 0.1)
            continue
        axle = leaver(control, workspace) if model.control_spec.jumps and cuts < _MOST_CUTS else -1
        if axle >= 0:
            longest = dt
        elif longest < math.inf:
            shortest = dt
        if longest - shortest > _SHARP * h and longest < math.inf:
            dt = 0.5 * (shortest + longest)
            continue
        if longest < math.inf and axle < 0:
            dt = longest
            continue
        for n in range(y.size):
            y[n] = end[n]
        done += dt
        if model.damper.slips and model.control_spec.fidelity == DYNAMIC:
            remember_step(time + done, model, control, workspace)
        dt *= min(growth, 5.0)
        if axle >= 0:
            cuts += 1
            shortest, longest, dt = 0.0, math.inf, h - done
            choose_side(axle, time + done, y, model, control, workspace, stages[STAGES])
    return dt
