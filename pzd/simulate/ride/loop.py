"""The ride as one compiled loop: the controller by its clock, the integration by its step, and the records."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pzd.compiled import compiled, inlined
from pzd.damper.compiled.kernels import keep_voltage
from pzd.force_table.lookup import table_voltage
from pzd.record import Array
from pzd.simulate.control.demand import LARGEST, bounds_of, choose_hardness, demand, farther_end, spring_acceleration
from pzd.simulate.control.prediction.choice import predict
from pzd.simulate.control.prediction.predictor import Predictor
from pzd.simulate.control.sensing import Electronics, sense, supplied
from pzd.simulate.ride.equations import motion
from pzd.simulate.ride.model import (
    IDEAL,
    MINIMISE,
    SCHEDULE,
    SWITCH,
    VOLTAGE,
    Axle,
    Command,
    ControlSpec,
    RideModel,
    RunningRide,
    State,
    damper_at,
    grid_at,
    place,
)
from pzd.simulate.ride.stepper import STAGES, Integrator, advance, choose_side

# --- The controller, once in a control period: what it asks of each axle, and the voltage that is set there ---

_SAME_PLACE = 1e-9
"""Of an interval of a schedule: the clock meets its beginning but for rounding."""


@inlined
def _acts_at_once(control_spec: ControlSpec) -> bool:
    """Tell whether nothing is left to the clock: `ideal` forces act at once, except a choice between two."""
    chooses = control_spec.aim == SWITCH or (control_spec.aim == MINIMISE and control_spec.tie == LARGEST)
    return control_spec.fidelity == IDEAL and not chooses


@inlined
def _stays(control_spec: ControlSpec, control: Array) -> bool:
    """Tell whether the voltage of a policy that holds one is set already."""
    set_already = control[Command.SET, 0] == control_spec.voltage and control[Command.SET, 1] == control_spec.voltage
    return control_spec.aim == VOLTAGE and set_already


@compiled
def _choose_ends(y: Array, ride: RunningRide) -> None:
    """Fill the bounds of both axles, and what stays as it is until the controller acts again."""
    model, control, workspace = ride
    control_spec, car = model.control_spec, model.car
    for i in range(2):
        velocity = workspace[Axle.SIDED_RATE, i] = workspace[Axle.RATE, i]
        workspace[Axle.LOW, i], workspace[Axle.HIGH, i] = bounds_of(control_spec, car, grid_at(model, i), i, velocity)
    if control_spec.aim == SWITCH:
        choose_hardness(y, ride)
    if control_spec.aim == MINIMISE and control_spec.tie == LARGEST:
        a0 = spring_acceleration(car, workspace[Axle.DEFLECTION])
        control[Command.TIE_END, 1] = farther_end(a0, car.comfort, workspace[Axle.LOW], workspace[Axle.HIGH])


@compiled
def set_control(
    time: float, y: Array, ride: RunningRide, plan: Predictor | None, electronics: Electronics | None, scratch: Array
) -> None:
    """Let the controller act once: what it asks of each axle, and the voltage that gives it by the table.

    Parameters
    ----------
    time : [s]
    y : (n,) state
    ride : its control is changed in place
    plan : of the aim `PREDICT`; without it nothing of the prediction is compiled
    electronics : sensors and supply; without it the controller sees all, and its voltage is set, exactly and at once
    scratch : (n,) to work in
    """
    model, control, control_spec = ride.model, ride.control, ride.model.control_spec
    if _acts_at_once(control_spec) or _stays(control_spec, control):
        return
    motion(time, y, ride, scratch)
    if control_spec.fidelity == IDEAL:
        _choose_ends(y, ride)
        return
    seen, view, age = y, ride, 0.0
    if electronics is not None:
        age = sense(y, model.car, ride.workspace, electronics)
        seen, view = electronics.state, RunningRide(model, control, electronics.workspace)
    _choose_ends(seen, view)
    if plan is not None:
        predict(time, age, seen, view, plan, electronics)
        for i in range(2):
            _set_voltage(time, ride, electronics, i, float(plan.candidates[plan.chosen[i]]))
    else:
        if control_spec.aim not in (VOLTAGE, SCHEDULE):
            demand(seen, view)
        for i in range(2):
            _set_voltage(time, ride, electronics, i, _wanted_voltage(time, view, i))
    control[Command.SINCE, 0] = time
    for i in range(2):
        if control[Command.SIDE, i] == 0.0:
            choose_side(i, time, y, ride, scratch)


@inlined
def scheduled(time: float, model: RideModel, axle: int) -> float:
    """Return the scheduled voltage of an axle [V] at a time [s], by where axle 1 is in the harmonic of the road."""
    count = model.control_spec.schedule.shape[1]
    turns = model.road_coefficients.wavenumber * model.car.speed * time / (2.0 * math.pi)
    place = min(int((turns - math.floor(turns)) * count + _SAME_PLACE), count - 1)
    return float(model.control_spec.schedule[axle, place])


@compiled
def _wanted_voltage(time: float, ride: RunningRide, axle: int) -> float:
    """Return the voltage that the policy asks of an axle [V]; a force that it asks is noted."""
    model, control, workspace = ride
    aim = model.control_spec.aim
    if aim == VOLTAGE:
        return model.control_spec.voltage
    if aim == SCHEDULE:
        return scheduled(time, model, axle)
    control[Command.ASKED, axle] = force = workspace[Axle.FORCE, axle]
    return _voltage_for(model, axle, force, workspace[Axle.RATE, axle], control[Command.SET, axle])


@inlined
def _voltage_for(model: RideModel, axle: int, force: float, velocity: float, otherwise: float) -> float:
    """Look up the voltage that gives a force of the axle within its bounds; a rounding beyond them is let pass."""
    grid, car = grid_at(model, axle), model.car
    ratio = car.ratio[axle]
    alone = force / (car.dampers[axle] * ratio)
    for share in (0.0, 1e-12, -1e-12):
        voltage = table_voltage(
            grid.voltages, grid.speeds, grid.rebound, grid.compression, alone * (1.0 + share), ratio * velocity
        )
        if not math.isnan(voltage):
            return voltage
    return otherwise


@compiled
def _set_voltage(time: float, ride: RunningRide, electronics: Electronics | None, axle: int, asked: float) -> None:
    """Set the voltage of an axle as the supply can, and note what stands behind each drive effect then."""
    control, voltages, before = ride.control, grid_at(ride.model, axle).voltages, ride.control[Command.SET, axle]
    elapsed, voltage = time - control[Command.SINCE, 0], asked
    if electronics is not None:
        voltage = supplied(asked, before, voltages[0], voltages[-1], electronics)
    keep_voltage(before, elapsed, control[Command.BEHIND :, axle], damper_at(ride.model, axle).drive)
    control[Command.SET, axle] = voltage


# --- The ride, and what is recorded of it ---

A_K, LOAD_1, LOAD_2, TRAVEL, LOST = range(5)
"""What is kept of every step: acceleration at K [m/s2], what each axle takes off the road's static load [N], S + T
where the wheels have no mass, larger deflection of the two suspensions [m], energy dissipated so far [J]."""
COURSE_COLUMNS = 5
COLUMNS = 16
"""time, z, phi, a_K, and per axle deflection, rate, spring, damper and demanded force, voltage."""
OUTSIDE, STEPS_DONE, NEXT_PIECE, FLOWED = range(4)
"""Places in `Records.tally`."""


class Clock(NamedTuple):
    """Steps of a ride."""

    step: float
    """Of integration [s]."""
    steps: int
    """In the whole ride."""
    per_control: int
    """Steps between two acts of the controller."""
    per_output: int
    """Steps between two rows of the history."""


class Records(NamedTuple):
    """Rows that are recorded of a piece of a ride."""

    course: Array
    """(n, COURSE_COLUMNS) of every step, see `A_K`."""
    history: Array
    """(m, COLUMNS) of every step that is a multiple of `Clock.per_output`."""
    tally: Array
    """(4,) steps beyond what the rig reached, steps done, length of the piece of a step to try next [s], and the work
    of the road in magnitude, step by step [J]."""


def records_of(rows: int, per_output: int) -> Records:
    """Return empty records for pieces of so many steps."""
    return Records(np.zeros((rows, COURSE_COLUMNS)), np.zeros((-(-rows // per_output), COLUMNS)), np.zeros(4))


@compiled
def beyond_reach(ride: RunningRide) -> bool:
    """Tell whether a damper moves faster than the rig did at its voltage, or farther than it did in any test.

    `ideal` has no damper: there the fastest at any voltage counts, and no stroke.
    """
    model, control, workspace = ride
    car = model.car
    for i in range(2):
        grid = grid_at(model, i)
        last = grid.reach.size - 1
        n, share = place(grid.voltages, control[Command.SET, i])
        reach = grid.reach[n] + share * (grid.reach[min(n + 1, last)] - grid.reach[n])
        if model.control_spec.fidelity == IDEAL:
            for n in range(last + 1):
                reach = max(reach, grid.reach[n])
        if abs(car.ratio[i] * workspace[Axle.RATE, i]) > reach * (1.0 + 1e-9):
            return True
        stroke = abs(car.ratio[i] * workspace[Axle.DEFLECTION, i])
        if model.control_spec.fidelity != IDEAL and stroke > grid.stroke * (1.0 + 1e-9):
            return True
    return False


@compiled
def _note(time: float, y: Array, ride: RunningRide, row: Array) -> None:
    """Fill one row of the history."""
    model, control, workspace = ride
    row[0], row[1], row[2], row[3] = time, y[0], y[1], workspace[Axle.COMFORT, 0]
    for i in range(2):
        row[4 + 6 * i] = workspace[Axle.DEFLECTION, i]
        row[5 + 6 * i] = workspace[Axle.RATE, i]
        row[6 + 6 * i] = workspace[Axle.SPRINGS, i]
        row[7 + 6 * i] = workspace[Axle.FORCE, i]
        row[8 + 6 * i] = workspace[Axle.FORCE, i] if model.control_spec.fidelity == IDEAL else control[Command.ASKED, i]
        row[9 + 6 * i] = control[Command.SET, i]


@inlined
def _keep(y: Array, workspace: Array, row: Array) -> None:
    """Fill one row of the course."""
    row[A_K], row[LOST] = workspace[Axle.COMFORT, 0], y[State.DISSIPATED]
    for i in range(2):
        row[LOAD_1 + i] = -workspace[Axle.CONTACT, i]
    row[TRAVEL] = max(abs(workspace[Axle.DEFLECTION, 0]), abs(workspace[Axle.DEFLECTION, 1]))


@compiled
def ride_steps(
    y: Array,
    ride: RunningRide,
    plan: Predictor | None,
    electronics: Electronics | None,
    first: int,
    last: int,
    clock: Clock,
    integrator: Integrator,
    records: Records,
) -> None:
    """Ride on, from one step to another; from step 0 on at rest.

    Parameters
    ----------
    y : (n,) state; changed in place
    ride : its control and its workspace are changed in place
    plan, electronics : see `set_control`; the noise of as many acts as are due
    first, last : steps to be kept, the last one not
    clock : steps of the whole ride
    integrator : see `advance`
    records : filled; fewer steps are done where the table ends
    """
    workspace = ride.workspace
    h, tally, scratch = clock.step, records.tally, integrator.stages[STAGES]
    if first == 0:
        tally[NEXT_PIECE] = h
        _start(y, ride, scratch)
    dt, noted = tally[NEXT_PIECE], 0
    for n in range(first, last):
        time = n * h
        if n % clock.per_control == 0:
            set_control(time, y, ride, plan, electronics, scratch)
        motion(time, y, ride, integrator.stages[0])
        _keep(y, workspace, records.course[n - first])
        tally[STEPS_DONE] = n
        if math.isnan(workspace[Axle.COMFORT, 0]):
            return
        tally[FLOWED] += h * abs(integrator.stages[0, State.ROAD_WORK])
        if beyond_reach(ride):
            tally[OUTSIDE] += 1.0
        if n % clock.per_output == 0:
            _note(time, y, ride, records.history[noted])
            noted += 1
        if n < clock.steps:
            dt = advance(time, h, y, ride, integrator, min(dt, h))
    tally[NEXT_PIECE] = dt


@compiled
def _start(y: Array, ride: RunningRide, scratch: Array) -> None:
    """Find to which side each axle sets off, or that it sticks."""
    model, control, workspace = ride
    motion(0.0, y, ride, scratch)
    for i in range(2):
        control[Command.SIDE, i] = 1.0 if workspace[Axle.RATE, i] >= 0.0 else -1.0
        if model.control_spec.jumps and workspace[Axle.RATE, i] == 0.0:
            choose_side(i, 0.0, y, ride, scratch)
