"""Vehicles without control: one voltage, or one damping coefficient, at both axles for the whole ride.

The best of either is searched for on each road: what a switch on the dashboard, or a well-chosen viscous damper, could
do without control.
"""

from __future__ import annotations

import numpy as np

from pzd.record import Array
from pzd.schema.model import Frozen
from pzd.simulate.policies import RATES, SENSED, Policy
from pzd.simulate.vehicle.car import HalfCar


def viscous(car: HalfCar, damping: float, own: Frozen) -> Array:  # the signature of every feedback
    """Return the gains of constant damping, T_i = c V_i at both axles.

    Source: Makowski and Knap 2021, section 5 (c = const.)
    """
    gains = np.zeros((2, SENSED))
    gains[:, RATES] = damping * np.eye(2)
    return gains


POLICIES = (
    Policy("passive", "the voltage stays where it is", "voltage"),
    Policy("best_fixed_voltage", "the voltage with the least a_w on this road, held", "voltage", tuned="voltage"),
    Policy("constant", "constant damping coefficient at both axles", "damping", feedback=viscous),
    Policy(
        "best_constant_c",
        "the damping coefficient with the least a_w on this road, held",
        "damping",
        tuned="damping",
        feedback=viscous,
    ),
)
