"""Two-state skyhook: hard where that pulls the body against its velocity, soft elsewhere."""

from __future__ import annotations

import math

from pzd.schema.model import Frozen
from pzd.simulate.policies import Policy, Switch, skyhook
from pzd.simulate.vehicle.car import HalfCar


def switch(car: HalfCar, own: Frozen) -> Switch:
    """Hard where dz_i/dt V_i > 0, else soft; z_i is the height of the body above axle i.

    Source: Savaresi, Poussot-Vassal, Spelta, Sename and Dugard 2010, Semi-Active Suspension Control Design for
    Vehicles, chapter 6; the force of Karnopp, Crosby and Harwood 1974 in two states
    """
    return Switch(skyhook.feedback(car, 1.0, own), math.inf)


POLICY = Policy(
    "skyhook_two_state",
    "hard where that pulls the body above the axle against its velocity, else soft",
    "switch",
    controlled=True,
    switch=switch,
)
