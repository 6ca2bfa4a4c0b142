"""The controller, once in a control period: what it asks of each axle, and the voltage that is set there."""

from __future__ import annotations

import math

from pzd.compiled import compiled, inlined
from pzd.damper.kernels import keep_voltage
from pzd.record import Array
from pzd.simulate.demand import bounds_of, choose_hardness, demand, spring_acceleration
from pzd.simulate.equations import motion
from pzd.simulate.minimise import LARGEST, farther_end
from pzd.simulate.prediction.choice import predict
from pzd.simulate.prediction.predictor import Predictor
from pzd.simulate.ride_model import (
    ASKED,
    BEHIND,
    DEFLECTION,
    FORCE,
    HIGH,
    IDEAL,
    LOW,
    MINIMISE,
    RATE,
    SCHEDULE,
    SET,
    SIDE,
    SIDED_RATE,
    SINCE,
    SWITCH,
    TIE_END,
    VOLTAGE,
    ControlSpec,
    RideModel,
)
from pzd.simulate.sensing import Electronics, sense, supplied
from pzd.simulate.stepper import choose_side
from pzd.table.kernel import table_voltage

_SAME_PLACE = 1e-9
"""Of an interval of a schedule: the clock meets its beginning but for rounding."""


@inlined
def _acts_at_once(control_spec: ControlSpec) -> bool:
    """Whether nothing is left to the clock: `ideal` forces are, but for the choice between two that lie apart."""
    chooses = control_spec.aim == SWITCH or (control_spec.aim == MINIMISE and control_spec.tie == LARGEST)
    return control_spec.fidelity == IDEAL and not chooses


@inlined
def _stays(control_spec: ControlSpec, control: Array) -> bool:
    """Whether the voltage of a policy that holds one is set already."""
    set_already = control[SET, 0] == control_spec.voltage and control[SET, 1] == control_spec.voltage
    return control_spec.aim == VOLTAGE and set_already


@inlined
def _choose_ends(y: Array, model: RideModel, control: Array, workspace: Array) -> None:
    """Fill the bounds of both axles, and what stays as it is until the controller acts again."""
    control_spec, car = model.control_spec, model.car
    for i in range(2):
        workspace[LOW, i], workspace[HIGH, i] = bounds_of(control_spec, car, model.grid, i, workspace[RATE, i])
        workspace[SIDED_RATE, i] = workspace[RATE, i]
    if control_spec.aim == SWITCH:
        choose_hardness(control_spec, car, y, control, workspace)
    if control_spec.aim == MINIMISE and control_spec.tie == LARGEST:
        a0 = spring_acceleration(car, workspace[DEFLECTION])
        control[TIE_END, 1] = farther_end(a0, car.comfort, workspace[LOW], workspace[HIGH])


@compiled
def set_control(
    time: float,
    y: Array,
    model: RideModel,
    plan: Predictor | None,
    electronics: Electronics | None,
    control: Array,
    workspace: Array,
    scratch: Array,
) -> None:
    """Let the controller act once: what it asks of each axle, and the voltage that gives it by the table.

    Parameters
    ----------
    time : [s]
    y : (n,) state
    model : see `ride_model`
    plan : of the aim `PREDICT`; without it nothing of the prediction is compiled
    electronics : sensors and supply; without it the controller sees all, and its voltage is set, exactly and at once
    control, workspace : see `ride_model`; the control is changed in place
    scratch : (n,) to work in
    """
    control_spec, car = model.control_spec, model.car
    if _acts_at_once(control_spec) or _stays(control_spec, control):
        return
    motion(time, y, model, control, workspace, scratch)
    if control_spec.fidelity == IDEAL:
        _choose_ends(y, model, control, workspace)
        return
    seen, room, age = y, workspace, 0.0
    if electronics is not None:
        age = sense(y, car, workspace, electronics)
        seen, room = electronics.state, electronics.workspace
    _choose_ends(seen, model, control, room)
    if plan is not None:
        predict(time, age, seen, model, plan, electronics, control, room)
        for i in range(2):
            _set_voltage(time, model, electronics, control, i, float(plan.candidates[plan.chosen[i]]))
    else:
        if control_spec.aim not in (VOLTAGE, SCHEDULE):
            demand(control_spec, car, seen, control, room)
        for i in range(2):
            _set_voltage(time, model, electronics, control, i, _wanted_voltage(time, model, control, room, i))
    control[SINCE, 0] = time
    for i in range(2):
        if control[SIDE, i] == 0.0:
            choose_side(i, time, y, model, control, workspace, scratch)


@inlined
def scheduled(time: float, model: RideModel, axle: int) -> float:
    """The voltage [V] that a schedule has for an axle at a time [s], by where axle 1 is in the harmonic of the road."""
    count = model.control_spec.schedule.shape[1]
    turns = model.road_coefficients.wavenumber * model.car.speed * time / (2.0 * math.pi)
    place = min(int((turns - math.floor(turns)) * count + _SAME_PLACE), count - 1)
    return float(model.control_spec.schedule[axle, place])


@inlined
def _wanted_voltage(time: float, model: RideModel, control: Array, workspace: Array, axle: int) -> float:
    """The voltage that the policy asks of an axle [V]; a force that it asks is noted."""
    aim = model.control_spec.aim
    if aim == VOLTAGE:
        return model.control_spec.voltage
    if aim == SCHEDULE:
        return scheduled(time, model, axle)
    control[ASKED, axle] = workspace[FORCE, axle]
    return _voltage_for(model, axle, workspace[FORCE, axle], workspace[RATE, axle], control[SET, axle])


@inlined
def _voltage_for(model: RideModel, axle: int, force: float, velocity: float, otherwise: float) -> float:
    """The voltage that gives a force of the axle within its bounds; a rounding beyond them is let pass."""
    grid, car = model.grid, model.car
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
def _set_voltage(
    time: float,
    model: RideModel,
    electronics: Electronics | None,
    control: Array,
    axle: int,
    asked: float,
) -> None:
    voltage = asked
    if electronics is not None:
        voltages = model.grid.voltages
        voltage = supplied(asked, control[SET, axle], voltages[0], voltages[-1], electronics)
    keep_voltage(control[SET, axle], time - control[SINCE, 0], control[BEHIND:, axle], model.damper.drive)
    control[SET, axle] = voltage
