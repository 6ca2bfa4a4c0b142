"""Laws that hold the wheel load: cancel the spring force of each axle, or balance it in two states."""

from __future__ import annotations

import math

import numpy as np

from pzd.record import Array
from pzd.schema.model import Frozen
from pzd.simulate.policies import DEFLECTIONS, SENSED, Policy, Switch
from pzd.simulate.vehicle.car import HalfCar


def wheel_load(car: HalfCar, damping: float, own: Frozen) -> Array:
    """Return the gains of T_i = -k_i U_i: the dynamic load S_i + T_i of each wheel goes to zero where it can.

    Where the wheels have no mass this is also the power-driven damper, which lets no more power into the body than it
    must (Morselli and Zanasi 2008, Mechatronics 18).

    Source: Makowski and Knap 2021, section 6 (criterion of wheel dynamic load change)
    """
    gains = np.zeros((2, SENSED))
    gains[:, DEFLECTIONS] = -np.diag(car.stiffnesses)
    return gains


def balance(car: HalfCar, own: Frozen) -> Switch:
    """Switch hard where U_i V_i < 0, else soft: it needs no more than the deflection of the suspension.

    Source: Rakheja and Sankar 1985, J. Vib. Acoust. Stress Reliab. Des. 107(4)
    """
    return Switch(wheel_load(car, 0.0, own), math.inf)


POLICIES = (
    Policy("wheel_load", "smallest change of each wheel's load", "feedback", controlled=True, feedback=wheel_load),
    Policy(
        "balance",
        "hard where the damper pulls against the spring of its axle, else soft",
        "switch",
        controlled=True,
        switch=balance,
    ),
)
