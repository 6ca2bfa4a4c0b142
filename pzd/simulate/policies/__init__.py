"""The policies: what force or voltage is asked of the dampers, a family of laws in each file.

Every module here is found by itself; it declares `POLICIES = (Policy(...), ...)`.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Literal, NamedTuple

from pzd.record import Array
from pzd.schema.model import Frozen
from pzd.simulate.vehicle.car import HalfCar

Aim = Literal["damping", "feedback", "switch", "minimise", "voltage", "predict", "schedule"]
"""What a policy asks for: constant damping; a force proportional to the state; the hardest or the softest damper; the
smallest |a_K|; or no force but a voltage: one that is held, the best of many tried ahead, or a schedule that repeats
with the road."""
TieBreak = Literal["smallest", "equal_share", "largest"]
"""Which of the forces that make |a_K| smallest, see `pzd.simulate.control.demand`."""
SENSED = 8
"""Signals that a feedback reads: deflection 1, 2 [m], its rate 1, 2 [m/s], z [m], phi [rad], dz [m/s], dphi [rad/s]."""
DEFLECTIONS, RATES, BODY, BODY_RATES = slice(0, 2), slice(2, 4), slice(4, 6), slice(6, 8)
"""Where they stand in the gains (2, SENSED) of a feedback."""


class Switch(NamedTuple):
    """When a damper is to be hard, see `pzd.simulate.control.demand.is_hard`."""

    gains: Array
    """(2, SENSED) of the signal s of each axle, as those of a feedback."""
    crossover: float
    """w_c [rad/s]: s decides where |d2z_i/dt2| <= w_c |s|, the acceleration of the body where it is larger."""


@dataclass(frozen=True)
class Policy:
    """A way of controlling the dampers."""

    name: str
    """As in configs and in the names of cases."""
    meaning: str
    """What it does, in one sentence."""
    aim: Aim
    fits: Literal["any car", "wheels with mass"] = "any car"
    """Which cars it can be ridden on."""
    controlled: bool = False
    """Whether it answers to the ride, so that the report sets it beside the others; False for what stays as it is."""
    tie_break: TieBreak | Literal["least_load"] | None = None
    """Which forces the aim `minimise` takes of many; by default those that `tie_break` of the config says."""
    tuned: Literal["voltage", "damping", "schedule"] | None = None
    """What is searched for so that a_w is least, for each road and fidelity by itself: the constant voltage or damping,
    or a whole schedule of voltages."""
    feedback: Callable[[HalfCar, float, Frozen], Array] | None = None
    """(car, constant damping, its block of the config) -> (2, SENSED) gains of the force that the aims `damping` and
    `feedback` ask of each axle."""
    switch: Callable[[HalfCar, Frozen], Switch] | None = None
    """(car, its block of the config) -> when the aim `switch` asks for a hard damper."""


@cache
def policies() -> dict[str, Policy]:
    """Find every policy, by name in alphabetical order."""
    modules = (importlib.import_module(f"{__name__}.{info.name}") for info in pkgutil.iter_modules(__path__))
    found = (policy for module in modules for policy in module.POLICIES)
    return {policy.name: policy for policy in sorted(found, key=lambda policy: policy.name)}
