"""Wheels with mass: the force between tyre and road, which never pulls, and what the tyre stores and loses."""

from __future__ import annotations

from pzd.compiled import compiled, inlined
from pzd.record import Array
from pzd.simulate.ride_model import (
    CONTACT,
    ROAD_RISE,
    TYRE_LOSS,
    TYRE_POWER,
    WHEEL_1,
    WHEEL_RATE_1,
    Vehicle,
)


@inlined
def contact_force(static: float, stiffness: float, damping: float, squeeze: float, rate: float) -> float:
    """Force between wheel and road beyond that at rest [N]: the wheel leaves the road where it would pull.

    Equation: N - N_0 = max(k_t s + c_t ds/dt, -N_0), s = xi - zeta
    Source: a spring and a damper beside each other on the weight that they carry, which press alone

    Parameters
    ----------
    static : N_0 [N]
    stiffness, damping : of the tyre k_t [N/m], c_t [N s/m]
    squeeze, rate : s, how much closer wheel and road are than at rest [m], and its rate [m/s]
    """
    return max(stiffness * squeeze + damping * rate, -static)


@inlined
def tyre_spring_force(static: float, stiffness: float, squeeze: float) -> float:
    """What of the contact force the spring of the tyre holds, beyond that at rest [N]: it does not pull either."""
    return max(stiffness * squeeze, -static)


@inlined
def tyre_energy(static: float, stiffness: float, squeeze: float) -> float:
    """Energy of the tyre's spring and of the weight on it, beyond that at rest [J].

    Equation: E = integral of max(k_t s, -N_0) ds
    """
    if stiffness * squeeze >= -static:
        return 0.5 * stiffness * squeeze * squeeze
    return -static * (squeeze + 0.5 * static / stiffness)


@compiled
def press(y: Array, car: Vehicle, axle: int, height: float, workspace: Array) -> None:
    """Fill the contact force of an axle [N], and the power lost in its tyres [W].

    Equation: P = (N - N_s) ds/dt, N_s the force of the spring; never below 0, by what `contact_force` is

    Parameters
    ----------
    y : state
    car : the half-car
    axle : 0 or 1
    height : of the road under it [m]; its speed stands in the workspace
    workspace : see `ride_model`; filled
    """
    static, stiffness = car.static_load[axle], car.tyre_stiffness[axle]
    squeeze, rate = height - y[WHEEL_1 + axle], workspace[ROAD_RISE, axle] - y[WHEEL_RATE_1 + axle]
    contact = contact_force(static, stiffness, car.tyre_damping[axle], squeeze, rate)
    workspace[CONTACT, axle] = contact
    workspace[TYRE_POWER, axle] = (contact - tyre_spring_force(static, stiffness, squeeze)) * rate


@inlined
def move_wheels(y: Array, car: Vehicle, loads: tuple[float, float], workspace: Array, dy: Array) -> None:
    """Fill the derivative of the wheels' part of the state.

    Equation: m_i d2zeta_i/dt2 = S_i + T_i + N_i - N_i0      Source: Newton, from where the wheel stands at rest

    Parameters
    ----------
    y : state
    car : the half-car
    loads : S + T of both axles [N]
    workspace : see `ride_model`
    dy : filled
    """
    dy[TYRE_LOSS] = workspace[TYRE_POWER, 0] + workspace[TYRE_POWER, 1]
    for i in range(2):
        dy[WHEEL_1 + i] = y[WHEEL_RATE_1 + i]
        dy[WHEEL_RATE_1 + i] = (loads[i] + workspace[CONTACT, i]) / car.unsprung[i]
