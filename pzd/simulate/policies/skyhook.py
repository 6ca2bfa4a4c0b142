"""Skyhook: each damper is asked for the force of a damper between body and sky."""

from __future__ import annotations

import numpy as np

from pzd.record import Array
from pzd.schema.model import Frozen
from pzd.simulate.policies import Policy
from pzd.simulate.vehicle.car import HalfCar


def feedback(car: HalfCar, damping: float, own: Frozen) -> Array:
    """T_i = c times the velocity of the body above axle i, H^T dX/dt.

    Source: Karnopp, Crosby and Harwood 1974
    """
    gains = np.zeros((2, 8))
    gains[:, 6:8] = damping * car.force_directions().T
    return gains


POLICY = Policy(
    "skyhook",
    "the force of a damper between body and sky, where it is within reach",
    "feedback",
    controlled=True,
    feedback=feedback,
)
