"""Force and displacement were sampled at different instants.

Equation: F recorded at t - tau                                 Source: dead time of a measuring chain
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from pzd.blind.independent.bingham import Scale
from pzd.record import Array

NAME = "sensor_delay"


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a delay of up to 15 ms, of either channel."""
    return {"tau": float(draw.choice([-1.0, 1.0])) * min(0.015, 0.05 * strength)}


def delayed(time: Array, force: Array, tau: float) -> Array:
    """(n,) the force a time tau [s] earlier."""
    return np.asarray(np.interp(time - tau, time, force))
