"""The equations of motion of the half-car on its dampers, with every energy integrated by itself."""

from __future__ import annotations

from pzd.compiled import compiled, inlined
from pzd.damper.rows import row_at
from pzd.record import Array
from pzd.simulate.demand import one_sided
from pzd.simulate.dynamic_damper import (
    effective_voltage,
    elastic_force,
    flowing,
    inertance,
    parallel_at,
    remember,
    rubbing_force,
    slipping_forces,
)
from pzd.simulate.kinematics import suspension
from pzd.simulate.quasistatic import quasistatic_forces
from pzd.simulate.ride_model import (
    ACCELERATION,
    BEHIND,
    BODY,
    COMFORT,
    CONTACT,
    DEFLECTION,
    DISSIPATED,
    DYNAMIC,
    ELASTIC,
    FLOW,
    FORCE,
    HEAVE,
    HEAVE_RATE,
    INERTANCE,
    OIL_1,
    OIL_DEFLECTION,
    OIL_FORCE,
    OIL_WORK,
    PARALLEL_WORK,
    PITCH,
    PITCH_RATE,
    RATE,
    REBOUND_PUSH,
    ROAD_RISE,
    ROAD_WORK,
    RUBBING,
    SET,
    SIDE,
    SINCE,
    SPRINGS,
    RideModel,
    Vehicle,
)
from pzd.simulate.sticking import accelerate
from pzd.simulate.tyre import move_wheels


@inlined
def body_acceleration(car: Vehicle, load0: float, load1: float) -> tuple[float, float]:
    """Acceleration of z [m/s2] and phi [rad/s2] under the forces S + T of the axles [N].

    Equation: M d2X/dt2 + H (S + T) = 0              Source: Makowski and Knap 2021, eq. (6)
    """
    return -(load0 + load1) / car.mass, -(car.arms[0] * load0 + car.arms[1] * load1) / car.inertia


@inlined
def dynamic_forces(time: float, y: Array, model: RideModel, control: Array, workspace: Array) -> None:
    """Fill the workspace's forces from where the oil has flowed to."""
    car, damper = model.car, model.damper
    elapsed = time - control[SINCE, 0]
    for i in range(2):
        ratio, n = car.ratio[i], car.dampers[i]
        voltage = effective_voltage(damper, control[SET, i], control[BEHIND:, i], elapsed)
        row = row_at(damper.voltages, damper.rows, voltage)
        e = ratio * workspace[DEFLECTION, i] - y[OIL_1 + i]
        workspace[OIL_DEFLECTION, i] = e
        workspace[OIL_FORCE, i], workspace[FLOW, i] = flowing(e, row, abs(workspace[FLOW, i]))
        if damper.alone:
            workspace[FORCE, i] = n * ratio * workspace[OIL_FORCE, i]
            continue
        speed = workspace[RATE, i]
        if model.control_spec.jumps and control[SIDE, i] != 0.0:
            speed = one_sided(speed, control[SIDE, i])
        parallel = damper.scratch
        parallel_at(damper, voltage, parallel)
        workspace[ELASTIC, i] = elastic_force(ratio * workspace[DEFLECTION, i], parallel)
        workspace[RUBBING, i] = rubbing_force(ratio * speed, parallel)
        workspace[INERTANCE, i] = n * ratio * ratio * inertance(parallel)
        if damper.slips:
            stored, slipped = slipping_forces(damper, i, ratio * workspace[DEFLECTION, i], ratio * speed, parallel)
            workspace[ELASTIC, i] += stored
            workspace[RUBBING, i] += slipped
        workspace[FORCE, i] = n * ratio * (workspace[OIL_FORCE, i] + workspace[ELASTIC, i] + workspace[RUBBING, i])


@compiled
def remember_step(time: float, model: RideModel, control: Array, workspace: Array) -> None:
    """Bring what remembers beside the elements to the end of a step [s] in which no axle turned round; see `motion`."""
    damper = model.damper
    for i in range(2):
        voltage = effective_voltage(damper, control[SET, i], control[BEHIND:, i], time - control[SINCE, 0])
        parallel_at(damper, voltage, damper.scratch)
        remember(damper, i, model.car.ratio[i] * workspace[DEFLECTION, i], damper.scratch)


@compiled
def relax_oil(time: float, y: Array, model: RideModel, workspace: Array) -> None:
    """Let the oil of every damper flow to where its spring bears nothing, as it does while the car stands."""
    suspension(time, y, model.car, model.road_coefficients, workspace)
    for i in range(2):
        y[OIL_1 + i] = model.car.ratio[i] * workspace[DEFLECTION, i]


@compiled
def motion(time: float, y: Array, model: RideModel, control: Array, workspace: Array, dy: Array) -> None:
    """Fill `dy` with the derivative of the state: eq. (6) of Makowski and Knap 2021, S_i = k_i U_i.

    Parameters
    ----------
    time : [s]
    y : (n,) state: `STATES`, or `STATES_WITH_WHEELS`
    model : what stays the same
    control : what the controller last set
    workspace : filled with deflections, forces and accelerations
    dy : (n,) filled
    """
    car = model.car
    suspension(time, y, car, model.road_coefficients, workspace)
    if control[SIDE, 0] * control[SIDE, 1] == 0.0:
        _try_sides(time, y, model, control, workspace)
    _act(time, y, model, control, workspace)
    load0, load1 = workspace[SPRINGS, 0] + workspace[FORCE, 0], workspace[SPRINGS, 1] + workspace[FORCE, 1]
    workspace[BODY, 0], workspace[BODY, 1] = body_acceleration(car, load0, load1)
    workspace[COMFORT, 0] = car.comfort[0] * load0 + car.comfort[1] * load1
    dy[HEAVE], dy[PITCH] = y[HEAVE_RATE], y[PITCH_RATE]
    dy[HEAVE_RATE], dy[PITCH_RATE] = workspace[BODY, 0], workspace[BODY, 1]
    for n in range(OIL_1, dy.size):
        dy[n] = 0.0
    if car.wheels:
        move_wheels(y, car, (load0, load1), workspace, dy)
    else:
        workspace[CONTACT, 0], workspace[CONTACT, 1] = -load0, -load1
    dy[ROAD_WORK] = workspace[CONTACT, 0] * workspace[ROAD_RISE, 0] + workspace[CONTACT, 1] * workspace[ROAD_RISE, 1]
    for i in range(2):
        if model.control_spec.fidelity == DYNAMIC:
            _book_damper(model, workspace, i, dy)
        else:
            dy[DISSIPATED] += workspace[FORCE, i] * workspace[RATE, i]


@inlined
def _act(time: float, y: Array, model: RideModel, control: Array, workspace: Array) -> None:
    """Fill the damper forces, and dV/dt of both axles."""
    if model.control_spec.fidelity == DYNAMIC:
        dynamic_forces(time, y, model, control, workspace)
    else:
        quasistatic_forces(y, model, control, workspace)
    accelerate(model.car, control, workspace)


@compiled
def _try_sides(time: float, y: Array, model: RideModel, control: Array, workspace: Array) -> None:
    """Fill how each sticking axle would be pushed away from V = 0, were it to slip to the one or the other side."""
    for i in range(2):
        if control[SIDE, i] == 0.0:
            for n in range(2):
                control[SIDE, i] = 1.0 - 2.0 * n
                _act(time, y, model, control, workspace)
                workspace[REBOUND_PUSH + n, i] = control[SIDE, i] * workspace[ACCELERATION, i]
            control[SIDE, i] = 0.0


@inlined
def _book_damper(model: RideModel, workspace: Array, axle: int, dy: Array) -> None:
    """Book the powers of the dampers of one axle, and the motion of its oil."""
    n, speed = model.car.dampers[axle], model.car.ratio[axle] * workspace[RATE, axle]
    inertia = workspace[INERTANCE, axle] * workspace[ACCELERATION, axle] * workspace[RATE, axle]
    dy[OIL_1 + axle] = workspace[FLOW, axle]
    dy[DISSIPATED] += n * (workspace[OIL_FORCE, axle] * workspace[FLOW, axle] + workspace[RUBBING, axle] * speed)
    dy[OIL_WORK] += n * workspace[OIL_FORCE, axle] * (speed - workspace[FLOW, axle])
    dy[PARALLEL_WORK] += n * speed * workspace[ELASTIC, axle] + inertia
