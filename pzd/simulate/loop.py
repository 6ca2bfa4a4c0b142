"""The ride as one compiled loop: the controller by its clock, the integration by its step, the records beside."""

from __future__ import annotations

import math

from pzd.compiled import compiled, inlined
from pzd.record import Array
from pzd.simulate.controller import set_control
from pzd.simulate.dormand_prince import STAGES
from pzd.simulate.dynamic_damper import place
from pzd.simulate.equations import motion
from pzd.simulate.prediction.predictor import Predictor
from pzd.simulate.ride_model import (
    ASKED,
    COMFORT,
    CONTACT,
    DEFLECTION,
    DISSIPATED,
    FORCE,
    IDEAL,
    RATE,
    SET,
    SIDE,
    SPRINGS,
    RideModel,
)
from pzd.simulate.sensing import Electronics
from pzd.simulate.stepper import advance, choose_side

OUTSIDE, STEPS_DONE, NEXT_PIECE = range(3)
"""Steps beyond what the rig reached, steps done, and length of the piece of a step to try next [s]."""
TALLIES = 3
A_K, LOAD_1, LOAD_2, TRAVEL, LOST = range(5)
"""What is kept of every step: acceleration at K [m/s2], what each axle takes off the road's static load [N], S + T
where the wheels have no mass, larger deflection of the two suspensions [m], energy dissipated so far [J]."""
COURSE_COLUMNS = 5
COLUMNS = 16
"""time, z, phi, a_K, and per axle deflection, rate, spring, damper and demanded force, voltage."""


@inlined
def beyond_reach(model: RideModel, control: Array, workspace: Array) -> bool:
    """Whether a damper moves faster than the rig did at its voltage; `ideal` has none, so at the best one."""
    grid, car = model.grid, model.car
    last = grid.reach.size - 1
    for i in range(2):
        n, share = place(grid.voltages, control[SET, i])
        reach = grid.reach[n] + share * (grid.reach[min(n + 1, last)] - grid.reach[n])
        if model.control_spec.fidelity == IDEAL:
            for n in range(last + 1):
                reach = max(reach, grid.reach[n])
        if abs(car.ratio[i] * workspace[RATE, i]) > reach * (1.0 + 1e-9):
            return True
    return False


@inlined
def _note(time: float, y: Array, model: RideModel, control: Array, workspace: Array, row: Array) -> None:
    """Fill one row of the history."""
    row[0], row[1], row[2], row[3] = time, y[0], y[1], workspace[COMFORT, 0]
    for i in range(2):
        row[4 + 6 * i] = workspace[DEFLECTION, i]
        row[5 + 6 * i] = workspace[RATE, i]
        row[6 + 6 * i] = workspace[SPRINGS, i]
        row[7 + 6 * i] = workspace[FORCE, i]
        row[8 + 6 * i] = workspace[FORCE, i] if model.control_spec.fidelity == IDEAL else control[ASKED, i]
        row[9 + 6 * i] = control[SET, i]


@inlined
def _keep(y: Array, workspace: Array, row: Array) -> None:
    """Fill one row of the course."""
    row[A_K], row[LOST] = workspace[COMFORT, 0], y[DISSIPATED]
    for i in range(2):
        row[LOAD_1 + i] = -workspace[CONTACT, i]
    row[TRAVEL] = max(abs(workspace[DEFLECTION, 0]), abs(workspace[DEFLECTION, 1]))


@compiled
def ride(
    y: Array,
    model: RideModel,
    plan: Predictor | None,
    electronics: Electronics | None,
    control: Array,
    workspace: Array,
    first: int,
    last: int,
    steps: int,
    h: float,
    tolerance: float,
    per_control: int,
    per_output: int,
    course: Array,
    history: Array,
    tally: Array,
    stages: Array,
    end: Array,
) -> None:
    """Ride on, from one step to another; from step 0 on at rest.

    Parameters
    ----------
    y : (n,) state; changed in place
    model : see `ride_model`
    plan, electronics : see `set_control`; the noise of as many acts as are due
    control, workspace : see `ride_model`
    first, last : steps to be kept, the last one not
    steps, h : number and length of the steps of integration in the whole ride [s]
    tolerance : see `advance`
    per_control, per_output : steps between two acts of the controller, and between two rows of the history
    course : (last - first, COURSE_COLUMNS) what is kept of these steps, filled
    history : (m, COLUMNS) a row for each of these steps that is a multiple of `per_output`, filled
    tally : (TALLIES,) filled; fewer steps are done where the table ends
    stages, end : room to work in, see `advance`
    """
    scratch = stages[STAGES]
    if first == 0:
        tally[NEXT_PIECE] = h
        _start(y, model, control, workspace, scratch)
    dt, noted = tally[NEXT_PIECE], 0
    for n in range(first, last):
        time = n * h
        if n % per_control == 0:
            set_control(time, y, model, plan, electronics, control, workspace, scratch)
        motion(time, y, model, control, workspace, stages[0])
        _keep(y, workspace, course[n - first])
        tally[STEPS_DONE] = n
        if math.isnan(workspace[COMFORT, 0]):
            return
        if beyond_reach(model, control, workspace):
            tally[OUTSIDE] += 1.0
        if n % per_output == 0:
            _note(time, y, model, control, workspace, history[noted])
            noted += 1
        if n < steps:
            dt = advance(time, h, y, model, control, workspace, tolerance, min(dt, h), stages, end)
    tally[NEXT_PIECE] = dt


@inlined
def _start(y: Array, model: RideModel, control: Array, workspace: Array, scratch: Array) -> None:
    """Find to which side each axle sets off, or that it sticks."""
    motion(0.0, y, model, control, workspace, scratch)
    for i in range(2):
        control[SIDE, i] = 1.0 if workspace[RATE, i] >= 0.0 else -1.0
        if model.control_spec.jumps and workspace[RATE, i] == 0.0:
            choose_side(i, 0.0, y, model, control, workspace, scratch)
