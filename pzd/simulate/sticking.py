"""Acceleration of the suspensions, and what holds an axle that sticks at V = 0."""

from __future__ import annotations

from pzd.compiled import inlined
from pzd.record import Array
from pzd.simulate.ride_model import ACCELERATION, FORCE, INERTANCE, LIFT, SIDE, SPRINGS, Vehicle


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
