"""The equations of motion of the half-car on its dampers, with every energy integrated by itself."""

from __future__ import annotations

from pzd.compiled import compiled, inlined
from pzd.damper.parameter_rows import row_at
from pzd.force_table.lookup import table_force
from pzd.record import Array
from pzd.simulate.control.demand import bounds_of, demand, one_sided, spring_acceleration, wanted_force
from pzd.simulate.ride.model import (
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
    HIGH,
    INERTANCE,
    LIFT,
    LOW,
    MINIMISE,
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
    SIDED_RATE,
    SINCE,
    SPRINGS,
    TABLE,
    RideModel,
    TableArrays,
    Vehicle,
    effective_voltage,
    elastic_force,
    flowing,
    inertance,
    parallel_at,
    remember,
    rubbing_force,
    slipping_forces,
)
from pzd.simulate.vehicle.suspension import move_wheels, suspension

# ----------------------------------------------------------------------------------------------------
# Acceleration of the suspensions, and what holds an axle that sticks at V = 0.


@inlined
def holding_force(car: Vehicle, axle: int, load: float, lift: float, other: float) -> float:
    """Damper force that keeps the deflection of an axle still, dV_i/dt = 0.

    Equation: T_i = -(d2xi_i/dt2 + W_ij (S_j + T_j)) / W_ii - S_i, W = H^T M^-1 H     Source: from eq. (6)

    Parameters
    ----------
    car : the half-car
    axle : i
    load : spring force S_i [N]
    lift : second derivative of the road under the axle [m/s2]
    other : force S_j + T_j of the other axle [N]

    Returns
    -------
    force of the axle [N]
    """
    return -(lift + car.mobility[2] * other) / car.mobility[axle] - load


@inlined
def holding_share(car: Vehicle, axle: int) -> float:
    """How much the holding force of an axle changes with the other axle's force: dT_i/dT_j."""
    return -car.mobility[2] / car.mobility[axle]


@inlined
def accelerate(car: Vehicle, control: Array, workspace: Array) -> None:
    """Fill dV/dt of both axles, and complete the damper forces by what holds a sticking axle and by inertia.

    Equation: dV/dt = -W (S + T + mu dV/dt) - d2xi/dt2, W = H^T M^-1 H, dV_i/dt = 0 where it sticks
                                                                         Source: from eq. (6)

    Parameters
    ----------
    car : the half-car
    control, workspace : see `ride_model`; forces and accelerations are filled
    """
    w0, w1, cross = car.mobility
    s0, s1 = workspace[SPRINGS, 0], workspace[SPRINGS, 1]
    lift0, lift1 = workspace[LIFT, 0], workspace[LIFT, 1]
    determinant = w0 * w1 - cross * cross
    workspace[ACCELERATION, 0] = workspace[ACCELERATION, 1] = 0.0
    if control[SIDE, 0] == 0.0 and control[SIDE, 1] == 0.0:
        workspace[FORCE, 0] = -(w1 * lift0 - cross * lift1) / determinant - s0
        workspace[FORCE, 1] = -(w0 * lift1 - cross * lift0) / determinant - s1
        return
    if control[SIDE, 0] == 0.0 or control[SIDE, 1] == 0.0:
        _accelerate_one(car, 1 if control[SIDE, 0] == 0.0 else 0, workspace)
        return
    pull0 = -w0 * (s0 + workspace[FORCE, 0]) - cross * (s1 + workspace[FORCE, 1]) - lift0
    pull1 = -cross * (s0 + workspace[FORCE, 0]) - w1 * (s1 + workspace[FORCE, 1]) - lift1
    a, b = 1.0 + w0 * workspace[INERTANCE, 0], cross * workspace[INERTANCE, 1]
    c, d = cross * workspace[INERTANCE, 0], 1.0 + w1 * workspace[INERTANCE, 1]
    workspace[ACCELERATION, 0] = (pull0 * d - b * pull1) / (a * d - b * c)
    workspace[ACCELERATION, 1] = (a * pull1 - c * pull0) / (a * d - b * c)
    for i in range(2):
        workspace[FORCE, i] += workspace[INERTANCE, i] * workspace[ACCELERATION, i]


@inlined
def _accelerate_one(car: Vehicle, free: int, workspace: Array) -> None:
    """The same where one axle is free and the other sticks."""
    stuck, cross = 1 - free, car.mobility[2]
    freed = car.mobility[free] - cross * cross / car.mobility[stuck]
    pull = cross / car.mobility[stuck] * workspace[LIFT, stuck] - workspace[LIFT, free]
    pull -= freed * (workspace[SPRINGS, free] + workspace[FORCE, free])
    workspace[ACCELERATION, free] = pull / (1.0 + freed * workspace[INERTANCE, free])
    workspace[FORCE, free] += workspace[INERTANCE, free] * workspace[ACCELERATION, free]
    other = workspace[SPRINGS, free] + workspace[FORCE, free]
    workspace[FORCE, stuck] = holding_force(car, stuck, workspace[SPRINGS, stuck], workspace[LIFT, stuck], other)


# ----------------------------------------------------------------------------------------------------
# Damper forces without dynamics of their own: the demand at once (`ideal`), or the table (`table`).


@compiled
def tabled(car: Vehicle, grid: TableArrays, axle: int, voltage: float, velocity: float) -> float:
    """Force of an axle [N] whose dampers stand at a voltage [V], at a suspension speed [m/s].

    Equation: T = n r F(U, r V)      Source: virtual work, r the motion ratio and n the number of dampers
    """
    ratio = car.ratio[axle]
    force = table_force(grid.voltages, grid.speeds, grid.rebound, grid.compression, voltage, ratio * velocity)
    return car.dampers[axle] * ratio * force


@inlined
def quasistatic_forces(y: Array, model: RideModel, control: Array, workspace: Array) -> None:
    """Fill the workspace's forces for axles that slip; one that sticks is left to what holds it."""
    control_spec = model.control_spec
    for i in range(2):
        velocity = workspace[RATE, i]
        if control_spec.jumps and control[SIDE, i] != 0.0:
            velocity = one_sided(velocity, control[SIDE, i])
        workspace[SIDED_RATE, i] = velocity
        if control_spec.fidelity == TABLE:
            workspace[FORCE, i] = tabled(model.car, model.grid, i, control[SET, i], velocity)
        else:
            workspace[LOW, i], workspace[HIGH, i] = bounds_of(control_spec, model.car, model.grid, i, velocity)
    if control_spec.fidelity == TABLE:
        return
    if control_spec.jumps and control[SIDE, 0] * control[SIDE, 1] == 0.0:
        if control[SIDE, 0] != control[SIDE, 1]:
            _force_outside_sticking(y, model, control, workspace)
        return
    demand(control_spec, model.car, y, control, workspace)


@inlined
def _force_outside_sticking(y: Array, model: RideModel, control: Array, workspace: Array) -> None:
    """Fill the force of the free axle where the other sticks: the policy knows that the stuck one answers."""
    control_spec, car = model.control_spec, model.car
    stuck = 0 if control[SIDE, 0] == 0.0 else 1
    free = 1 - stuck
    if control_spec.aim == MINIMISE:
        alone = holding_force(car, stuck, workspace[SPRINGS, stuck], workspace[LIFT, stuck], workspace[SPRINGS, free])
        a0 = spring_acceleration(car, workspace[DEFLECTION]) + car.comfort[stuck] * alone
        slope = car.comfort[free] + car.comfort[stuck] * holding_share(car, stuck)
        wanted = -a0 / slope if slope != 0.0 else 0.0
        workspace[FORCE, free] = min(max(wanted, workspace[LOW, free]), workspace[HIGH, free])
    else:
        workspace[FORCE, free] = wanted_force(control_spec, free, y, control, workspace)


# ----------------------------------------------------------------------------------------------------


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
