"""One step of integration: Dormand and Prince 5(4) with its own error control, cut where an axle sticks or slips.

The right-hand side is continuous but for the crossing of V = 0 where a dry friction turns round:
there the step is cut at the crossing, and the axle goes on slipping or sticks. Everywhere else the
embedded error shortens the step as often as the tolerance asks.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pzd.compiled import compiled, inlined
from pzd.record import Array
from pzd.simulate.ride.equations import motion, remember_step
from pzd.simulate.ride.model import DYNAMIC, STATES, Axle, Command, RunningRide, State

# --- Coefficients of the pair of order 5(4), the last stage being the first of the next step ---
#
# Source: Dormand and Prince 1980, J. Comput. Appl. Math. 6(1), table 2

STAGES = 7
"""Number of stages."""
TIMES = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
"""(STAGES,) share of the step at which each stage stands."""
STAGE_WEIGHTS = np.array(
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
"""(STAGES, STAGES - 1) what each stage takes of those before it; the last row is the step itself."""
ERROR_WEIGHTS = np.array([-71 / 57600, 0.0, 71 / 16695, -71 / 1920, 17253 / 339200, -22 / 525, 1 / 40])
"""(STAGES,) difference between the orders 5 and 4."""


# --- One step ---

SCALES = np.array([1e-2, 1e-2, 1e-1, 1e-1, 1e-3, 1e-3, 10.0, 10.0, 10.0, 10.0, 1e-2, 1e-2, 1e-1, 1e-1, 10.0])
"""A motion of ordinary size, below which the error is absolute; that of the oil always is, which flows much farther
than its stiffness is deflected: m, rad, m/s, rad/s, m, J; wheels: m, m/s, J."""

_CROSSED = 1e-9  # m/s on the other side of zero: the moment lies between this speed and twice as much
_PUSHED = 1e-6  # m/s2: an axle that sticks slips between no push and this one
_SMALLEST = 1e-6  # of the step: what is taken whatever the error
_SHARP = 1e-13  # of the step: how closely the moment is found at which an axle turns round or sticks, where it jumps
_MOST_CUTS = 50  # in a step: an axle that chatters more goes on in the pieces that the tolerance asks for
_AIM = 0.5  # of what is let pass: where the moment is looked for
_INSIDE = 1e-3  # of a bracket: no guess is closer to its ends
_HALVED = 4  # every so many guesses the bracket is halved, so that it shrinks whatever the law


class Integrator(NamedTuple):
    """Tolerance of the integration, and arrays to work in."""

    tolerance: float
    """Largest local error of a step as a share of the motion; infinite for a fixed step."""
    stages: Array
    """(STAGES + 1, n) derivatives: the first is that at the start of a step; the last is for what is not kept."""
    end: Array
    """(n,) state at the end of a step that is tried."""


def integrator_of(tolerance: float, states: int) -> Integrator:
    """Return the integrator of a state of so many numbers."""
    return Integrator(tolerance, np.zeros((STAGES + 1, states)), np.zeros(states))


@inlined
def _reach(i: int, dt: float, first: int, last: int, y: Array, integrator: Integrator) -> None:
    """Fill a part of the state at which a stage stands; no motion depends on the energies before the last one."""
    for n in range(first, last):
        change = 0.0
        for j in range(i):
            change += STAGE_WEIGHTS[i, j] * integrator.stages[j, n]
        integrator.end[n] = y[n] + dt * change


@compiled
def trial(time: float, dt: float, y: Array, ride: RunningRide, integrator: Integrator) -> float:
    """Fill the end of the integrator with the state after dt; the workspace is left as it is there.

    Source: Dormand and Prince 1980, J. Comput. Appl. Math. 6(1), table 2

    Parameters
    ----------
    time, dt : [s]
    y : (n,) state
    ride : its workspace is filled
    integrator : its first stage is the derivative at the start; the others, the last at the end, and `end` are filled

    Returns
    -------
    largest embedded error, as a share of |y| + `SCALES`, that of the oil of `SCALES` alone
    """
    model = ride.model
    for i in range(1, STAGES):
        _reach(i, dt, 0, y.size if i == STAGES - 1 else State.DISSIPATED, y, integrator)
        if model.car.wheels:
            _reach(i, dt, STATES, y.size, y, integrator)
        motion(time + TIMES[i] * dt, integrator.end, ride, integrator.stages[i])
    worst = 0.0
    for n in range(y.size):
        error = 0.0
        for i in range(STAGES):
            error += ERROR_WEIGHTS[i] * integrator.stages[i, n]
        size = SCALES[n] if State.OIL_1 <= n <= State.OIL_2 else SCALES[n] + abs(y[n])
        share = abs(dt * error) / size
        if not share < math.inf:  # a stage of too long a step overflowed
            return math.inf
        worst = max(worst, share)
    return worst


@compiled
def choose_side(axle: int, time: float, y: Array, ride: RunningRide, dy: Array) -> None:
    """Stop the suspension of an axle that is at V = 0, and let it slip to whichever side its forces push it."""
    model, control, workspace = ride
    car = model.car
    impulse = workspace[Axle.RATE, axle] / car.mobility[axle]
    y[State.HEAVE_RATE] -= impulse / car.mass
    y[State.PITCH_RATE] -= impulse * car.arms[axle] / car.inertia
    if car.wheels:
        y[State.WHEEL_RATE_1 + axle] += impulse / car.unsprung[axle]
    control[Command.SIDE, axle] = 0.0
    motion(time, y, ride, dy)
    if workspace[Axle.REBOUND_PUSH, axle] > 0.0:
        control[Command.SIDE, axle] = 1.0
    elif workspace[Axle.COMPRESSION_PUSH, axle] > 0.0:
        control[Command.SIDE, axle] = -1.0


@inlined
def beyond(control: Array, workspace: Array, axle: int) -> float:
    """Return how far an axle has left its side of V = 0 or its stick, as a share of what is let pass."""
    side = control[Command.SIDE, axle]
    if side == 0.0:
        return float(max(workspace[Axle.REBOUND_PUSH, axle], workspace[Axle.COMPRESSION_PUSH, axle]) / _PUSHED)
    return float(-side * workspace[Axle.RATE, axle] / _CROSSED - 1.0)


@compiled
def farthest(ride: RunningRide) -> float:
    """Return the larger `beyond` of both axles; -1 where the force does not jump at V = 0."""
    model, control, workspace = ride
    if not model.control_spec.jumps:
        return -1.0
    return max(beyond(control, workspace, 0), beyond(control, workspace, 1))


@inlined
def guess(number: int, shortest: float, longest: float, before: float, behind: float) -> float:
    """Guess where in a bracket the moment lies at which an axle leaves its side or its stick.

    Source: false position; Dowell and Jarratt 1971, BIT 11 (Illinois), with a halving now and then

    Parameters
    ----------
    number : of guesses before
    shortest, longest : the bracket [s]
    before, behind : `farthest` at its ends, or half of it where an end did not move
    """
    share = 0.5
    if number % _HALVED != _HALVED - 1:
        share = min(max((_AIM - before) / (max(behind, 1.0) - before), _INSIDE), 1.0 - _INSIDE)
    return shortest + share * (longest - shortest)


@compiled
def cut(
    time: float, longest: float, sharp: float, before: float, y: Array, ride: RunningRide, integrator: Integrator
) -> tuple[float, float]:
    """Cut a piece of a step right behind a moment at which an axle leaves its side or its stick.

    Parameters
    ----------
    time, longest : start and length of the piece, at the end of which they have changed [s]
    sharp : how closely the moment is found where `farthest` jumps there [s]
    before : `farthest` at the start, below 0
    y, ride, integrator : see `advance`

    Returns
    -------
    the length that is left [s], and its embedded error, see `trial`
    """
    shortest, behind, moved, number = 0.0, farthest(ride), 0, 0
    while longest - shortest > sharp:
        dt = guess(number, shortest, longest, before, behind)
        worst = trial(time, dt, y, ride, integrator)
        now = farthest(ride)
        if 0.0 < now <= 1.0:
            return dt, worst
        if now > 0.0:
            before *= 0.5 if moved > 0 else 1.0
            longest, behind, moved = dt, now, 1
        else:
            behind *= 0.5 if moved < 0 else 1.0
            shortest, before, moved = dt, min(now, -_AIM), -1
        number += 1
    return longest, trial(time, longest, y, ride, integrator)


@compiled
def advance(time: float, h: float, y: Array, ride: RunningRide, integrator: Integrator, first: float) -> float:
    """Carry the state through one step of integration.

    Parameters
    ----------
    time, h : start and length of the step [s]
    y : (n,) state; changed in place
    ride : its workspace as `motion` left it at the start
    integrator : its first stage is the derivative at the start
    first : length of the first piece to try [s]

    Returns
    -------
    length of the piece to try next [s]
    """
    model = ride.model
    done, dt, cuts = 0.0, first, 0
    tolerance, stages = integrator.tolerance, integrator.stages
    before = min(farthest(ride), -_AIM)
    while done < h * (1.0 - 1e-12):
        dt = tried = min(dt, h - done)
        worst = trial(time + done, dt, y, ride, integrator)
        if cuts < _MOST_CUTS and farthest(ride) > 0.0:
            dt, worst = cut(time + done, dt, _SHARP * h, before, y, ride, integrator)
            cuts += 1
        growth = 0.9 * (tolerance / max(worst, 1e-3 * tolerance)) ** 0.2 if tolerance < math.inf else 5.0
        if worst > tolerance and dt > _SMALLEST * h:
            dt *= max(growth, 0.1)
            continue
        for n in range(y.size):
            y[n] = integrator.end[n]
        done += dt
        if not worst < math.inf:  # the shortest piece overflowed, too: the ride is lost, see `ride_steps`
            return h
        if (model.damper.slips or model.rear_damper.slips) and model.control_spec.fidelity == DYNAMIC:
            remember_step(time + done, ride)
        turned = False
        if model.control_spec.jumps:
            turned = _choose_sides(time + done, y, ride, stages[STAGES])
            before = min(farthest(ride), -_AIM)
        if turned:
            motion(time + done, y, ride, stages[0])
        else:
            for n in range(y.size):
                stages[0, n] = stages[STAGES - 1, n]
        dt = tried if dt < tried else dt * min(growth, 5.0)
    return dt


@inlined
def _choose_sides(time: float, y: Array, ride: RunningRide, dy: Array) -> bool:
    """Let every axle that is beyond its side slip to the other one or stick, and tell whether there was one."""
    control, workspace = ride.control, ride.workspace
    turned = False
    for i in range(2):
        if beyond(control, workspace, i) > 0.0:
            choose_side(i, time, y, ride, dy)
            turned = True
    return turned
