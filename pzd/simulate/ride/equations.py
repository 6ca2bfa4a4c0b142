"""The equations of motion of the half-car on its dampers, with every energy integrated by itself."""

from __future__ import annotations

from pzd.compiled import compiled, inlined
from pzd.damper.compiled.kernels import K
from pzd.damper.parameter_rows import row_at
from pzd.damper.regimes import spring_energy
from pzd.force_table.lookup import table_force
from pzd.record import Array
from pzd.simulate.control.demand import bounds_of, demand, one_sided, spring_acceleration, wanted_force
from pzd.simulate.ride.model import (
    DYNAMIC,
    MINIMISE,
    TABLE,
    Axle,
    Command,
    RunningRide,
    State,
    TableArrays,
    Vehicle,
    damper_at,
    effective_voltage,
    elastic_force,
    flowing,
    grid_at,
    inertance,
    parallel_at,
    remember,
    rigid_force,
    rubbing_force,
    slipping_forces,
)
from pzd.simulate.vehicle.suspension import move_wheels, road_at, suspension, tyre_energy

# --- Acceleration of the suspensions, and the force that holds an axle that sticks at V = 0 ---


@inlined
def holding_force(car: Vehicle, axle: int, load: float, lift: float, other: float) -> float:
    """Return the damper force that keeps the deflection of an axle still, dV_i/dt = 0.

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
def accelerate(car: Vehicle, control: Array, workspace: Array) -> None:
    """Fill dV/dt of both axles, and complete the damper forces by inertia and by what holds a sticking axle.

    Equation: dV/dt = -W (S + T + mu dV/dt) - d2xi/dt2, W = H^T M^-1 H, dV_i/dt = 0 where it sticks
                                                                         Source: from eq. (6)

    Parameters
    ----------
    car : the half-car
    control, workspace : of the ride; forces and accelerations are filled
    """
    w0, w1, cross = car.mobility
    s0, s1 = workspace[Axle.SPRINGS, 0], workspace[Axle.SPRINGS, 1]
    lift0, lift1 = workspace[Axle.LIFT, 0], workspace[Axle.LIFT, 1]
    determinant = w0 * w1 - cross * cross
    workspace[Axle.ACCELERATION, 0] = workspace[Axle.ACCELERATION, 1] = 0.0
    if control[Command.SIDE, 0] == 0.0 and control[Command.SIDE, 1] == 0.0:
        workspace[Axle.FORCE, 0] = -(w1 * lift0 - cross * lift1) / determinant - s0
        workspace[Axle.FORCE, 1] = -(w0 * lift1 - cross * lift0) / determinant - s1
        return
    if control[Command.SIDE, 0] == 0.0 or control[Command.SIDE, 1] == 0.0:
        _accelerate_one(car, 1 if control[Command.SIDE, 0] == 0.0 else 0, workspace)
        return
    pull0 = -w0 * (s0 + workspace[Axle.FORCE, 0]) - cross * (s1 + workspace[Axle.FORCE, 1]) - lift0
    pull1 = -cross * (s0 + workspace[Axle.FORCE, 0]) - w1 * (s1 + workspace[Axle.FORCE, 1]) - lift1
    a, b = 1.0 + w0 * workspace[Axle.INERTANCE, 0], cross * workspace[Axle.INERTANCE, 1]
    c, d = cross * workspace[Axle.INERTANCE, 0], 1.0 + w1 * workspace[Axle.INERTANCE, 1]
    workspace[Axle.ACCELERATION, 0] = (pull0 * d - b * pull1) / (a * d - b * c)
    workspace[Axle.ACCELERATION, 1] = (a * pull1 - c * pull0) / (a * d - b * c)
    for i in range(2):
        workspace[Axle.FORCE, i] += workspace[Axle.INERTANCE, i] * workspace[Axle.ACCELERATION, i]


@inlined
def _accelerate_one(car: Vehicle, free: int, workspace: Array) -> None:
    """Do the same as `accelerate` where one axle is free and the other sticks."""
    stuck, cross = 1 - free, car.mobility[2]
    freed = car.mobility[free] - cross * cross / car.mobility[stuck]
    pull = cross / car.mobility[stuck] * workspace[Axle.LIFT, stuck] - workspace[Axle.LIFT, free]
    pull -= freed * (workspace[Axle.SPRINGS, free] + workspace[Axle.FORCE, free])
    workspace[Axle.ACCELERATION, free] = pull / (1.0 + freed * workspace[Axle.INERTANCE, free])
    workspace[Axle.FORCE, free] += workspace[Axle.INERTANCE, free] * workspace[Axle.ACCELERATION, free]
    load, lift = workspace[Axle.SPRINGS, stuck], workspace[Axle.LIFT, stuck]
    other = workspace[Axle.SPRINGS, free] + workspace[Axle.FORCE, free]
    workspace[Axle.FORCE, stuck] = holding_force(car, stuck, load, lift, other)


# --- Damper forces without dynamics of their own: the demand at once (`ideal`), or the table (`table`) ---


@compiled
def tabled(car: Vehicle, grid: TableArrays, axle: int, voltage: float, velocity: float) -> float:
    """Return the force of an axle [N] whose dampers stand at a voltage [V], at a suspension speed [m/s].

    Equation: T = n r F(U, r V)      Source: virtual work, r the motion ratio and n the number of dampers
    """
    ratio = car.ratio[axle]
    force = table_force(grid.voltages, grid.speeds, grid.rebound, grid.compression, voltage, ratio * velocity)
    return car.dampers[axle] * ratio * force


@inlined
def quasistatic_forces(y: Array, ride: RunningRide) -> None:
    """Fill the workspace's forces for axles that slip; one that sticks is left to what holds it."""
    model, control, workspace = ride
    control_spec = model.control_spec
    for i in range(2):
        velocity = workspace[Axle.RATE, i]
        if control_spec.jumps and control[Command.SIDE, i] != 0.0:
            velocity = one_sided(velocity, control[Command.SIDE, i])
        workspace[Axle.SIDED_RATE, i] = velocity
        if control_spec.fidelity == TABLE:
            workspace[Axle.FORCE, i] = tabled(model.car, grid_at(model, i), i, control[Command.SET, i], velocity)
        else:
            low_high = bounds_of(control_spec, model.car, grid_at(model, i), i, velocity)
            workspace[Axle.LOW, i], workspace[Axle.HIGH, i] = low_high
    if control_spec.fidelity == TABLE:
        return
    if control_spec.jumps and control[Command.SIDE, 0] * control[Command.SIDE, 1] == 0.0:
        if control[Command.SIDE, 0] != control[Command.SIDE, 1]:
            _force_outside_sticking(y, ride)
        return
    demand(y, ride)


@inlined
def _force_outside_sticking(y: Array, ride: RunningRide) -> None:
    """Fill the force of the free axle where the other sticks: the policy knows that the stuck one answers."""
    model, control, workspace = ride
    control_spec, car = model.control_spec, model.car
    stuck = 0 if control[Command.SIDE, 0] == 0.0 else 1
    free = 1 - stuck
    if control_spec.aim == MINIMISE:
        alone = holding_force(
            car, stuck, workspace[Axle.SPRINGS, stuck], workspace[Axle.LIFT, stuck], workspace[Axle.SPRINGS, free]
        )
        a0 = spring_acceleration(car, workspace[Axle.DEFLECTION]) + car.comfort[stuck] * alone
        share = -car.mobility[2] / car.mobility[stuck]  # dT_i/dT_j of `holding_force`
        slope = car.comfort[free] + car.comfort[stuck] * share
        wanted = -a0 / slope if slope != 0.0 else 0.0
        workspace[Axle.FORCE, free] = min(max(wanted, workspace[Axle.LOW, free]), workspace[Axle.HIGH, free])
    else:
        workspace[Axle.FORCE, free] = wanted_force(free, y, ride)


# --- Damper forces by the dynamics of the damper (`dynamic`), and the derivative of the state ---


@inlined
def body_acceleration(car: Vehicle, load0: float, load1: float) -> tuple[float, float]:
    """Return the acceleration of z [m/s2] and phi [rad/s2] under the forces S + T of the axles [N].

    Equation: M d2X/dt2 + H (S + T) = 0              Source: Makowski and Knap 2021, eq. (6)
    """
    return -(load0 + load1) / car.mass, -(car.arms[0] * load0 + car.arms[1] * load1) / car.inertia


@inlined
def valve_voltage(time: float, ride: RunningRide, axle: int) -> float:
    """Return the effective voltage of the dampers of an axle [V] at a time [s]."""
    control, damper = ride.control, damper_at(ride.model, axle)
    elapsed = time - control[Command.SINCE, 0]
    return effective_voltage(damper, control[Command.SET, axle], control[Command.BEHIND :, axle], elapsed)


@inlined
def dynamic_forces(time: float, y: Array, ride: RunningRide) -> None:
    """Fill the workspace's forces from where the oil has flowed to."""
    model, control, workspace = ride
    car = model.car
    for i in range(2):
        damper = damper_at(model, i)
        ratio, n = car.ratio[i], car.dampers[i]
        voltage = valve_voltage(time, ride, i)
        row = row_at(damper.voltages, damper.rows, voltage)
        speed = workspace[Axle.RATE, i]
        if model.control_spec.jumps and control[Command.SIDE, i] != 0.0:
            speed = one_sided(speed, control[Command.SIDE, i])
        if damper.rigid:
            workspace[Axle.OIL_FORCE, i] = rigid_force(ratio * speed, row)
            workspace[Axle.FLOW, i] = ratio * workspace[Axle.RATE, i]
        else:
            e = ratio * workspace[Axle.DEFLECTION, i] - y[State.OIL_1 + i]
            workspace[Axle.OIL_DEFLECTION, i] = e
            workspace[Axle.OIL_FORCE, i], workspace[Axle.FLOW, i] = flowing(e, row, abs(workspace[Axle.FLOW, i]))
        if damper.alone:
            workspace[Axle.FORCE, i] = n * ratio * workspace[Axle.OIL_FORCE, i]
            continue
        parallel = damper.scratch
        parallel_at(damper, voltage, parallel)
        workspace[Axle.ELASTIC, i] = elastic_force(ratio * workspace[Axle.DEFLECTION, i], parallel)
        workspace[Axle.RUBBING, i] = rubbing_force(ratio * speed, parallel)
        workspace[Axle.INERTANCE, i] = n * ratio * ratio * inertance(parallel)
        if damper.slips:
            stored, slipped = slipping_forces(damper, i, ratio * workspace[Axle.DEFLECTION, i], ratio * speed, parallel)
            workspace[Axle.ELASTIC, i] += stored
            workspace[Axle.RUBBING, i] += slipped
        total = workspace[Axle.OIL_FORCE, i] + workspace[Axle.ELASTIC, i] + workspace[Axle.RUBBING, i]
        workspace[Axle.FORCE, i] = n * ratio * total


@compiled
def remember_step(time: float, ride: RunningRide) -> None:
    """Bring what remembers beside the elements to the end of a step [s] in which no axle turned round; see `motion`."""
    model, workspace = ride.model, ride.workspace
    for i in range(2):
        damper = damper_at(model, i)
        parallel_at(damper, valve_voltage(time, ride, i), damper.scratch)
        remember(damper, i, model.car.ratio[i] * workspace[Axle.DEFLECTION, i], damper.scratch)


@compiled
def relax_oil(time: float, y: Array, ride: RunningRide) -> None:
    """Let the oil of every damper flow to where its stiffness bears nothing, as it does while the car stands."""
    model, workspace = ride.model, ride.workspace
    suspension(time, y, model.car, model.road_coefficients, workspace)
    for i in range(2):
        y[State.OIL_1 + i] = model.car.ratio[i] * workspace[Axle.DEFLECTION, i]


@compiled
def motion(time: float, y: Array, ride: RunningRide, dy: Array) -> None:
    """Fill `dy` with the derivative of the state: eq. (6) of Makowski and Knap 2021, S_i = k_i U_i.

    Parameters
    ----------
    time : [s]
    y : (n,) state: `STATES`, or `STATES_WITH_WHEELS`
    ride : its workspace is filled with deflections, forces and accelerations
    dy : (n,) filled
    """
    model, control, workspace = ride
    car = model.car
    suspension(time, y, car, model.road_coefficients, workspace)
    if control[Command.SIDE, 0] * control[Command.SIDE, 1] == 0.0:
        _try_sides(time, y, ride)
    _act(time, y, ride)
    load0 = workspace[Axle.SPRINGS, 0] + workspace[Axle.FORCE, 0]
    load1 = workspace[Axle.SPRINGS, 1] + workspace[Axle.FORCE, 1]
    workspace[Axle.BODY, 0], workspace[Axle.BODY, 1] = body_acceleration(car, load0, load1)
    workspace[Axle.COMFORT, 0] = car.comfort[0] * load0 + car.comfort[1] * load1
    dy[State.HEAVE], dy[State.PITCH] = y[State.HEAVE_RATE], y[State.PITCH_RATE]
    dy[State.HEAVE_RATE], dy[State.PITCH_RATE] = workspace[Axle.BODY, 0], workspace[Axle.BODY, 1]
    for n in range(State.OIL_1, dy.size):
        dy[n] = 0.0
    if car.wheels:
        move_wheels(y, car, (load0, load1), workspace, dy)
    else:
        workspace[Axle.CONTACT, 0], workspace[Axle.CONTACT, 1] = -load0, -load1
    contact, rise = workspace[Axle.CONTACT], workspace[Axle.ROAD_RISE]
    dy[State.ROAD_WORK] = contact[0] * rise[0] + contact[1] * rise[1]
    for i in range(2):
        if model.control_spec.fidelity == DYNAMIC:
            _add_damper_power(ride, i, dy)
        else:
            dy[State.DISSIPATED] += workspace[Axle.FORCE, i] * workspace[Axle.RATE, i]


@compiled
def _act(time: float, y: Array, ride: RunningRide) -> None:
    """Fill the damper forces, and dV/dt of both axles."""
    model, control, workspace = ride
    if model.control_spec.fidelity == DYNAMIC:
        dynamic_forces(time, y, ride)
    else:
        quasistatic_forces(y, ride)
    accelerate(model.car, control, workspace)


@compiled
def _try_sides(time: float, y: Array, ride: RunningRide) -> None:
    """Fill how each sticking axle would be pushed away from V = 0, were it to slip to the one or the other side."""
    control, workspace = ride.control, ride.workspace
    for i in range(2):
        if control[Command.SIDE, i] == 0.0:
            for n in range(2):
                control[Command.SIDE, i] = 1.0 - 2.0 * n
                _act(time, y, ride)
                workspace[Axle.REBOUND_PUSH + n, i] = control[Command.SIDE, i] * workspace[Axle.ACCELERATION, i]
            control[Command.SIDE, i] = 0.0


@inlined
def _add_damper_power(ride: RunningRide, axle: int, dy: Array) -> None:
    """Add the powers of the dampers of one axle to the derivative of the energies, and fill the flow of its oil."""
    model, workspace = ride.model, ride.workspace
    n, speed = model.car.dampers[axle], model.car.ratio[axle] * workspace[Axle.RATE, axle]
    inertia = workspace[Axle.INERTANCE, axle] * workspace[Axle.ACCELERATION, axle] * workspace[Axle.RATE, axle]
    force, flow = workspace[Axle.OIL_FORCE, axle], workspace[Axle.FLOW, axle]
    dy[State.OIL_1 + axle] = flow
    dy[State.DISSIPATED] += n * (force * flow + workspace[Axle.RUBBING, axle] * speed)
    dy[State.OIL_WORK] += n * force * (speed - flow)
    dy[State.PARALLEL_WORK] += n * speed * workspace[Axle.ELASTIC, axle] + inertia


# --- The energy balance: every term is integrated by itself, so what is left is the error ---
#
# What the valve puts into an oil stiffness while the voltage moves is the rest of that stiffness's own balance, stored
# less put in by motion; where no voltage moves that rest is an error too.

_NOTHING = 1e-12
"""Work that counts as nothing [J]: a ride on a level road."""


@compiled
def stored_energy(time: float, y: Array, ride: RunningRide) -> float:
    """Return the energy of body and springs, and of wheels and tyres where wheels have mass.

    Equation: E = m (dz/dt)^2 / 2 + J (dphi/dt)^2 / 2 + sum k_i U_i^2 / 2 + sum m_i (dzeta_i/dt)^2 / 2 + sum E_tyre

    Parameters
    ----------
    time : [s]
    y : (n,) state
    ride : its workspace is changed

    Returns
    -------
    energy [J]
    """
    model, workspace = ride.model, ride.workspace
    car = model.car
    suspension(time, y, car, model.road_coefficients, workspace)
    energy = 0.5 * car.mass * y[State.HEAVE_RATE] ** 2 + 0.5 * car.inertia * y[State.PITCH_RATE] ** 2
    for i in range(2):
        energy += 0.5 * car.stiffness[i] * workspace[Axle.DEFLECTION, i] ** 2
        if car.wheels:
            road = model.road_coefficients
            height, _, _ = road_at(road, car.speed * time - road.behind[i])
            energy += 0.5 * car.unsprung[i] * y[State.WHEEL_RATE_1 + i] ** 2
            energy += tyre_energy(car.static_load[i], car.tyre_stiffness[i], height - y[State.WHEEL_1 + i])
    return float(energy)


@compiled
def oil_energy(time: float, y: Array, ride: RunningRide) -> float:
    """Return the energy of the oil stiffnesses of all dampers [J].

    Equation: E = sum n_i k integral s de, e = r_i U_i - y_i

    Parameters
    ----------
    time : [s]
    y : (n,) state
    ride : its workspace is changed
    """
    model, workspace = ride.model, ride.workspace
    car, energy = model.car, 0.0
    if model.control_spec.fidelity != DYNAMIC:
        return energy
    suspension(time, y, car, model.road_coefficients, workspace)
    for i in range(2):
        damper = damper_at(model, i)
        if damper.rigid:
            continue
        row = row_at(damper.voltages, damper.rows, valve_voltage(time, ride, i))
        e = car.ratio[i] * workspace[Axle.DEFLECTION, i] - y[State.OIL_1 + i]
        energy += car.dampers[i] * spring_energy(e, row, row[K])
    return energy


def balance_error(change: float, oil_change: float, y: Array, flowed: float = 0.0) -> float:
    """Return what the energy balance leaves open, as a share of the energy that flows.

    Equation: (change of stored energy + put into the oil + dissipated - road work) / max(dissipated, flowed); it is
    dissipated in dampers and tyres

    Parameters
    ----------
    change : of the stored energy over the ride [J], see `stored_energy`
    oil_change : of what the oil stiffnesses store [J], where no voltage moved; else what was put into them
    y : (n,) state at its end; the work on what stands beside the elements counts as stored
    flowed : what the road gave and took, in magnitude [J]: where nothing damps it all comes back

    Returns
    -------
    share; zero for a ride in which nothing moves
    """
    lost = y[State.DISSIPATED] + (y[State.TYRE_LOSS] if y.size > State.TYRE_LOSS else 0.0)
    left = change + oil_change + y[State.PARALLEL_WORK] + lost - y[State.ROAD_WORK]
    return float(left / max(lost, flowed, _NOTHING)) if abs(left) > _NOTHING else 0.0
