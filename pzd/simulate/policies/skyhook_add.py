"""SH-ADD: skyhook where the body moves slowly, acceleration-driven damping where it moves fast."""

from __future__ import annotations

import math

from pydantic import Field

from pzd.schema.model import Frozen
from pzd.simulate.policies import Policy, Switch, skyhook
from pzd.simulate.vehicle.car import HalfCar


class SkyhookAdd(Frozen):
    """Parameters of the policy."""

    crossover_Hz: float = Field(default=2.0, ge=0.0)
    """Frequency below which the velocity of the body decides, and above which its acceleration does. By default sqrt(2)
    times that of the paper's car in heave, 1.4 Hz: above, a damper hands on more of the road the harder it is."""


def switch(car: HalfCar, own: Frozen) -> Switch:
    """Hard where p V_i > 0, else soft: p = dz_i/dt where |d2z_i/dt2| <= w_c |dz_i/dt|, else p = d2z_i/dt2.

    Source: Savaresi and Spelta 2007, J. Dyn. Sys. Meas. Control 129(4); 2009, IEEE Trans. Control Systems Technology
    17(1). w_c is their alpha
    """
    crossover = SkyhookAdd.model_validate(own).crossover_Hz
    return Switch(skyhook.feedback(car, 1.0, own), 2.0 * math.pi * crossover)


POLICY = Policy(
    "skyhook_add",
    "two-state skyhook where the body above the axle moves slowly, acceleration-driven damping where it moves fast",
    "switch",
    controlled=True,
    switch=switch,
)
