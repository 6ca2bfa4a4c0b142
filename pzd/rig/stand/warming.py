"""How a damper warms with the work done on it, and what the warmth does to its force."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from pzd.record import Array
from pzd.rig.stand.programmes import Warming
from pzd.signals.recursion import recursion

_ROUNDS = 20
_SETTLED = 1e-6
"""Change of the temperature in a round that ends the search [K]."""


def temperature_over(warming: Warming, time: Array, displacement: Array, force: Array) -> Array:
    """Temperature of the damper; constant before time 0.

    Equation: C_h dT/dt = F v - G (T - T_ambient)           Source: heat balance of one lump

    Parameters
    ----------
    warming : start, surroundings, heat capacity C_h and loss G
    time : (n,) at equal steps [s]
    displacement : (n,) [m]
    force : (n,) [N]

    Returns
    -------
    (n,) temperature [degC]
    """
    ambient = warming.start_degC if warming.ambient_degC is None else warming.ambient_degC
    step = float((time[-1] - time[0]) / (time.size - 1))
    rate = warming.loss_W_per_K * step / warming.heat_capacity_J_per_K
    decay = math.exp(-rate)
    kept = -math.expm1(-rate) / rate if rate > 0.0 else 1.0
    work = 0.5 * (force[1:] + force[:-1]) * np.diff(displacement)
    first = max(int(np.searchsorted(time, -0.5 * step)), 0)
    above = np.concatenate(([warming.start_degC - ambient], kept * work[first:] / warming.heat_capacity_J_per_K))
    return ambient + np.concatenate((np.full(first, above[0]), recursion(decay, above)))


def warmed(
    warming: Warming, time: Array, displacement: Array, force_at: Callable[[Array], Array]
) -> tuple[Array, Array]:
    """Force and temperature of a damper that warms, each computed from the other until they agree.

    Parameters
    ----------
    warming : the heat balance
    time : (n,) at equal steps [s]
    displacement : (n,) [m]
    force_at : gives the force (n,) [N] at a temperature (n,) [degC]

    Returns
    -------
    (n,) force [N] and (n,) temperature [degC]
    """
    temperature = np.full(time.size, warming.start_degC)
    for _ in range(_ROUNDS):
        force = force_at(temperature)
        last, temperature = temperature, temperature_over(warming, time, displacement, force)
        if np.max(np.abs(temperature - last)) <= _SETTLED:
            break
    return force, temperature
