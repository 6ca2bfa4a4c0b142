"""Suspension and tyre: deflections by the body and the road beneath, and the contact force, which never pulls.

The road is a harmonic and a spline, evaluated where the step is; wheels with mass stand on tyres that store and lose
energy.
"""

from __future__ import annotations

import math

from pzd.compiled import compiled, inlined
from pzd.record import Array
from pzd.simulate.ride.model import Axle, RoadCoefficients, State, Vehicle

# --- Tyre of a wheel with mass ---


@inlined
def contact_force(static: float, stiffness: float, damping: float, squeeze: float, rate: float) -> float:
    """Return the force between wheel and road beyond that at rest [N]: the wheel leaves the road where it would pull.

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
    """Return the share of the contact force that the spring of the tyre bears [N]: it does not pull either."""
    return max(stiffness * squeeze, -static)


@inlined
def tyre_energy(static: float, stiffness: float, squeeze: float) -> float:
    """Return the energy of the tyre's spring and of the weight on it, beyond that at rest [J].

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
    workspace : see `Axle`; filled
    """
    static, stiffness = car.static_load[axle], car.tyre_stiffness[axle]
    squeeze, rate = height - y[State.WHEEL_1 + axle], workspace[Axle.ROAD_RISE, axle] - y[State.WHEEL_RATE_1 + axle]
    contact = contact_force(static, stiffness, car.tyre_damping[axle], squeeze, rate)
    workspace[Axle.CONTACT, axle] = contact
    workspace[Axle.TYRE_POWER, axle] = (contact - tyre_spring_force(static, stiffness, squeeze)) * rate


@inlined
def move_wheels(y: Array, car: Vehicle, loads: tuple[float, float], workspace: Array, dy: Array) -> None:
    """Fill the derivative of the wheels' part of the state.

    Equation: m_i d2zeta_i/dt2 = S_i + T_i + N_i - N_i0      Source: Newton, from where the wheel stands at rest

    Parameters
    ----------
    y : state
    car : the half-car
    loads : S + T of both axles [N]
    workspace : see `Axle`
    dy : filled
    """
    dy[State.TYRE_LOSS] = workspace[Axle.TYRE_POWER, 0] + workspace[Axle.TYRE_POWER, 1]
    for i in range(2):
        dy[State.WHEEL_1 + i] = y[State.WHEEL_RATE_1 + i]
        dy[State.WHEEL_RATE_1 + i] = (loads[i] + workspace[Axle.CONTACT, i]) / car.unsprung[i]


# --- The road, and the deflection of the suspensions with its derivatives ---

NEEDED = 6
"""Coefficients that act in one cell."""


@inlined
def spline_at(coefficients: Array, place: float) -> tuple[float, float, float]:
    """Evaluate a spline, its derivative and its second derivative; held before the first and behind the last knot.

    Equation: s = sum c_j B(p - j), B the basis spline of degree 5 over whole numbers, as a polynomial in the cell
    Source: de Boor 2001, A Practical Guide to Splines, ch. IX and X

    Parameters
    ----------
    coefficients : (n + 4,) of a spline over n knots, or more than `NEEDED`; the first acts two knots before the first
    place : counted from the first knot, in knots

    Returns
    -------
    value, and its derivatives by the place
    """
    last = coefficients.size - NEEDED
    held = place <= 0.0 or place >= last + 1.0
    place = min(max(place, 0.0), last + 1.0)
    cell = min(int(place), last)
    t = place - cell
    c0, c1, c2 = coefficients[cell], coefficients[cell + 1], coefficients[cell + 2]
    c3, c4, c5 = coefficients[cell + 3], coefficients[cell + 4], coefficients[cell + 5]
    a0 = (c0 + c4 + 26.0 * (c1 + c3) + 66.0 * c2) / 120.0
    a1 = (c4 - c0 + 10.0 * (c3 - c1)) / 24.0
    a2 = (c0 + c4 + 2.0 * (c1 + c3) - 6.0 * c2) / 12.0
    a3 = (c4 - c0 - 2.0 * (c3 - c1)) / 12.0
    a4 = (c0 + c4 - 4.0 * (c1 + c3) + 6.0 * c2) / 24.0
    a5 = (c5 - c0 + 5.0 * (c1 - c4) + 10.0 * (c3 - c2)) / 120.0
    value = a0 + t * (a1 + t * (a2 + t * (a3 + t * (a4 + t * a5))))
    if held:
        return value, 0.0, 0.0
    slope = a1 + t * (2.0 * a2 + t * (3.0 * a3 + t * (4.0 * a4 + t * 5.0 * a5)))
    return value, slope, 2.0 * a2 + t * (6.0 * a3 + t * (12.0 * a4 + t * 20.0 * a5))


@compiled
def road_at(road_coefficients: RoadCoefficients, distance: float) -> tuple[float, float, float]:
    """Return the height [m] of the road at a distance [m], its slope [-] and its curvature [1/m]."""
    height = slope = curvature = 0.0
    if road_coefficients.amplitude != 0.0:
        phase = road_coefficients.wavenumber * distance
        height = road_coefficients.amplitude * math.sin(phase)
        slope = road_coefficients.amplitude * road_coefficients.wavenumber * math.cos(phase)
        curvature = -road_coefficients.wavenumber * road_coefficients.wavenumber * height
    if road_coefficients.coefficients.size == 0:
        return height, slope, curvature
    spacing = road_coefficients.spacing
    above, rising, bending = spline_at(road_coefficients.coefficients, distance / spacing)
    return height + above, slope + rising / spacing, curvature + bending / (spacing * spacing)


@inlined
def suspension(time: float, y: Array, car: Vehicle, road_coefficients: RoadCoefficients, workspace: Array) -> None:
    """Fill deflection and its rate, speed and acceleration of what the axles stand on, and spring force.

    Equation: U = H^T X - xi, V = dU/dt, S_i = k_i U_i      Source: Makowski and Knap 2021, section 5;
    where the wheels have mass their height zeta takes the place of that of the road, xi

    Parameters
    ----------
    time : [s]
    y : state
    car, road_coefficients : the half-car and its road
    workspace : see `Axle`; filled
    """
    for i in range(2):
        height, slope, curvature = road_at(road_coefficients, car.speed * time - road_coefficients.behind[i])
        workspace[Axle.ROAD_RISE, i] = slope * car.speed
        workspace[Axle.RISE, i] = slope * car.speed
        workspace[Axle.LIFT, i] = curvature * car.speed * car.speed
        if car.wheels:
            press(y, car, i, height, workspace)
            height, workspace[Axle.RISE, i] = y[State.WHEEL_1 + i], y[State.WHEEL_RATE_1 + i]
            workspace[Axle.LIFT, i] = workspace[Axle.CONTACT, i] / car.unsprung[i]
        workspace[Axle.DEFLECTION, i] = y[State.HEAVE] + car.arms[i] * y[State.PITCH] - height
        workspace[Axle.RATE, i] = y[State.HEAVE_RATE] + car.arms[i] * y[State.PITCH_RATE] - workspace[Axle.RISE, i]
        workspace[Axle.SPRINGS, i] = car.stiffness[i] * workspace[Axle.DEFLECTION, i]
