"""The ride as one compiled loop: the controller by its clock, the integration by its step, the records beside."""

from __future__ import annotations

import math

from pzd.damper.compiled import compiled, laid_in
from pzd.damper.dormand_prince import STAGES
from pzd.damper.rows import row_at
from pzd.record import Array
from pzd.simulate.demand import bounds_of, demand, spring_acceleration
from pzd.simulate.equations import motion
from pzd.simulate.minimise import LARGEST, farther_end
from pzd.simulate.oil import felt, lagging, place, stored
from pzd.simulate.scene import (
    ASKED,
    BEFORE,
    COMFORT,
    DEFLECTION,
    DYNAMIC,
    FELT,
    FORCE,
    HIGH,
    IDEAL,
    LOW,
    MINIMISE,
    OIL_1,
    RATE,
    SET,
    SIDE,
    SINCE,
    SPRINGS,
    TIE_END,
    VALVE_WORK,
    VOLTAGE,
    Scene,
)
from pzd.simulate.stepper import advance, choose_side
from pzd.table.kernel import table_voltage

PEAK_DEFLECTION, LOAD_1, LOAD_2, OUTSIDE, SAMPLES, STEPS_DONE = range(6)
"""What is summed over the steps behind `settle`; OUTSIDE and STEPS_DONE over all."""
TALLIES = 6
COLUMNS = 16
"""time, z, phi, a_K, and per axle deflection, rate, spring, damper and demanded force, voltage."""


@compiled
def set_control(time: float, y: Array, scene: Scene, control: Array, desk: Array, room: Array) -> None:
    """Let the controller act once: what it asks of each axle, and the voltage that gives it by the table.

    Parameters
    ----------
    time : [s]
    y : (STATES,) state; a valve without lag tightens the oil spring at once, which is booked here
    scene, control, desk : see `scene`; the control is changed in place
    room : (STATES,) to work in
    """
    law, car = scene.law, scene.car
    if law.fidelity == IDEAL and (law.aim != MINIMISE or law.tie != LARGEST):
        return
    motion(time, y, scene, control, desk, room)
    for i in range(2):
        desk[LOW, i], desk[HIGH, i] = bounds_of(law, car, scene.grid, i, desk[RATE, i])
    if law.aim == MINIMISE and law.tie == LARGEST:
        a0 = spring_acceleration(car, desk[DEFLECTION])
        control[TIE_END, 1] = farther_end(a0, car.comfort, desk[LOW], desk[HIGH])
    if law.fidelity == IDEAL:
        return
    if law.aim != VOLTAGE:
        demand(law, car, y, desk, int(control[TIE_END, 1]))
    for i in range(2):
        voltage = law.voltage
        if law.aim != VOLTAGE:
            control[ASKED, i] = desk[FORCE, i]
            voltage = _voltage_for(scene, i, desk[FORCE, i], desk[RATE, i], control[SET, i])
        _set_voltage(time, y, scene, control, i, voltage)
    control[SINCE, 0] = time
    for i in range(2):
        if control[SIDE, i] == 0.0:
            choose_side(i, time, y, scene, control, desk, room)


@laid_in
def _voltage_for(scene: Scene, axle: int, force: float, velocity: float, otherwise: float) -> float:
    """The voltage that gives a force of the axle within its bounds; a rounding beyond them is let pass."""
    grid, car = scene.grid, scene.car
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
def _set_voltage(time: float, y: Array, scene: Scene, control: Array, axle: int, voltage: float) -> None:
    oil, elapsed = scene.oil, time - control[SINCE, 0]
    was, _ = felt(oil, control[SET, axle], control[BEFORE, axle], control[FELT, axle], elapsed)
    control[BEFORE, axle] = lagging(oil, control[SET, axle], control[BEFORE, axle], elapsed)
    control[FELT, axle] = was
    control[SET, axle] = voltage
    if scene.law.fidelity == DYNAMIC:
        now, _ = felt(oil, voltage, control[BEFORE, axle], was, 0.0)
        if now != was:
            e = y[OIL_1 + axle]
            change = stored(e, row_at(oil.voltages, oil.rows, now)) - stored(e, row_at(oil.voltages, oil.rows, was))
            y[VALVE_WORK] += scene.car.dampers[axle] * change


@laid_in
def beyond_reach(scene: Scene, control: Array, desk: Array) -> bool:
    """Whether a damper moves faster than the rig did at its voltage; `ideal` has none, so at the best one."""
    grid, car = scene.grid, scene.car
    last = grid.reach.size - 1
    for i in range(2):
        n, share = place(grid.voltages, control[SET, i])
        reach = grid.reach[n] + share * (grid.reach[min(n + 1, last)] - grid.reach[n])
        if scene.law.fidelity == IDEAL:
            for n in range(last + 1):
                reach = max(reach, grid.reach[n])
        if abs(car.ratio[i] * desk[RATE, i]) > reach * (1.0 + 1e-9):
            return True
    return False


@laid_in
def _note(time: float, y: Array, scene: Scene, control: Array, desk: Array, row: Array) -> None:
    """Fill one row of the history."""
    row[0], row[1], row[2], row[3] = time, y[0], y[1], desk[COMFORT, 0]
    for i in range(2):
        row[4 + 6 * i] = desk[DEFLECTION, i]
        row[5 + 6 * i] = desk[RATE, i]
        row[6 + 6 * i] = desk[SPRINGS, i]
        row[7 + 6 * i] = desk[FORCE, i]
        row[8 + 6 * i] = desk[FORCE, i] if scene.law.fidelity == IDEAL else control[ASKED, i]
        row[9 + 6 * i] = control[SET, i]


@laid_in
def _tally(desk: Array, tally: Array) -> None:
    """Take one step into peaks and sums."""
    tally[SAMPLES] += 1.0
    for i in range(2):
        tally[PEAK_DEFLECTION] = max(tally[PEAK_DEFLECTION], abs(desk[DEFLECTION, i]))
        tally[LOAD_1 + i] += (desk[SPRINGS, i] + desk[FORCE, i]) ** 2


@compiled
def ride(
    y: Array,
    scene: Scene,
    control: Array,
    desk: Array,
    steps: int,
    h: float,
    tolerance: float,
    per_control: int,
    per_output: int,
    settle: int,
    acceleration: Array,
    history: Array,
    tally: Array,
    stages: Array,
    end: Array,
) -> None:
    """Ride from time 0 through a number of steps.

    Parameters
    ----------
    y : (STATES,) state; changed in place
    scene, control, desk : see `scene`
    steps, h : number and length of the steps of integration [s]
    tolerance : see `advance`
    per_control, per_output : steps between two acts of the controller, and between two rows of the history
    settle : number of steps before peaks and sums are taken
    acceleration : (steps + 1,) a_K at every step [m/s2], filled
    history : (steps // per_output + 1, COLUMNS) filled
    tally : (TALLIES,) filled; fewer steps are done where the table ends
    stages, end : room to work in, see `advance`
    """
    room = stages[STAGES]
    motion(0.0, y, scene, control, desk, room)
    for i in range(2):
        control[SIDE, i] = 1.0 if desk[RATE, i] >= 0.0 else -1.0
        if scene.law.jumps and desk[RATE, i] == 0.0:
            choose_side(i, 0.0, y, scene, control, desk, room)
    dt = h
    for n in range(steps + 1):
        time = n * h
        if n % per_control == 0:
            set_control(time, y, scene, control, desk, room)
        motion(time, y, scene, control, desk, room)
        acceleration[n] = desk[COMFORT, 0]
        tally[STEPS_DONE] = n
        if math.isnan(desk[COMFORT, 0]):
            return
        if beyond_reach(scene, control, desk):
            tally[OUTSIDE] += 1.0
        if n >= settle:
            _tally(desk, tally)
        if n % per_output == 0:
            _note(time, y, scene, control, desk, history[n // per_output])
        if n < steps:
            dt = advance(time, h, y, scene, control, desk, tolerance, min(dt, h), stages, end)
