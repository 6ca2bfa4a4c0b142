"""What the compiled loop knows: car, road, table, oil and law as named tuples of numbers, and the state."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pzd.artefacts import Table
from pzd.compiled import compiled, inlined
from pzd.damper.compiled.columns import DRIVE, acting
from pzd.damper.compiled.kernels import (
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
from pzd.damper.flow import flow_speed
from pzd.damper.model import Damper
from pzd.damper.parameter_rows import nodes_of
from pzd.damper.regimes import spring_force
from pzd.force_table.lookup import Lookup, bracket
from pzd.record import Array
from pzd.schema.errors import DataError
from pzd.simulate.road.profile import Profile
from pzd.simulate.vehicle.car import HalfCar

# ----------------------------------------------------------------------------------------------------
# The damper with its own dynamics in the car: valve, oil spring, flow, and the forces beside the element.


_TINY = 1e-300  # m/s: a speed that only carries its sign


class DynamicDamper(NamedTuple):
    """One damper: parameter rows over the effective voltage, linear between; see `pzd.damper.compose.Nodes`."""

    voltages: Array
    rows: Array
    parallel: Array
    drive: Array
    alone: bool
    """Whether nothing stands beside the element."""
    scratch: Array
    """A row of parallel effects to work in."""
    slips: bool
    """Whether a branch beside the element remembers which way the rod went."""
    memory: Array
    """(2, 1 + b) of one damper at each axle: the extension at the last step of integration, and what each of the b
    branches was deflected by there [m]."""


@inlined
def place(nodes: Array, value: float) -> tuple[int, float]:
    """Interval of rising nodes that holds a value, and the share of it that lies below; held beyond the ends."""
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
    """Voltage as the valve feels it [V], a time after the voltage was set.

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
    """Force of the oil spring [N] at its elastic deflection [m], and the speed at which the oil flows [m/s].

    Equation: F = k e, |F| = flow curve (|dy/dt|)      Source: Makowski and Knap 2021, eq. (1) to (3)
    """
    force = spring_force(e, row)
    side = 1.0 if force >= 0.0 else -1.0
    return force, side * flow_speed(abs(force), row, side, guess)


@inlined
def rubbing_force(v: float, row: Array) -> float:
    """Friction beside the element [N] at a speed [m/s]; the sign bit of 0 picks the side."""
    moving = math.copysign(_TINY, v) if v == 0.0 else v
    return float(parallel_force(0.0, moving, 0.0, row) - parallel_force(0.0, 0.0, 0.0, row))


@inlined
def elastic_force(x: float, row: Array) -> float:
    """Force beside the element [N] at an extension [m] from where the car stands: it gives its work back.

    A force that is there at rest is carried by the static balance and left out.
    """
    return float(parallel_force(x, 0.0, 0.0, row) - parallel_force(0.0, 0.0, 0.0, row))


@inlined
def inertance(row: Array) -> float:
    """Force beside the element for each acceleration [kg]."""
    return float(parallel_force(0.0, 0.0, 1.0, row) - parallel_force(0.0, 0.0, 0.0, row))


@inlined
def slipping_forces(damper: DynamicDamper, axle: int, x: float, v: float, row: Array) -> tuple[float, float]:
    """Force [N] of the branches beside the element: the part whose work is stored, and the part that slips.

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


# ----------------------------------------------------------------------------------------------------


HEAVE, PITCH, HEAVE_RATE, PITCH_RATE, OIL_1, OIL_2, DISSIPATED, ROAD_WORK, OIL_WORK, PARALLEL_WORK = range(10)
"""The state: the body, the flow y of the oil in one damper of each axle [m], and the energies, each by itself: lost in
the dampers, given by the road, put into the oil springs by motion and into what is elastic beside the elements [J]."""
STATES = 10
ENERGIES = DISSIPATED
"""The first of them."""
WHEEL_1, WHEEL_2, WHEEL_RATE_1, WHEEL_RATE_2, TYRE_LOSS = range(STATES, STATES + 5)
"""The state goes on so where the wheels have mass: their height above where they stand at rest [m], its rate [m/s], and
the energy lost in the tyres [J]."""
STATES_WITH_WHEELS = STATES + 5
IDEAL, TABLE, DYNAMIC = range(3)
"""How a demanded force comes about."""
UNBOUNDED, BY_COEFFICIENTS, BY_TABLE = range(3)
"""What bounds a demanded force."""
FEEDBACK, SWITCH, MINIMISE, VOLTAGE, PREDICT, SCHEDULE = range(6)
"""What the policy asks for."""
SENSED = 8
"""Deflection 1, 2, its rate 1, 2, z, phi, dz, dphi: what a feedback policy reads."""


(
    DEFLECTION,
    RATE,
    RISE,
    LIFT,
    SPRINGS,
    FORCE,
    ACCELERATION,
    INERTANCE,
    OIL_DEFLECTION,
    OIL_FORCE,
    FLOW,
    ELASTIC,
    RUBBING,
    SIDED_RATE,
    LOW,
    HIGH,
    BODY,
    COMFORT,
    REBOUND_PUSH,
    COMPRESSION_PUSH,
    ROAD_RISE,
    CONTACT,
    TYRE_POWER,
) = range(23)
WORKSPACE_ROWS = 23
"""Rows of the workspace (WORKSPACE_ROWS, 2), a column an axle: intermediate results of the equations of motion.

Deflection U [m], its rate V [m/s], speed of the wheel and its acceleration without S + T (those of the road where the
wheels have no mass), spring force S and damper force T [N], dV/dt, mass that the dampers add [kg]; of one damper:
elastic deflection of the oil [m], force of the oil spring [N], flow [m/s], elastic and rubbing force beside the
element [N]; speed on its side of zero, lowest and highest force; acceleration of z and phi; acceleration at K (first
column); of an axle that sticks, dV/dt away from V = 0, were it to slip to either side; speed of the road [m/s]; force
between wheel and road beyond that at rest [N]; power lost in the tyre [W]."""
ASKED, SET, SIDE, SINCE, HARD, BEHIND = range(6)
TIE_END = SINCE
"""Rows of the control (BEHIND + d, 2), a column an axle: force asked [N], voltage set [V]; side of V = 0 (+1 rebound,
-1 compression, 0 sticking); when the voltage was set [s] (first column), and the end of the segment of minimisers
that `largest` takes (TIE_END, second column); whether a damper is to be hard (1) or soft (0); from BEHIND on the
voltages behind the d drive effects, in the order in which they act, when the voltage was set [V]."""

Two = tuple[float, float]


class Vehicle(NamedTuple):
    """The half-car; see `HalfCar`."""

    mass: float
    inertia: float
    arms: Two
    """Second row of H: -a1, a2 [m]."""
    stiffness: Two
    comfort: Two
    """D of eq. (9) [1/kg]."""
    mobility: tuple[float, float, float]
    """W11, W22 and W12 of W, see `HalfCar.mobility` [1/kg]."""
    ratio: Two
    dampers: Two
    speed: float
    wheels: bool
    """Whether the wheels have mass; what follows counts only then."""
    unsprung: Two
    tyre_stiffness: Two
    tyre_damping: Two
    static_load: Two
    """N_10, N_20 [N]."""


class RoadCoefficients(NamedTuple):
    """The road; see `Profile`."""

    amplitude: float
    wavenumber: float
    spacing: float
    behind: Two
    """How far each axle follows the first [m]."""
    coefficients: Array


class TableArrays(NamedTuple):
    """The table at the temperature of the ride; see `pzd.force_table.lookup.Lookup`."""

    voltages: Array
    speeds: Array
    rebound: Array
    compression: Array
    reach: Array


class ControlSpec(NamedTuple):
    """Policy, bounds and fidelity as numbers."""

    fidelity: int
    aim: int
    bounds: int
    tie: int
    c_min: float
    c_max: float
    voltage: float
    """Of the aim `VOLTAGE` [V], and where the valves stand at the start."""
    jumps: bool
    """Whether the force jumps where the suspension speed crosses zero, so that an axle can stick."""
    crossover: float
    """Of the aim `SWITCH` [rad/s]."""
    gains: Array
    """(2, SENSED) of the aims `FEEDBACK` and `SWITCH`."""
    schedule: Array
    """(2, n) of the aim `SCHEDULE`, over a period of the harmonic of the road [V]."""


class RideModel(NamedTuple):
    """All that stays the same during a ride."""

    car: Vehicle
    road_coefficients: RoadCoefficients
    control_spec: ControlSpec
    grid: TableArrays
    damper: DynamicDamper


def vehicle(car: HalfCar, speed: float) -> Vehicle:
    """The car as numbers; speed of the vehicle in m/s."""
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
    """The road as numbers; axle 2 follows by the wheelbase [m]."""
    return RoadCoefficients(
        float(profile.amplitude),
        float(profile.wavenumber),
        float(profile.spacing),
        (0.0, float(wheelbase)),
        np.ascontiguousarray(profile.coefficients),
    )


def control(voltage: float) -> Array:
    """The controller before its first act, the valves at rest at a voltage [V]."""
    table = np.zeros((BEHIND + len(acting("drive")), 2))
    table[SET] = table[BEHIND:] = voltage
    table[SIDE] = 1.0
    return table


def at_rest(car: Vehicle) -> Array:
    """The state of a car that stands on a level road."""
    return np.zeros(STATES_WITH_WHEELS if car.wheels else STATES)


def workspace() -> Array:
    """Empty room to work in."""
    return np.zeros((WORKSPACE_ROWS, 2))


# ----------------------------------------------------------------------------------------------------
# The damper of a ride as arrays: its table, and its nodes with the lag of the valve.


LEAST_RELAXATION = 1e-5
"""An oil spring that relaxes faster than this [s] is rigid for a car, and is taken as this fast."""


def grid_of(table: Table, temperature: float | None) -> TableArrays:
    """The table at one temperature [degC], as the compiled loop reads it."""
    lookup = Lookup.of(table, temperature)
    return TableArrays(lookup.voltages, lookup.speeds, lookup.rebound, lookup.compression, lookup.envelope)


def table_of(damper: Damper, table: Table) -> Table:
    """The table that another damper would have at the same nodes: what the plain one promises.

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
    """The damper at one temperature, as the compiled loop reads it.

    Parameters
    ----------
    damper : with its effects
    temperature : [degC]
    valve : time constant of the valve where the damper has no `valve_lag` of its own [s]
    """
    nodes = nodes_of(damper, temperature)
    rows = np.array(nodes.rows)
    rows[:, K] = np.minimum(rows[:, K], rows[:, C] / LEAST_RELAXATION)
    drive = np.array(nodes.drive)
    if "valve_lag" not in damper.effects:
        drive[DRIVE.index(("valve_lag", "tau"))] = valve
    parallel = np.ascontiguousarray(nodes.parallel)
    remembers = any_slips(parallel)
    alone = not (remembers or any(_is_parallel(row) for row in parallel))
    room, memory = np.zeros(parallel.shape[1]), np.zeros((2, 1 + BRANCHES))
    return DynamicDamper(nodes.voltages, rows, parallel, drive, alone, room, remembers, memory)


def rubs(dynamic: DynamicDamper) -> bool:
    """Whether friction beside the element jumps where the speed crosses zero."""
    tiny = np.finfo(np.float64).tiny
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
    apart = min(
        float(parallel_force(0.0, 0.0, 1.0, row) - parallel_force(0.0, 0.0, 0.0, row)) for row in dynamic.parallel
    )
    per_axle = apart * max(n * r * r for n, r in zip(car.dampers, car.motion_ratios, strict=True))
    mobility = np.max(np.linalg.eigvalsh(car.mobility()))
    if 1.0 + per_axle * mobility <= 0.0:
        raise DataError(f"3-diagnose/damper.yaml: effects.fluid_inertia: {apart:g} kg outweighs what the axles carry")
