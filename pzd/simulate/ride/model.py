"""The ride as arrays and named tuples: the layout of the state, and car, road, table, damper and law as numbers."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from pzd.artefacts import Table
from pzd.compiled import compiled, inlined
from pzd.damper.compiled.columns import DRIVE, acting
from pzd.damper.compiled.kernels import (
    T0,
    C,
    K,
    Row,
    branch_force,
    branch_stored,
    branches_follow,
    effective_voltage_after,
    parallel_force,
)
from pzd.damper.compose import BRANCHES, any_slips, steady_force
from pzd.damper.confounders import known
from pzd.damper.flow import breakaway, flow_force, flow_speed
from pzd.damper.model import Damper
from pzd.damper.parameter_rows import nodes_of
from pzd.damper.regimes import spring_force
from pzd.force_table.lookup import Lookup, bracket
from pzd.record import Array
from pzd.schema.errors import DataError
from pzd.simulate.policies import Aim
from pzd.simulate.roads import Profile
from pzd.simulate.vehicle.car import HalfCar

# --- State, workspace and control: which place of an array holds what ---


class State(IntEnum):
    """Places of the state (n,): the body, the oil of one damper at each axle, energies, and wheels with mass."""

    HEAVE = 0
    """z, height of the centre of gravity above rest [m]."""
    PITCH = 1
    """phi [rad]."""
    HEAVE_RATE = 2
    """dz/dt [m/s]."""
    PITCH_RATE = 3
    """dphi/dt [rad/s]."""
    OIL_1 = 4
    """y, how far the oil of one damper at axle 1 has flowed [m]."""
    OIL_2 = 5
    """The same at axle 2 [m]."""
    DISSIPATED = 6
    """Energy lost in the dampers [J]; this and the three that follow are each integrated by themselves."""
    ROAD_WORK = 7
    """Energy given by the road [J]."""
    OIL_WORK = 8
    """Energy put into the oil stiffnesses by motion [J]."""
    PARALLEL_WORK = 9
    """Energy put into what is elastic or inert beside the elements [J]."""
    WHEEL_1 = 10
    """Height of the wheels of axle 1 above where they stand at rest [m]; from here on only where wheels have mass."""
    WHEEL_2 = 11
    """The same at axle 2 [m]."""
    WHEEL_RATE_1 = 12
    """Speed of the wheels of axle 1 [m/s]."""
    WHEEL_RATE_2 = 13
    """The same at axle 2 [m/s]."""
    TYRE_LOSS = 14
    """Energy lost in the tyres [J]."""


STATES, STATES_WITH_WHEELS = int(State.WHEEL_1), len(State)
"""Length of the state of a car whose wheels have no mass, or have mass."""


class Axle(IntEnum):
    """Rows of the workspace (WORKSPACE_ROWS, 2), a column an axle: intermediate results of the equations of motion."""

    DEFLECTION = 0
    """U of the suspension [m]."""
    RATE = 1
    """V = dU/dt [m/s]."""
    RISE = 2
    """Speed of the wheel: that of the road where wheels have no mass [m/s]."""
    LIFT = 3
    """Acceleration of the wheel without S + T: that of the road where wheels have no mass [m/s2]."""
    SPRINGS = 4
    """Spring force S [N]."""
    FORCE = 5
    """Damper force T [N]."""
    ACCELERATION = 6
    """dV/dt [m/s2]."""
    INERTANCE = 7
    """Mass that the dampers add [kg]."""
    OIL_DEFLECTION = 8
    """Elastic deflection x - y of the oil of one damper [m]."""
    OIL_FORCE = 9
    """Force of the element of one damper [N]."""
    FLOW = 10
    """Speed dy/dt of the flow in one damper [m/s]."""
    ELASTIC = 11
    """Elastic force beside the element of one damper [N]."""
    RUBBING = 12
    """Friction beside the element of one damper [N]."""
    SIDED_RATE = 13
    """V held on its side of zero [m/s]."""
    LOW = 14
    """Lowest admissible force [N]."""
    HIGH = 15
    """Highest admissible force [N]."""
    BODY = 16
    """Acceleration of z [m/s2] and of phi [rad/s2], not of an axle each."""
    COMFORT = 17
    """Acceleration at K, in the first column [m/s2]."""
    REBOUND_PUSH = 18
    """Of an axle that sticks: dV/dt away from V = 0, were it to slip towards rebound [m/s2]."""
    COMPRESSION_PUSH = 19
    """The same towards compression [m/s2]."""
    ROAD_RISE = 20
    """Speed of the road under the axle [m/s]."""
    CONTACT = 21
    """Force between wheel and road beyond that at rest [N]."""
    TYRE_POWER = 22
    """Power lost in the tyres [W]."""


WORKSPACE_ROWS = len(Axle)


class Command(IntEnum):
    """Rows of the control (BEHIND + d, 2), a column an axle: what the controller last did."""

    ASKED = 0
    """Force asked [N]."""
    SET = 1
    """Voltage set [V]."""
    SIDE = 2
    """Side of V = 0 that the axle is on: +1 rebound, -1 compression, 0 sticking."""
    SINCE = 3
    """When the voltage was set, in the first column [s]."""
    TIE_END = 3
    """End of the segment of minimisers that the tie-break `largest` takes, in the second column of the same row."""
    HARD = 4
    """Whether a switched damper is hard (1) or soft (0)."""
    BEHIND = 5
    """From here on the voltages behind the d drive effects, in the order in which they act, when it was set [V]."""


IDEAL, TABLE, DYNAMIC = range(3)
FIDELITIES = {"ideal": IDEAL, "table": TABLE, "dynamic": DYNAMIC}
"""How a demanded force comes about."""
UNBOUNDED, BY_COEFFICIENTS, BY_TABLE = range(3)
"""What bounds a demanded force."""
FEEDBACK, SWITCH, MINIMISE, VOLTAGE, PREDICT, SCHEDULE = range(6)
AIMS: dict[Aim, int] = {
    "damping": FEEDBACK,
    "feedback": FEEDBACK,
    "switch": SWITCH,
    "minimise": MINIMISE,
    "voltage": VOLTAGE,
    "predict": PREDICT,
    "schedule": SCHEDULE,
}
"""What the policy asks for."""


# --- Car, road, table and law as numbers ---

Two = tuple[float, float]
"""Of axle 1, then axle 2."""


class Vehicle(NamedTuple):
    """The half-car as numbers; see `HalfCar`."""

    mass: float
    """Body mass m [kg]."""
    inertia: float
    """J_y [kg m2]."""
    arms: Two
    """Second row of H: -a1, a2 [m]."""
    stiffness: Two
    """k_1, k_2 [N/m]."""
    comfort: Two
    """D of eq. (9) [1/kg]."""
    mobility: tuple[float, float, float]
    """W11, W22 and W12 of W, see `HalfCar.mobility` [1/kg]."""
    ratio: Two
    """Motion ratio r, damper extension over suspension deflection [-]."""
    dampers: Two
    """Number n of dampers at each axle [-]."""
    speed: float
    """Of the vehicle [m/s]."""
    wheels: bool
    """Whether the wheels have mass; what follows counts only then."""
    unsprung: Two
    """m_1, m_2 [kg]."""
    tyre_stiffness: Two
    """k_t1, k_t2 [N/m]."""
    tyre_damping: Two
    """c_t1, c_t2 [N s/m]."""
    static_load: Two
    """N_10, N_20 [N]."""


class RoadCoefficients(NamedTuple):
    """The road as numbers; see `Profile`."""

    amplitude: float
    """Of the harmonic [m]."""
    wavenumber: float
    """Of the harmonic [rad/m]."""
    spacing: float
    """Of the knots of the spline [m]."""
    behind: Two
    """How far each axle follows the first [m]."""
    coefficients: Array
    """(n + 4,) of the spline over n knots [m]; none where the harmonic is the whole road."""


class TableArrays(NamedTuple):
    """The table at the temperature of the ride; see `pzd.force_table.lookup.Lookup`."""

    voltages: Array
    """(m,) rising [V]."""
    speeds: Array
    """(n,) rising [m/s]."""
    rebound: Array
    """(m, n) force of one damper in rebound [N]."""
    compression: Array
    """(m, n) force of one damper in compression [N]."""
    reach: Array
    """(m,) fastest speed of the rig at each voltage [m/s]."""
    stroke: float
    """Farthest that a test of the rig went from the middle of the stroke [m]; infinite where that is not known."""


class ControlSpec(NamedTuple):
    """Policy, bounds and fidelity as numbers."""

    fidelity: int
    """`IDEAL`, `TABLE` or `DYNAMIC`."""
    aim: int
    """`FEEDBACK` to `SCHEDULE`."""
    bounds: int
    """`UNBOUNDED`, `BY_COEFFICIENTS` or `BY_TABLE`."""
    tie: int
    """See `pzd.simulate.control.demand.TIE_BREAKS`."""
    c_min: float
    """Least damping coefficient of an axle, of `BY_COEFFICIENTS` [N s/m]."""
    c_max: float
    """Largest damping coefficient of an axle, of `BY_COEFFICIENTS` [N s/m]."""
    voltage: float
    """Of the aim `VOLTAGE` [V], and where the valves stand at the start."""
    jumps: bool
    """Whether the force jumps where the suspension speed crosses zero, so that an axle can stick."""
    crossover: float
    """Of the aim `SWITCH` [rad/s]."""
    gains: Array
    """(2, SENSED) of the aims `FEEDBACK` and `SWITCH`, see `pzd.simulate.policies`."""
    schedule: Array
    """(2, n) of the aim `SCHEDULE`, over a period of the harmonic of the road [V]."""


class RideModel(NamedTuple):
    """All that stays the same during a ride."""

    car: Vehicle
    road_coefficients: RoadCoefficients
    control_spec: ControlSpec
    grid: TableArrays
    """Of axle 1."""
    damper: DynamicDamper
    """Of axle 1."""
    rear_grid: TableArrays
    """Of axle 2."""
    rear_damper: DynamicDamper
    """Of axle 2."""


class RunningRide(NamedTuple):
    """A ride under way."""

    model: RideModel
    control: Array
    """(BEHIND + d, 2) what the controller last did, see `Command`."""
    workspace: Array
    """(WORKSPACE_ROWS, 2) intermediate results, see `Axle`."""


@inlined
def grid_at(model: RideModel, axle: int) -> TableArrays:
    """Return the table of the dampers of an axle."""
    return model.grid if axle == 0 else model.rear_grid


@inlined
def damper_at(model: RideModel, axle: int) -> DynamicDamper:
    """Return the damper of an axle."""
    return model.damper if axle == 0 else model.rear_damper


def vehicle(car: HalfCar, speed: float) -> Vehicle:
    """Return the car as numbers, at a speed of the vehicle [m/s]."""
    H, D, W = car.force_directions(), car.force_to_comfort(), car.mobility()
    one, two = car.static_loads()
    return Vehicle(
        float(car.mass),
        float(car.pitch_inertia),
        (float(H[1, 0]), float(H[1, 1])),
        (float(car.stiffnesses[0]), float(car.stiffnesses[1])),
        (float(D[0]), float(D[1])),
        (float(W[0, 0]), float(W[1, 1]), float(W[0, 1])),
        (float(car.motion_ratios[0]), float(car.motion_ratios[1])),
        (float(car.dampers[0]), float(car.dampers[1])),
        float(speed),
        car.wheels_have_mass,
        (float(car.unsprung_masses[0]), float(car.unsprung_masses[1])),
        (float(car.tyre_stiffnesses[0]), float(car.tyre_stiffnesses[1])),
        (float(car.tyre_dampings[0]), float(car.tyre_dampings[1])),
        (float(one), float(two)),
    )


def road_coefficients(profile: Profile, wheelbase: float) -> RoadCoefficients:
    """Return the road as numbers; axle 2 follows by the wheelbase [m]."""
    return RoadCoefficients(
        float(profile.amplitude),
        float(profile.wavenumber),
        float(profile.spacing),
        (0.0, float(wheelbase)),
        np.ascontiguousarray(profile.coefficients),
    )


def ride_of(model: RideModel) -> RunningRide:
    """Return a ride before its first act, the valves at rest at the voltage of the policy."""
    control = np.zeros((Command.BEHIND + len(acting("drive")), 2))
    control[Command.SET] = control[Command.BEHIND :] = model.control_spec.voltage
    control[Command.SIDE] = 1.0
    return RunningRide(model, control, workspace())


def at_rest(car: Vehicle) -> Array:
    """Return the state of a car that stands on a level road."""
    return np.zeros(STATES_WITH_WHEELS if car.wheels else STATES)


def workspace() -> Array:
    """Return an empty workspace, see `Axle`."""
    return np.zeros((WORKSPACE_ROWS, 2))


# --- The damper with its own dynamics: valve, oil stiffness, flow, and the forces beside the element ---

_TINY = 1e-300
"""A speed that only carries its sign [m/s]."""


class DynamicDamper(NamedTuple):
    """One damper at one temperature, its parameters linear over the effective voltage and held beyond.

    See `pzd.damper.parameter_rows.DamperNodes`; the memory is that of one damper at each axle.
    """

    voltages: Array
    """(m,) nodes, rising [V]."""
    rows: Array
    """(m, r) parameters of stroke, element and flow at each node, SI."""
    parallel: Array
    """(m, p) parameters of the parallel effects at each node, SI."""
    drive: Array
    """(d,) parameters of the drive effects, SI."""
    alone: bool
    """Whether no effect acts beside the element."""
    scratch: Array
    """(p,) a row of parallel effects to work in."""
    slips: bool
    """Whether a branch beside the element remembers which way the rod went."""
    memory: Array
    """(2, 1 + b) of one damper at each axle: the extension at the last step of integration, and what each of the b
    branches was deflected by there [m]."""
    rigid: bool
    """Whether the oil is so stiff that the flow has the speed of the rod: F = T0 sign(v) + C v, any force up to T0 at
    rest."""


@inlined
def place(nodes: Array, value: float) -> tuple[int, float]:
    """Return the interval of rising nodes that holds a value, and the share of it below; held beyond the ends."""
    if nodes.size == 1 or value <= nodes[0]:
        return 0, 0.0
    if value >= nodes[-1]:
        return nodes.size - 1, 0.0
    i = bracket(nodes, value)
    return i, (value - nodes[i]) / (nodes[i + 1] - nodes[i])


@inlined
def parallel_at(damper: DynamicDamper, voltage: float, row: Array) -> None:
    """Fill `row` with the parameters of the parallel effects at an effective voltage: linear between, held beyond."""
    i, share = place(damper.voltages, voltage)
    for j in range(row.size):
        row[j] = damper.parallel[i, j] + share * (
            damper.parallel[min(i + 1, damper.voltages.size - 1), j] - damper.parallel[i, j]
        )


@compiled
def effective_voltage(damper: DynamicDamper, voltage: float, kept: Array, elapsed: float) -> float:
    """Return the effective voltage at the valve [V], a time after the voltage was set.

    Parameters
    ----------
    damper : the damper
    voltage : set by the controller, and held since [V]
    kept : (d,) voltage behind each drive effect when it was set [V]
    elapsed : time since [s]
    """
    effective, _ = effective_voltage_after(voltage, elapsed, kept, damper.drive)
    return effective


@inlined
def flowing(e: float, row: Row, guess: float) -> tuple[float, float]:
    """Return the force of the oil stiffness [N] at an elastic deflection [m], and the speed of the flow [m/s].

    Equation: F = k e, |F| = flow curve (|dy/dt|)      Source: Makowski and Knap 2021, eq. (1) to (3)
    """
    force = spring_force(e, row)
    side = 1.0 if force >= 0.0 else -1.0
    return force, side * flow_speed(abs(force), row, side, guess)


@inlined
def rigid_force(v: float, row: Row) -> float:
    """Return the force of a rigid element [N] at a speed of the rod [m/s]; the sign bit of 0 picks the side.

    Equation: F = sign(v) flow curve (|v|)              Source: eq. (1) to (3) as k goes to infinity
    """
    side = math.copysign(1.0, v)
    return side * flow_force(abs(v), row, side)


@inlined
def rubbing_force(v: float, row: Array) -> float:
    """Return the friction beside the element [N] at a speed [m/s]; the sign bit of 0 picks the side."""
    moving = math.copysign(_TINY, v) if v == 0.0 else v
    return float(parallel_force(0.0, moving, 0.0, row) - parallel_force(0.0, 0.0, 0.0, row))


@inlined
def elastic_force(x: float, row: Array) -> float:
    """Return the elastic force beside the element [N] at an extension [m] from where the car stands.

    A force that is there at rest is carried by the static balance and left out.
    """
    return float(parallel_force(x, 0.0, 0.0, row) - parallel_force(0.0, 0.0, 0.0, row))


@inlined
def inertance(row: Array) -> float:
    """Return the force beside the element for each acceleration [kg]."""
    return float(parallel_force(0.0, 0.0, 1.0, row) - parallel_force(0.0, 0.0, 0.0, row))


@inlined
def slipping_forces(damper: DynamicDamper, axle: int, x: float, v: float, row: Array) -> tuple[float, float]:
    """Split the force of the branches beside the element [N]: the part whose work is stored, and that which slips.

    Parameters
    ----------
    damper : the damper, its memory of the last step
    axle : 0 or 1
    x : extension [m], reached from there without turning round
    v : its speed [m/s]; the sign bit of 0 picks the side
    row : of the parallel effects
    """
    memory, side = damper.memory[axle], math.copysign(1.0, v)
    travel = side * max(side * (x - memory[0]), 0.0)  # a rounding the other way would count as turning round
    stored = branch_stored(travel, side, memory[1:], row)
    return stored, branch_force(travel, memory[1:], row) - stored


@inlined
def remember(damper: DynamicDamper, axle: int, x: float, row: Array) -> None:
    """Bring the branches of an axle to an extension [m], reached without turning round; by one row."""
    memory = damper.memory[axle]
    branches_follow(x - memory[0], memory[1:], row)
    memory[0] = x


# --- Table and damper as arrays ---

LEAST_RELAXATION = 1e-5
"""Relaxation C/k [s] down to which the flow of the oil is integrated.

Reason: a hundredth of a step. Where it is faster the oil is rigid, or all but plastic: see `dynamic_damper_of`."""
LEAST_PLASTIC_RELAXATION = 1e-6
"""Relaxation of an oil that is soft and hardly damps [s]: C is raised to this times k.

Reason: at 1 m/s it adds a deflection of 1 um, or a hundredth of the friction where `RIGID_DEFLECTION` begins."""
RIGID_DEFLECTION = 1e-4
"""Deflection of the oil under the dry friction [m] up to which it counts as none.

Reason: below the play of the bushes that a damper hangs in."""


def grid_of(table: Table, temperature: float | None) -> TableArrays:
    """Return the table at one temperature [degC], as the compiled loop reads it."""
    lookup = Lookup.of(table, temperature)
    stroke = table.notes.reached_stroke_m
    return TableArrays(
        lookup.voltages,
        lookup.speeds,
        lookup.rebound,
        lookup.compression,
        lookup.envelope,
        math.inf if stroke is None else stroke,
    )


def table_of(damper: Damper, table: Table) -> Table:
    """Return the table that another damper would have at the same nodes, such as that before diagnose.

    Parameters
    ----------
    damper : the other damper
    table : whose nodes, reach and rule for what lies outside are kept

    Returns
    -------
    the table without its inverse
    """
    held = {(row.temperature_degC, row.voltage_V): 0.0 for row in table.force}
    for row in table.force:
        key = (row.temperature_degC, row.voltage_V)
        if row.inside == 1 or table.notes.outside != "clamp":
            held[key] = max(held[key], abs(row.velocity_m_per_s))
    forces = np.zeros(len(table.force))
    for conditions, fastest in held.items():
        places = [i for i, row in enumerate(table.force) if (row.temperature_degC, row.voltage_V) == conditions]
        asked = [table.force[i].velocity_m_per_s for i in places]
        velocity = np.copysign(np.minimum(np.abs(asked), fastest), asked)
        forces[places] = steady_force(damper, conditions[1], conditions[0], velocity)
    rows = (
        row if row.force_N is None else row.model_copy(update={"force_N": float(force)})
        for row, force in zip(table.force, forces, strict=True)
    )
    return Table(tuple(rows), (), table.notes)


def dynamic_damper_of(damper: Damper, temperature: float | None, valve: float) -> DynamicDamper:
    """Return the damper at one temperature, as the compiled loop reads it.

    An oil that relaxes faster than `LEAST_RELAXATION` at every node has a form of its own. It is rigid where the
    friction deflects it by less than `RIGID_DEFLECTION` and no effect acts on its stroke. Else it is soft and hardly
    damps, and C is raised to what can be integrated.

    Parameters
    ----------
    damper : with its effects
    temperature : [degC]
    valve : time constant of the valve where the damper has no `valve_lag` of its own [s]
    """
    nodes = nodes_of(damper, temperature)
    rows = np.array(nodes.rows)
    fast = rows[:, C] < LEAST_RELAXATION * rows[:, K]
    stiff = rows[:, T0] <= RIGID_DEFLECTION * rows[:, K]
    rigid = bool(np.all(fast & stiff)) and all(known()[name].place != "stroke" for name in damper.effects)
    # The plant of the predictive control keeps an oil spring, as stiff as its step resolves.
    capped = np.minimum(rows[:, K], np.maximum(rows[:, C], 1.0) / LEAST_RELAXATION)
    rows[:, K] = np.where(fast & stiff, capped, rows[:, K])
    rows[:, C] = np.where(fast & ~stiff, np.maximum(rows[:, C], LEAST_PLASTIC_RELAXATION * rows[:, K]), rows[:, C])
    drive = np.array(nodes.drive)
    if "valve_lag" not in damper.effects:
        drive[DRIVE.index(("valve_lag", "tau"))] = valve
    parallel = np.ascontiguousarray(nodes.parallel)
    remembers = any_slips(parallel)
    alone = not (remembers or any(_is_parallel(row) for row in parallel))
    scratch, memory = np.zeros(parallel.shape[1]), np.zeros((2, 1 + BRANCHES))
    return DynamicDamper(nodes.voltages, rows, parallel, drive, alone, scratch, remembers, memory, rigid)


def rubs(dynamic: DynamicDamper) -> bool:
    """Tell whether friction beside the element, or that of a rigid one, jumps where the speed crosses zero."""
    tiny = np.finfo(np.float64).tiny
    if dynamic.rigid and any(breakaway(row, side) > 0.0 for row in dynamic.rows for side in (1.0, -1.0)):
        return True
    return any(parallel_force(0.0, tiny, 0.0, row) != parallel_force(0.0, 0.0, 0.0, row) for row in dynamic.parallel)


def _is_parallel(row: Array) -> bool:
    rest = parallel_force(0.0, 0.0, 0.0, row)
    tries = [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1e-6, 0.0), (0.0, -1e-6, 0.0), (0.0, 0.0, 1.0)]
    return any(parallel_force(x, v, a, row) != rest for x, v, a in tries)


def check_inertance(dynamic: DynamicDamper, car: HalfCar) -> None:
    """Refuse a damper whose apparent mass would outweigh the car's.

    Raises
    ------
    DataError : when it would
    """
    apart = min(inertance(row) for row in dynamic.parallel)
    per_axle = apart * max(n * r * r for n, r in zip(car.dampers, car.motion_ratios, strict=True))
    mobility = np.max(np.linalg.eigvalsh(car.mobility()))
    if 1.0 + per_axle * mobility <= 0.0:
        raise DataError(f"3-diagnose/damper.yaml: effects.fluid_inertia: {apart:g} kg outweighs what the axles carry")
