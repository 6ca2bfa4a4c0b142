"""Balance: hard where the force of the damper opposes that of the spring, soft elsewhere."""

from __future__ import annotations

import math

from pzd.schema.model import Frozen
from pzd.simulate.policies import Policy, Switch, wheel_load
from pzd.simulate.vehicle.car import HalfCar


def switch(car: HalfCar, own: Frozen) -> Switch:
    """Hard where U_i V_i < 0, else soft: it needs no more than the deflection of the suspension.

    Source: Rakheja and Sankar 1985, J. Vib. Acoust. Stress Reliab. Des. 107(4)
    """
    return Switch(wheel_load.feedback(car, 0.0, own), math.inf)


POLICY = Policy(
    "balance",
    "hard where the damper pulls against the spring of its axle, else soft",
    "switch",
    controlled=True,
    switch=switch,
)
