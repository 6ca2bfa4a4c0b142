"""Deflection of the suspensions and its derivatives from the body and the road, evaluated where the step is."""

from __future__ import annotations

import math

from pzd.compiled import compiled
from pzd.record import Array
from pzd.simulate.ride_model import (
    CONTACT,
    DEFLECTION,
    HEAVE,
    HEAVE_RATE,
    LIFT,
    PITCH,
    PITCH_RATE,
    RATE,
    RISE,
    ROAD_RISE,
    SPRINGS,
    WHEEL_1,
    WHEEL_RATE_1,
    RoadCoefficients,
    Vehicle,
)
from pzd.simulate.tyre import press


@compiled
def road_at(road_coefficients: RoadCoefficients, distance: float) -> tuple[float, float, float]:
    """Height [m] of the road at a distance [m], its slope [-] and its curvature [1/m]."""
    phase = road_coefficients.wavenumber * distance
    height = road_coefficients.amplitude * math.sin(phase)
    slope = road_coefficients.amplitude * road_coefficients.wavenumber * math.cos(phase)
    curvature = -road_coefficients.wavenumber * road_coefficients.wavenumber * height
    count = road_coefficients.coefficients.shape[0]
    if count == 0:
        return height, slope, curvature
    place = distance / road_coefficients.spacing
    if place <= 0.0:
        return height + road_coefficients.coefficients[0, 0], slope, curvature
    knot = min(int(place), count - 1)
    c = road_coefficients.coefficients[knot]
    if place >= count:
        d = road_coefficients.spacing
        return height + c[0] + d * (c[1] + d * (c[2] + d * c[3])), slope, curvature
    d = (place - knot) * road_coefficients.spacing
    height += c[0] + d * (c[1] + d * (c[2] + d * c[3]))
    return height, slope + c[1] + d * (2.0 * c[2] + 3.0 * d * c[3]), curvature + 2.0 * c[2] + 6.0 * d * c[3]


@compiled
def suspension(time: float, y: Array, car: Vehicle, road_coefficients: RoadCoefficients, workspace: Array) -> None:
    """Fill deflection and its rate, speed and acceleration of what the axles stand on, and spring force.

    Equation: U = H^T X - xi, V = dU/dt, S_i = k_i U_i      Source: Makowski and Knap 2021, section 5;
    where the wheels have mass their height zeta takes the place of that of the road, xi

    Parameters
    ----------
    time : [s]
    y : state
    car, road_coefficients : the half-car and its road
    workspace : see `ride_model`; filled
    """
    for i in range(2):
        height, slope, curvature = road_at(road_coefficients, car.speed * time - road_coefficients.behind[i])
        workspace[ROAD_RISE, i] = slope * car.speed
        workspace[RISE, i] = slope * car.speed
        workspace[LIFT, i] = curvature * car.speed * car.speed
        if car.wheels:
            press(y, car, i, height, workspace)
            height, workspace[RISE, i] = y[WHEEL_1 + i], y[WHEEL_RATE_1 + i]
            workspace[LIFT, i] = workspace[CONTACT, i] / car.unsprung[i]
        workspace[DEFLECTION, i] = y[HEAVE] + car.arms[i] * y[PITCH] - height
        workspace[RATE, i] = y[HEAVE_RATE] + car.arms[i] * y[PITCH_RATE] - workspace[RISE, i]
        workspace[SPRINGS, i] = car.stiffness[i] * workspace[DEFLECTION, i]
