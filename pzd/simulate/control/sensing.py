"""Sensors and supply: what the controller sees, late, sampled and noisy, and the voltage that its supply can set."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pzd.compiled import compiled, inlined
from pzd.record import Array
from pzd.simulate.config import SensorNoise, Sensors, Supply
from pzd.simulate.policies import SENSED
from pzd.simulate.ride.model import WORKSPACE_ROWS, Axle, State, Vehicle

CHANNELS = SENSED + 1
"""Those of a feedback policy, then the acceleration of the body."""
_DEFLECTION, _RATE, _BODY, _ACCELERATION = 0, 2, 4, 8
"""Where each begins: deflection and its rate have a channel an axle; the body has z, phi, dz, dphi, as in the state."""
_LEAST_GAIN = 0.02
"""Least gain of the filter of the road's height: an error of the measured rise is forgotten after fifty samples."""
ACTS, NEXT_NOISE = range(2)
"""Of `Electronics.counts`."""
HEIGHT_ERROR, RISE_ERROR = range(2)
"""Rows of `Electronics.road_error`."""


class Electronics(NamedTuple):
    """Sensors and supply as numbers, and what the sensors remember."""

    period: float
    """Of the controller [s]."""
    every: int
    """Control periods from one sample to the next."""
    delay: int
    """Control periods."""
    deviations: Array
    """(CHANNELS,) standard deviations of the noise."""
    noise: Array
    """(n, CHANNELS) of the noise, a row for each act of the controller to come, in the units of the channels."""
    counts: Array
    """(2,) acts so far, and the next row of the noise."""
    states: Array
    """(m, n) samples of the state, the latest m in a ring."""
    workspaces: Array
    """(m, WORKSPACE_ROWS, 2) samples of the workspace, see `Axle`."""
    road_errors: Array
    """(m, 2, 2) error of the height [m] of the road, body less suspension, and of its rise [m/s], under each axle."""
    state: Array
    """(n,) state that the controller sees: that of the latest sample which is old enough."""
    workspace: Array
    """(WORKSPACE_ROWS, 2) the workspace of that sample."""
    road_error: Array
    """(2, 2) the errors of the road of that sample [m], [m/s]."""
    road_gains: Array
    """(2,) share of a new height that is believed beside the rise since the last one, see `road_gain`."""
    step: float
    """Distance of the values that can be set; 0 where every value can [V]."""
    most_change: float
    """Of the voltage in a control period [V]."""
    most_energy: float
    """Of U^2 in a control period [V2]."""


def electronics_of(
    sensors: Sensors, supply: Supply, period: float, states: int, arms: tuple[float, float]
) -> Electronics | None:
    """Return sensors and supply as numbers; None where both are perfect.

    Parameters
    ----------
    sensors, supply : the config's blocks
    period : of the controller [s]
    states : length of the state
    arms : of the axles, from the centre of gravity [m]
    """
    if sensors == Sensors() and supply == Supply():
        return None
    every, delay = round((sensors.period_s or period) / period), round(sensors.delay_s / period)
    slots = -(-delay // every) + 1
    energy = math.inf
    if supply.power_W is not None and supply.capacitance_F is not None:
        energy = 2.0 * supply.power_W / supply.capacitance_F * period
    return Electronics(
        period,
        every,
        delay,
        _deviations(sensors.noise),
        np.zeros((0, CHANNELS)),
        np.zeros(2),
        np.zeros((slots, states)),
        np.zeros((slots, WORKSPACE_ROWS, 2)),
        np.zeros((slots, 2, 2)),
        np.zeros(states),
        np.zeros((WORKSPACE_ROWS, 2)),
        np.zeros((2, 2)),
        np.array([road_gain(sensors.noise, arm, every * period) for arm in arms]),
        supply.step or 0.0,
        math.inf if supply.slew_per_s is None else supply.slew_per_s * period,
        energy,
    )


def road_gain(noise: SensorNoise, arm: float, step: float) -> float:
    """Return the gain of a new height of the road against the last one and the rise since then.

    Equation: K = (s sqrt(s^2 + 4) - s^2) / 2, s = h sigma_rise / sigma_height
    Source: steady Kalman filter of a height whose rate is measured; Bar-Shalom, Li and Kirubarajan 2001, sec. 5.2

    Parameters
    ----------
    noise : of the channels: height and rise are those of the body less those of the suspension
    arm : of the axle, from the centre of gravity [m]
    step : from one sample to the next [s]
    """
    height = math.hypot(noise.heave_m, arm * noise.pitch_rad, noise.deflection_m)
    rise = math.hypot(noise.heave_rate_m_per_s, arm * noise.pitch_rate_rad_per_s, noise.deflection_rate_m_per_s)
    if height == 0.0:
        return 1.0
    s = step * rise / height
    return max(0.5 * s * (math.sqrt(s * s + 4.0) - s), _LEAST_GAIN)


def _deviations(noise: SensorNoise) -> Array:
    """Return the deviations by channel: deflection 1, 2, its rate 1, 2, z, phi, dz, dphi, acceleration."""
    body = (noise.heave_m, noise.pitch_rad, noise.heave_rate_m_per_s, noise.pitch_rate_rad_per_s)
    return np.array(
        [*2 * [noise.deflection_m], *2 * [noise.deflection_rate_m_per_s], *body, noise.acceleration_m_per_s2]
    )


def with_noise(electronics: Electronics, rng: np.random.Generator, acts: int) -> Electronics:
    """Draw the noise of so many acts to come; the numbers are the same whatever number of them is drawn at a time."""
    electronics.counts[NEXT_NOISE] = 0.0
    return electronics._replace(noise=rng.standard_normal((acts, CHANNELS)) * electronics.deviations)


@inlined
def copy_into(origin: Array, target: Array) -> None:
    """Copy (n,) numbers; a slice would need memory of its own."""
    for n in range(origin.size):
        target[n] = origin[n]


@compiled
def sense(y: Array, car: Vehicle, workspace: Array, electronics: Electronics) -> float:
    """Take a sample where it is time, fill what the controller sees, and return how old that is [s].

    Parameters
    ----------
    y : (n,) state
    car : the half-car
    workspace : as `motion` left it, see `Axle`
    electronics : `state`, `workspace` and `road_error` are filled
    """
    number, every = int(electronics.counts[ACTS]), electronics.every
    slots = electronics.states.shape[0]
    if number % every == 0:
        _sample(y, car, workspace, electronics, (number // every) % slots)
    sample = max(number - electronics.delay, 0) // every
    copy_into(electronics.states[sample % slots], electronics.state)
    for row in (HEIGHT_ERROR, RISE_ERROR):
        copy_into(electronics.road_errors[sample % slots, row], electronics.road_error[row])
    for row in range(WORKSPACE_ROWS):
        copy_into(electronics.workspaces[sample % slots, row], electronics.workspace[row])
    electronics.counts[ACTS] += 1.0
    electronics.counts[NEXT_NOISE] += 1.0
    return (number - sample * every) * electronics.period


@compiled
def _sample(y: Array, car: Vehicle, workspace: Array, electronics: Electronics, slot: int) -> None:
    """Fill one sample, its noise with it."""
    noise, errors = electronics.noise[int(electronics.counts[NEXT_NOISE])], electronics.road_errors[slot]
    seen, view = electronics.states[slot], electronics.workspaces[slot]
    copy_into(y, seen)
    for row in range(WORKSPACE_ROWS):
        copy_into(workspace[row], view[row])
    for n in range(4):
        seen[State.HEAVE + n] += noise[_BODY + n]
    view[Axle.BODY, 0] += noise[_ACCELERATION]
    view[Axle.COMFORT, 0] += noise[_ACCELERATION]
    for i in range(2):
        view[Axle.DEFLECTION, i] += noise[_DEFLECTION + i]
        view[Axle.RATE, i] += noise[_RATE + i]
        errors[HEIGHT_ERROR, i] = noise[_BODY] + car.arms[i] * noise[_BODY + 1] - noise[_DEFLECTION + i]
        errors[RISE_ERROR, i] = noise[_BODY + 2] + car.arms[i] * noise[_BODY + 3] - noise[_RATE + i]


@compiled
def supplied(asked: float, was: float, low: float, high: float, electronics: Electronics) -> float:
    """Return the voltage that the supply sets [V].

    Equation: towards the nearest U of the values that can be set, as far as abs(U - U_0) <= slew h and
    abs(U abs(U) - U_0 abs(U_0)) <= 2 P h / C, the energy C U^2 / 2 that a power P moves in a control period h

    Parameters
    ----------
    asked, was : what the controller asks for, and what is set [V]
    low, high : of the table [V]
    electronics : the supply
    """
    voltage = asked
    if electronics.step > 0.0:
        voltage = electronics.step * round(asked / electronics.step)
    voltage = min(max(voltage, low), high)
    voltage = min(max(voltage, was - electronics.most_change), was + electronics.most_change)
    energy = was * abs(was)
    most, least = energy + electronics.most_energy, energy - electronics.most_energy
    return min(max(voltage, _root(least)), _root(most))


@compiled
def _root(energy: float) -> float:
    """Return U of U abs(U)."""
    return math.copysign(math.sqrt(abs(energy)), energy)
