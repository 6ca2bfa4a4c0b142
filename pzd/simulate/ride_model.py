"""What the compiled loop knows: car, road, table, oil and law as named tuples of numbers, and the state."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pzd.damper.columns import acting
from pzd.record import Array
from pzd.simulate.car import HalfCar
from pzd.simulate.dynamic_damper import DynamicDamper
from pzd.simulate.profile import Profile

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
    """The table at the temperature of the ride; see `pzd.table.lookup.Lookup`."""

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
