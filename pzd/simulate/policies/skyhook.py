"""Laws that damp the body: skyhook, acceleration-driven damping, and SH-ADD, which joins the two.

Here z_i is the height of the body above axle i and V_i the speed of its suspension.
"""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from pzd.record import Array
from pzd.schema.model import Frozen
from pzd.simulate.policies import BODY_RATES, SENSED, Policy, Switch
from pzd.simulate.vehicle.car import HalfCar


class SkyhookAdd(Frozen):
    """Parameters of the policy."""

    crossover_Hz: float = Field(default=2.0, ge=0.0)
    """Frequency below which the velocity of the body decides, and above which its acceleration does. By default sqrt(2)
    times that of the paper's car in heave, 1.4 Hz: above, a damper hands on more of the road the harder it is."""


def skyhook(car: HalfCar, damping: float, own: Frozen) -> Array:
    """Return the gains of T_i = c times the velocity of the body above axle i, H^T dX/dt.

    Source: Karnopp, Crosby and Harwood 1974
    """
    gains = np.zeros((2, SENSED))
    gains[:, BODY_RATES] = damping * car.force_directions().T
    return gains


def two_state(car: HalfCar, own: Frozen) -> Switch:
    """Switch hard where dz_i/dt V_i > 0, else soft.

    Source: Savaresi, Poussot-Vassal, Spelta, Sename and Dugard 2010, Semi-Active Suspension Control Design for
    Vehicles, chapter 6; the force of Karnopp, Crosby and Harwood 1974 in two states
    """
    return Switch(skyhook(car, 1.0, own), math.inf)


def acceleration_driven(car: HalfCar, own: Frozen) -> Switch:  # the signature of every switch
    """Switch hard where d2z_i/dt2 V_i > 0, else soft.

    Source: Savaresi, Silani and Bittanti 2005, J. Dyn. Sys. Meas. Control 127(2): the state of the damper in which the
    body is accelerated least at the end of the control period. The acceleration is that under the state before, so
    where hard and soft accelerate the body apart the damper alternates
    """
    return Switch(np.zeros((2, SENSED)), 0.0)


def skyhook_add(car: HalfCar, own: Frozen) -> Switch:
    """Switch hard where p V_i > 0, else soft: p = dz_i/dt where |d2z_i/dt2| <= w_c |dz_i/dt|, else p = d2z_i/dt2.

    Source: Savaresi and Spelta 2007, J. Dyn. Sys. Meas. Control 129(4); 2009, IEEE Trans. Control Systems Technology
    17(1). w_c is their alpha
    """
    crossover = SkyhookAdd.model_validate(own).crossover_Hz
    return Switch(skyhook(car, 1.0, own), 2.0 * math.pi * crossover)


POLICIES = (
    Policy(
        "skyhook",
        "the force of a damper between body and sky, where it is within reach",
        "feedback",
        controlled=True,
        feedback=skyhook,
    ),
    Policy(
        "skyhook_two_state",
        "hard where that pulls the body above the axle against its velocity, else soft",
        "switch",
        controlled=True,
        switch=two_state,
    ),
    Policy(
        "add",
        "acceleration-driven: hard where that pulls the body above the axle against its acceleration, else soft",
        "switch",
        controlled=True,
        switch=acceleration_driven,
    ),
    Policy(
        "skyhook_add",
        "two-state skyhook where the body above the axle moves slowly, acceleration-driven damping where it moves fast",
        "switch",
        controlled=True,
        switch=skyhook_add,
    ),
)
