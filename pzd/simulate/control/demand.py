"""The force that a policy demands of each axle, within the box Omega(V) of admissible forces."""

from __future__ import annotations

import math

from pzd.compiled import compiled, inlined
from pzd.force_table.lookup import table_range
from pzd.record import Array
from pzd.simulate.policies import TieBreak
from pzd.simulate.ride.model import (
    BY_COEFFICIENTS,
    BY_TABLE,
    MINIMISE,
    SWITCH,
    Axle,
    Command,
    ControlSpec,
    RunningRide,
    State,
    TableArrays,
    Vehicle,
)

# --- The box Omega(V) of admissible forces ---


@compiled
def bounds_of(
    control_spec: ControlSpec, car: Vehicle, grid: TableArrays, axle: int, velocity: float
) -> tuple[float, float]:
    """Return the lowest and the highest force of an axle [N].

    Equation: T_i in [c_min V_i, c_max V_i], or T_i in {n r F(U, r V_i): U_min <= U <= U_max} by the table, r the motion
    ratio and n the number of dampers      Source: Makowski and Knap 2021, eq. (11) and section 5

    Parameters
    ----------
    control_spec : by which of its bounds, if any
    car, grid : the half-car and the table
    axle : i, 0 or 1
    velocity : suspension speed V_i; the sign bit of 0 picks the side [m/s]
    """
    if control_spec.bounds == BY_COEFFICIENTS:
        one, other = control_spec.c_min * velocity, control_spec.c_max * velocity
        return (one, other) if velocity >= 0.0 else (other, one)
    if control_spec.bounds == BY_TABLE:
        ratio, dampers = car.ratio[axle], car.dampers[axle]
        low, high = table_range(grid.speeds, grid.rebound, grid.compression, ratio * velocity)
        return dampers * ratio * low, dampers * ratio * high
    return -math.inf, math.inf


# --- Laws that switch each damper between its hardest and its softest state ---


@inlined
def is_hard(rate: float, signal: float, acceleration: float, crossover: float) -> bool:
    """Decide whether a switched damper is to be hard.

    Equation: hard where p V > 0, else soft; p = s where |a| <= w_c |s|, else p = a
    Source: Savaresi and Spelta 2007, J. Dyn. Sys. Meas. Control 129(4), with s = dz_i/dt: a damper that pulls the body
    against its motion (p V > 0) is hard. w_c = 0 leaves the acceleration alone, w_c without bound the signal

    Parameters
    ----------
    rate : V_i, speed of the suspension [m/s]
    signal : s that a policy makes of what it senses; its unit goes with that of w_c
    acceleration : a = d2z_i/dt2 of the body above the axle [m/s2]
    crossover : w_c [rad/s]
    """
    decides = acceleration if abs(acceleration) > crossover * abs(signal) else signal
    return decides * rate > 0.0


@inlined
def switched_force(hard: bool, rate: float, low: float, high: float) -> float:
    """Return the end of the box Omega(V) that is a hard or a soft damper [N]; the sign bit of 0 picks the side."""
    return high if hard == (math.copysign(1.0, rate) > 0.0) else low


# --- The admissible forces that make |a_K| smallest, equations (10) and (12) of the paper ---
#
# a_K = a_0 + D^T T is a plane over the box of the admissible forces, so the smallest |a_K| is where
# a_K = 0 cuts the box - a whole segment of minimisers - or a corner where it does not. Equation (12)
# says nothing about the segment: the tie-break picks its point.

Pair = tuple[float, float]

SMALLEST, EQUAL_SHARE, LARGEST, LEAST_LOAD = range(4)
TIE_BREAKS: dict[TieBreak, int] = {"smallest": SMALLEST, "equal_share": EQUAL_SHARE, "largest": LARGEST}


@compiled
def least_acceleration_forces(
    a0: float, D: Pair, low: Array, high: Array, tie: int, branch: int, forces: Array
) -> None:
    """Fill `forces` (2,) with damper forces within the box that make |a_0 + D^T T| smallest.

    Equation: T_K in Arg min |a_0 + D^T T| over Omega(V)      Source: Makowski and Knap 2021, eq. (10)-(12)

    Parameters
    ----------
    a0 : acceleration at K by the springs alone [m/s2]
    D : acceleration at K by each damper force [1/kg]
    low, high : (2,) the box Omega(V) [N]
    tie : `SMALLEST` Euclidean norm; `EQUAL_SHARE`: each damper goes the same share of its range
        from where it pushes K down most to where it pushes K up most; `LARGEST` Euclidean norm
    branch : the end of the segment that `LARGEST` takes, see `farther_end`
    forces : (2,) filled [N]
    """
    share = _share(a0, D, low, high)
    if tie == EQUAL_SHARE or share <= 0.0 or share >= 1.0:
        for i in range(2):
            start, end = (low[i], high[i]) if D[i] >= 0.0 else (high[i], low[i])
            forces[i] = start + share * (end - start)
        return
    i, first, last = _segment(a0, D, low, high)
    j = 1 - i
    if tie == LARGEST:
        forces[i] = first if branch == 0 else last
    else:
        nearest = -a0 * D[i] / (D[0] * D[0] + D[1] * D[1])
        forces[i] = min(max(nearest, first), last)
    forces[j] = min(max((-a0 - D[i] * forces[i]) / D[j], low[j]), high[j])


@compiled
def least_load_forces(springs: Pair, D: Pair, low: Array, high: Array, forces: Array) -> None:
    """Fill `forces` (2,) with those of the least wheel loads that make |a_K| smallest within the box.

    Equation: a_K = D^T L, L = S + T: the smallest Euclidean norm of L in the box Omega(V) + S
    Source: Makowski and Knap 2021, eq. (9)-(12); section 6 has the wheel load as another criterion

    Parameters
    ----------
    springs : S_i of both axles [N]
    D : acceleration at K by each force [1/kg]
    low, high : (2,) the box Omega(V), shifted meanwhile [N]
    forces : (2,) filled [N]
    """
    for i in range(2):
        low[i] += springs[i]
        high[i] += springs[i]
    least_acceleration_forces(0.0, D, low, high, SMALLEST, 0, forces)
    for i in range(2):
        low[i] -= springs[i]
        high[i] -= springs[i]
        forces[i] = min(max(forces[i] - springs[i], low[i]), high[i])


@compiled
def farther_end(a0: float, D: Pair, low: Array, high: Array) -> int:
    """Return the end of the segment of minimisers (0 or 1) with the larger Euclidean norm."""
    if D[0] == 0.0 and D[1] == 0.0:
        return 0
    i, first, last = _segment(a0, D, low, high)
    j = 1 - i
    at_first = math.hypot(first, (-a0 - D[i] * first) / D[j])
    at_last = math.hypot(last, (-a0 - D[i] * last) / D[j])
    return 0 if at_first >= at_last else 1


@compiled
def _share(a0: float, D: Pair, low: Array, high: Array) -> float:
    """Return the share of the range of D^T T over the box at which a_K = 0: 0 or 1 where there is none."""
    least, most = 0.0, 0.0
    for i in range(2):
        least += min(D[i] * low[i], D[i] * high[i])
        most += max(D[i] * low[i], D[i] * high[i])
    if -a0 <= least:
        return 0.0
    if -a0 >= most:
        return 1.0
    return (-a0 - least) / (most - least)


@compiled
def _segment(a0: float, D: Pair, low: Array, high: Array) -> tuple[int, float, float]:
    """Return the damper i with the smaller |D|, and its forces at both ends of the segment a_K = 0."""
    i = 0 if abs(D[0]) <= abs(D[1]) else 1
    j = 1 - i
    first, last = low[i], high[i]
    if D[i] != 0.0:
        one, other = (-a0 - D[j] * low[j]) / D[i], (-a0 - D[j] * high[j]) / D[i]
        first, last = max(first, min(one, other)), min(last, max(one, other))
    if first > last:
        first = last = 0.5 * (first + last)
    return i, first, last


# --- The demand of a policy ---


@inlined
def one_sided(velocity: float, side: float) -> float:
    """Hold a velocity on the side of zero that an axle is on (+1, -1); the sign bit of 0 carries the side."""
    return math.copysign(max(side * velocity, 0.0), side)


@inlined
def feedback_force(gains: Array, y: Array, workspace: Array) -> float:
    """Apply the gains (SENSED,) of one axle to what is sensed: a force [N], or the signal that switches."""
    force = (
        gains[4] * y[State.HEAVE]
        + gains[5] * y[State.PITCH]
        + gains[6] * y[State.HEAVE_RATE]
        + gains[7] * y[State.PITCH_RATE]
    )
    for i in range(2):
        force += gains[i] * workspace[Axle.DEFLECTION, i] + gains[2 + i] * workspace[Axle.RATE, i]
    return float(force)


@compiled
def spring_acceleration(car: Vehicle, deflection: Array) -> float:
    """Return the acceleration at K by the springs alone [m/s2].

    Equation: a_0 = D^T S, S_i = k_i U_i      Source: Makowski and Knap 2021, eq. (9)
    """
    a0 = 0.0
    for i in range(2):
        a0 += car.comfort[i] * car.stiffness[i] * deflection[i]
    return a0


@compiled
def choose_hardness(y: Array, ride: RunningRide) -> None:
    """Fill whether each damper is to be hard, by the workspace as the motion left it."""
    control_spec, car, workspace = ride.model.control_spec, ride.model.car, ride.workspace
    for i in range(2):
        signal = feedback_force(control_spec.gains[i], y, workspace)
        acceleration = workspace[Axle.BODY, 0] + car.arms[i] * workspace[Axle.BODY, 1]
        hard = is_hard(workspace[Axle.RATE, i], signal, acceleration, control_spec.crossover)
        ride.control[Command.HARD, i] = 1.0 if hard else 0.0


@inlined
def wanted_force(axle: int, y: Array, ride: RunningRide) -> float:
    """Return what a feedback or a switch asks of one axle within the workspace's bounds [N]."""
    control_spec, workspace = ride.model.control_spec, ride.workspace
    low, high = workspace[Axle.LOW, axle], workspace[Axle.HIGH, axle]
    if control_spec.aim == SWITCH:
        return switched_force(ride.control[Command.HARD, axle] > 0.0, workspace[Axle.SIDED_RATE, axle], low, high)
    return float(min(max(feedback_force(control_spec.gains[axle], y, workspace), low), high))


@compiled
def demand(y: Array, ride: RunningRide) -> None:
    """Fill the workspace's forces with what the policy asks of both axles within the workspace's bounds [N]."""
    control_spec, car, workspace = ride.model.control_spec, ride.model.car, ride.workspace
    if control_spec.aim != MINIMISE:
        for i in range(2):
            workspace[Axle.FORCE, i] = wanted_force(i, y, ride)
        return
    deflection, low, high = workspace[Axle.DEFLECTION], workspace[Axle.LOW], workspace[Axle.HIGH]
    if control_spec.tie == LEAST_LOAD:
        springs = (car.stiffness[0] * deflection[0], car.stiffness[1] * deflection[1])
        least_load_forces(springs, car.comfort, low, high, workspace[Axle.FORCE])
    else:
        a0, end = spring_acceleration(car, deflection), int(ride.control[Command.TIE_END, 1])
        least_acceleration_forces(a0, car.comfort, low, high, control_spec.tie, end, workspace[Axle.FORCE])
