"""What a policy asks of the dampers, as numbers that the compiled loop reads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from pzd.record import Array
from pzd.simulate.car import HalfCar

Aim = Literal["damping", "feedback", "minimise", "voltage", "predict"]
"""Constant damping; a force proportional to the state; the smallest |a_K|; or no force but a voltage: one that is
held, or the best of many tried ahead."""


@dataclass(frozen=True)
class Policy:
    """A way of controlling the dampers."""

    name: str
    """As in configs and in the names of cases."""
    meaning: str
    """What it does, in one sentence."""
    aim: Aim
    controlled: bool = False
    """Whether it answers to the ride, so that the report sets it beside the others; False for what stays as it is."""
    tuned: Literal["voltage", "damping"] | None = None
    """What is held constant at the value with which a_w is least, for each road and fidelity by itself."""
    feedback: Callable[[HalfCar, float], Array] | None = None
    """(car, constant damping) -> (2, 8) gains on (deflection 1, 2, its rate 1, 2, z, phi, dz, dphi):
    the force that the aims `damping` and `feedback` ask of each axle."""
