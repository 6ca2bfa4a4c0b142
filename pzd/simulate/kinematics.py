"""Deflection of the suspensions and its derivatives from the body and the road, evaluated where the step is."""

from __future__ import annotations

import math

from pzd.compiled import compiled, inlined
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
from pzd.simulate.spline import spline_at
from pzd.simulate.tyre import press


@compiled
def road_at(road_coefficients: RoadCoefficients, distance: float) -> tuple[float, float, float]:
    """Height [m] of the road at a distance [m], its slope [-] and its curvature [1/m]."""
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
