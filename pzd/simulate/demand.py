"""The force that the policy asks of each axle, within the box Omega(V)."""

from __future__ import annotations

import math

from pzd.compiled import compiled, inlined
from pzd.record import Array
from pzd.simulate.admissible import coefficient_bounds, table_bounds
from pzd.simulate.minimise import LEAST_LOAD, least_acceleration_forces, least_load_forces
from pzd.simulate.ride_model import (
    BODY,
    BY_COEFFICIENTS,
    BY_TABLE,
    DEFLECTION,
    FORCE,
    HARD,
    HEAVE,
    HEAVE_RATE,
    HIGH,
    LOW,
    MINIMISE,
    PITCH,
    PITCH_RATE,
    RATE,
    SIDED_RATE,
    SWITCH,
    TIE_END,
    ControlSpec,
    TableArrays,
    Vehicle,
)
from pzd.simulate.switching import is_hard, switched_force


@inlined
def one_sided(velocity: float, side: float) -> float:
    """The velocity held on the side of zero that an axle is on (+1, -1); the sign bit of 0 carries the side."""
    return math.copysign(max(side * velocity, 0.0), side)


@compiled
def bounds_of(
    control_spec: ControlSpec, car: Vehicle, grid: TableArrays, axle: int, velocity: float
) -> tuple[float, float]:
    """Lowest and highest force of an axle [N] at a suspension speed [m/s]."""
    if control_spec.bounds == BY_COEFFICIENTS:
        return coefficient_bounds(velocity, control_spec.c_min, control_spec.c_max)
    if control_spec.bounds == BY_TABLE:
        return table_bounds(velocity, car.ratio[axle], car.dampers[axle], grid.speeds, grid.rebound, grid.compression)
    return -math.inf, math.inf


@inlined
def feedback_force(gains: Array, y: Array, workspace: Array) -> float:
    """What a policy makes of what it senses at one axle: gains (8,) on `SENSED`; a force [N], or what switches."""
    force = gains[4] * y[HEAVE] + gains[5] * y[PITCH] + gains[6] * y[HEAVE_RATE] + gains[7] * y[PITCH_RATE]
    for i in range(2):
        force += gains[i] * workspace[DEFLECTION, i] + gains[2 + i] * workspace[RATE, i]
    return float(force)


@compiled
def spring_acceleration(car: Vehicle, deflection: Array) -> float:
    """Acceleration at K by the springs alone [m/s2].

    Equation: a_0 = D^T S, S_i = k_i U_i      Source: Makowski and Knap 2021, eq. (9)
    """
    a0 = 0.0
    for i in range(2):
        a0 += car.comfort[i] * car.stiffness[i] * deflection[i]
    return a0


@compiled
def choose_hardness(control_spec: ControlSpec, car: Vehicle, y: Array, control: Array, workspace: Array) -> None:
    """Fill whether each damper is to be hard, by the workspace as the motion left it."""
    for i in range(2):
        signal = feedback_force(control_spec.gains[i], y, workspace)
        acceleration = workspace[BODY, 0] + car.arms[i] * workspace[BODY, 1]
        hard = is_hard(workspace[RATE, i], signal, acceleration, control_spec.crossover)
        control[HARD, i] = 1.0 if hard else 0.0


@inlined
def wanted_force(control_spec: ControlSpec, axle: int, y: Array, control: Array, workspace: Array) -> float:
    """What a feedback or a switch asks of one axle within the workspace's bounds [N]."""
    low, high = workspace[LOW, axle], workspace[HIGH, axle]
    if control_spec.aim == SWITCH:
        return switched_force(control[HARD, axle] > 0.0, workspace[SIDED_RATE, axle], low, high)
    return float(min(max(feedback_force(control_spec.gains[axle], y, workspace), low), high))


@compiled
def demand(control_spec: ControlSpec, car: Vehicle, y: Array, control: Array, workspace: Array) -> None:
    """Fill the workspace's forces with what the policy asks of both axles within the workspace's bounds [N]."""
    if control_spec.aim == MINIMISE and control_spec.tie == LEAST_LOAD:
        springs = (car.stiffness[0] * workspace[DEFLECTION, 0], car.stiffness[1] * workspace[DEFLECTION, 1])
        least_load_forces(springs, car.comfort, workspace[LOW], workspace[HIGH], workspace[FORCE])
        return
    if control_spec.aim == MINIMISE:
        a0 = spring_acceleration(car, workspace[DEFLECTION])
        least_acceleration_forces(
            a0,
            car.comfort,
            workspace[LOW],
            workspace[HIGH],
            control_spec.tie,
            int(control[TIE_END, 1]),
            workspace[FORCE],
        )
        return
    for i in range(2):
        workspace[FORCE, i] = wanted_force(control_spec, i, y, control, workspace)
