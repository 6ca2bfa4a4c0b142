"""Groundhook: each damper is asked for the force of a damper between wheel and ground."""

from __future__ import annotations

import numpy as np

from pzd.record import Array
from pzd.schema.model import Frozen
from pzd.simulate.policies import BODY_RATES, RATES, SENSED, Policy
from pzd.simulate.vehicle.car import HalfCar


def groundhook(car: HalfCar, damping: float, own: Frozen) -> Array:
    """Return the gains of T_i = -c times the velocity of wheel i, dzeta_i/dt = H^T dX/dt - V_i.

    T presses the wheel upwards.

    Source: Valasek, Novak, Sika and Vaculin 1997, Vehicle System Dynamics 27(5-6)
    """
    gains = np.zeros((2, SENSED))
    gains[:, RATES] = damping * np.eye(2)
    gains[:, BODY_RATES] = -damping * car.force_directions().T
    return gains


POLICIES = (
    Policy(
        "groundhook",
        "the force of a damper between wheel and ground, where it is within reach",
        "feedback",
        fits="wheels with mass",
        controlled=True,
        feedback=groundhook,
    ),
)
