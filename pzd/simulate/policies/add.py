"""Acceleration-driven damping: hard where that pulls the body against its acceleration, soft elsewhere."""

from __future__ import annotations

import numpy as np

from pzd.schema.model import Frozen
from pzd.simulate.policies import Policy, Switch
from pzd.simulate.vehicle.car import HalfCar


def switch(car: HalfCar, own: Frozen) -> Switch:  # the signature of every switch
    """Hard where d2z_i/dt2 V_i > 0, else soft; z_i is the height of the body above axle i.

    Source: Savaresi, Silani and Bittanti 2005, J. Dyn. Sys. Meas. Control 127(2): the state of the damper in which the
    body is accelerated least at the end of the control period. The acceleration is that under the state before, so
    where hard and soft accelerate the body apart the damper alternates
    """
    return Switch(np.zeros((2, 8)), 0.0)


POLICY = Policy(
    "add",
    "acceleration-driven: hard where that pulls the body above the axle against its acceleration, else soft",
    "switch",
    controlled=True,
    switch=switch,
)
