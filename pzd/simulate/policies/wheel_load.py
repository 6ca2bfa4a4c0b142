"""Wheel load: each damper is asked to cancel the spring force that changes the load of the wheel."""

from __future__ import annotations

import numpy as np

from pzd.record import Array
from pzd.schema.model import Frozen
from pzd.simulate.policies import Policy
from pzd.simulate.vehicle.car import HalfCar


def feedback(car: HalfCar, damping: float, own: Frozen) -> Array:  # the signature of every feedback
    """T_i = -k_i U_i: the dynamic load S_i + T_i of each wheel goes to zero where that is within reach.

    Where the wheels have no mass this is also the power-driven damper, which lets no more power into the body than it
    must (Morselli and Zanasi 2008, Mechatronics 18).

    Source: Makowski and Knap 2021, section 6 (criterion of wheel dynamic load change)
    """
    gains = np.zeros((2, 8))
    gains[:, :2] = -np.diag(car.stiffnesses)
    return gains


POLICY = Policy("wheel_load", "smallest change of each wheel's load", "feedback", controlled=True, feedback=feedback)
