"""Deflection of the suspensions and its derivatives from the body and the road, evaluated where the step is."""

from __future__ import annotations

import math

from pzd.damper.compiled import compiled
from pzd.record import Array
from pzd.simulate.scene import (
    DEFLECTION,
    HEAVE,
    HEAVE_RATE,
    LIFT,
    PITCH,
    PITCH_RATE,
    RATE,
    RISE,
    SPRINGS,
    Ground,
    Vehicle,
)


@compiled
def road_at(ground: Ground, distance: float) -> tuple[float, float, float]:
    """Height [m] of the road at a distance [m], its slope [-] and its curvature [1/m]."""
    phase = ground.wavenumber * distance
    height = ground.amplitude * math.sin(phase)
    slope = ground.amplitude * ground.wavenumber * math.cos(phase)
    curvature = -ground.wavenumber * ground.wavenumber * height
    count = ground.coefficients.shape[0]
    if count == 0:
        return height, slope, curvature
    place = distance / ground.spacing
    if place <= 0.0:
        return height + ground.coefficients[0, 0], slope, curvature
    knot = min(int(place), count - 1)
    c = ground.coefficients[knot]
    if place >= count:
        d = ground.spacing
        return height + c[0] + d * (c[1] + d * (c[2] + d * c[3])), slope, curvature
    d = (place - knot) * ground.spacing
    height += c[0] + d * (c[1] + d * (c[2] + d * c[3]))
    return height, slope + c[1] + d * (2.0 * c[2] + 3.0 * d * c[3]), curvature + 2.0 * c[2] + 6.0 * d * c[3]


@compiled
def suspension(time: float, y: Array, car: Vehicle, ground: Ground, desk: Array) -> None:
    """Fill deflection and its rate, speed and acceleration of the road, and spring force of both axles.

    Equation: U = H^T X - xi, V = dU/dt, S_i = k_i U_i      Source: Makowski and Knap 2021, section 5

    Parameters
    ----------
    time : [s]
    y : state
    car, ground : the half-car and its road
    desk : see `scene`; filled
    """
    for i in range(2):
        height, slope, curvature = road_at(ground, car.speed * time - ground.behind[i])
        desk[RISE, i] = slope * car.speed
        desk[LIFT, i] = curvature * car.speed * car.speed
        desk[DEFLECTION, i] = y[HEAVE] + car.arms[i] * y[PITCH] - height
        desk[RATE, i] = y[HEAVE_RATE] + car.arms[i] * y[PITCH_RATE] - desk[RISE, i]
        desk[SPRINGS, i] = car.stiffness[i] * desk[DEFLECTION, i]
