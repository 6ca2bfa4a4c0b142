"""Constant damping at both axles: the vehicle without control."""

from __future__ import annotations

import numpy as np

from pzd.record import Array
from pzd.schema.model import Frozen
from pzd.simulate.policies import Policy
from pzd.simulate.vehicle.car import HalfCar


def feedback(car: HalfCar, damping: float, own: Frozen) -> Array:  # the signature of every feedback
    """T_i = c V_i at both axles.

    Source: Makowski and Knap 2021, section 5 (c = const.)
    """
    gains = np.zeros((2, 8))
    gains[0, 2] = gains[1, 3] = damping
    return gains


POLICY = Policy("constant", "constant damping coefficient at both axles", "damping", feedback=feedback)
