"""The equations of motion of the half-car on its dampers, with every energy integrated by itself."""

from __future__ import annotations

from pzd.damper.compiled import compiled, laid_in
from pzd.damper.rows import row_at
from pzd.record import Array
from pzd.simulate.demand import one_sided
from pzd.simulate.kinematics import suspension
from pzd.simulate.oil import beside_at, elastic_force, felt, flowing, inertance, rubbing_force, valve_power
from pzd.simulate.quasistatic import quasistatic_forces
from pzd.simulate.scene import (
    ACCELERATION,
    BEFORE,
    BESIDE_WORK,
    BODY,
    COMFORT,
    DEFLECTION,
    DISSIPATED,
    DYNAMIC,
    ELASTIC,
    FELT,
    FLOW,
    FORCE,
    HEAVE,
    HEAVE_RATE,
    INERTANCE,
    OIL_1,
    OIL_FORCE,
    PITCH,
    PITCH_RATE,
    RATE,
    REBOUND_PUSH,
    RISE,
    ROAD_WORK,
    RUBBING,
    SET,
    SIDE,
    SINCE,
    SPRINGS,
    STATES,
    VALVE,
    VALVE_WORK,
    Scene,
    Vehicle,
)
from pzd.simulate.sticking import accelerate


@laid_in
def body_acceleration(car: Vehicle, load0: float, load1: float) -> tuple[float, float]:
    """Acceleration of z [m/s2] and phi [rad/s2] under the forces S + T of the axles [N].

    Equation: M d2X/dt2 + H (S + T) = 0              Source: Makowski and Knap 2021, eq. (6)
    """
    return -(load0 + load1) / car.mass, -(car.arms[0] * load0 + car.arms[1] * load1) / car.inertia


@compiled
def dynamic_forces(time: float, y: Array, scene: Scene, control: Array, desk: Array) -> None:
    """Fill the desk's forces from the state of the oil, and what each damper does with its energy."""
    car, oil = scene.car, scene.oil
    elapsed = time - control[SINCE, 0]
    for i in range(2):
        ratio, n = car.ratio[i], car.dampers[i]
        voltage, moving = felt(oil, control[SET, i], control[BEFORE, i], control[FELT, i], elapsed)
        row = row_at(oil.voltages, oil.rows, voltage)
        e = y[OIL_1 + i]
        desk[OIL_FORCE, i], desk[FLOW, i] = flowing(e, row, abs(desk[FLOW, i]))
        desk[VALVE, i] = valve_power(oil, e, row, voltage, moving)
        if oil.alone:
            desk[FORCE, i] = n * ratio * desk[OIL_FORCE, i]
            continue
        speed = desk[RATE, i]
        if scene.law.jumps and control[SIDE, i] != 0.0:
            speed = one_sided(speed, control[SIDE, i])
        beside = oil.room
        beside_at(oil, voltage, beside)
        desk[ELASTIC, i] = elastic_force(ratio * desk[DEFLECTION, i], beside)
        desk[RUBBING, i] = rubbing_force(ratio * speed, beside)
        desk[INERTANCE, i] = n * ratio * ratio * inertance(beside)
        desk[FORCE, i] = n * ratio * (desk[OIL_FORCE, i] + desk[ELASTIC, i] + desk[RUBBING, i])


@compiled
def motion(time: float, y: Array, scene: Scene, control: Array, desk: Array, dy: Array) -> None:
    """Fill `dy` with the derivative of the state: eq. (6) of Makowski and Knap 2021, S_i = k_i U_i.

    Parameters
    ----------
    time : [s]
    y : (STATES,) state
    scene : what stays the same
    control : what the controller last set
    desk : filled with deflections, forces and accelerations
    dy : (STATES,) filled
    """
    car = scene.car
    suspension(time, y, car, scene.ground, desk)
    if control[SIDE, 0] * control[SIDE, 1] == 0.0:
        _try_sides(time, y, scene, control, desk)
    _act(time, y, scene, control, desk)
    load0, load1 = desk[SPRINGS, 0] + desk[FORCE, 0], desk[SPRINGS, 1] + desk[FORCE, 1]
    desk[BODY, 0], desk[BODY, 1] = body_acceleration(car, load0, load1)
    desk[COMFORT, 0] = car.comfort[0] * load0 + car.comfort[1] * load1
    dy[HEAVE], dy[PITCH] = y[HEAVE_RATE], y[PITCH_RATE]
    dy[HEAVE_RATE], dy[PITCH_RATE] = desk[BODY, 0], desk[BODY, 1]
    for n in range(OIL_1, STATES):
        dy[n] = 0.0
    dy[ROAD_WORK] = -load0 * desk[RISE, 0] - load1 * desk[RISE, 1]
    for i in range(2):
        if scene.law.fidelity == DYNAMIC:
            _book_damper(scene, desk, i, dy)
        else:
            dy[DISSIPATED] += desk[FORCE, i] * desk[RATE, i]


@compiled
def _act(time: float, y: Array, scene: Scene, control: Array, desk: Array) -> None:
    """Fill the damper forces, and dV/dt of both axles."""
    if scene.law.fidelity == DYNAMIC:
        dynamic_forces(time, y, scene, control, desk)
    else:
        quasistatic_forces(y, scene, control, desk)
    accelerate(scene.car, control, desk)


@laid_in
def _try_sides(time: float, y: Array, scene: Scene, control: Array, desk: Array) -> None:
    """Fill how each sticking axle would be pushed away from V = 0, were it to slip to the one or the other side."""
    for i in range(2):
        if control[SIDE, i] == 0.0:
            for n in range(2):
                control[SIDE, i] = 1.0 - 2.0 * n
                _act(time, y, scene, control, desk)
                desk[REBOUND_PUSH + n, i] = control[SIDE, i] * desk[ACCELERATION, i]
            control[SIDE, i] = 0.0


@laid_in
def _book_damper(scene: Scene, desk: Array, axle: int, dy: Array) -> None:
    """Book the powers of the dampers of one axle, and the motion of its oil."""
    n, speed = scene.car.dampers[axle], scene.car.ratio[axle] * desk[RATE, axle]
    inertia = desk[INERTANCE, axle] * desk[ACCELERATION, axle] * desk[RATE, axle]
    dy[OIL_1 + axle] = speed - desk[FLOW, axle]
    dy[DISSIPATED] += n * (desk[OIL_FORCE, axle] * desk[FLOW, axle] + desk[RUBBING, axle] * speed)
    dy[VALVE_WORK] += n * desk[VALVE, axle]
    dy[BESIDE_WORK] += n * speed * desk[ELASTIC, axle] + inertia
