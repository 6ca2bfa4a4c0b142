"""What an effect file declares: place, parameters, how a fit looks for it, how the benchmark hides it, its law.

An effect is one file in `effects/`, called like its effect: `EFFECT`, and the functions of its place. Nothing else
names it: rows, kernels, stand, fit, table, half-car and benchmark follow from what the files declare. A function takes
by name what it needs of the quantities of its law and of the effect's own parameters; `laws.py` holds both, and an
effect that breaks a rule is an ImportError with the file's name. All but `material` and `sensor` are compiled by
numba: they take and give numbers, and use `math` alone. Effects of one place act by `order`, then by name; with
every parameter at its neutral value an effect is left out.

drive
    `law`: effective voltage a step later, the incoming one going linearly from `before` to `now`; `rate`: its rate.
    What it remembers is the voltage it gave last. Supply, valve and actuator; no force acts back on it.
material
    `friction_factor`, `damping_factor`, `stiffness_factor`: factors on T0, C and k by the recorded temperature.
stroke
    `law`: the extension of the oil spring, F = k extension, by the elastic deflection x - y and its side (+1 or -1),
    rising; `inverse`; `slope` where it is not 1. A free play goes below zero on its side, and carries no force there.
    Whatever is in series with the oil spring and gives by the force alone has its place here: late filling, a
    compliant frame or mount, a gas volume that is compressed (accumulator, cavitation without its history).
flow
    One or more changes of the curve that gives the force by the flow speed w = |dy/dt| >= 0:
    |F| = yield(w) + viscous(w) + extra(w), and beyond the force that opens a valve a straight line.
    `direction_factor`: on T0 and C by the sign of F; `bleed_factor`: on C alone.
    `yield_force`, `yield_slope`: in place of T0, in proportion to it.
    `viscous_force`, `viscous_slope`, `viscous_speed`: in place of C w, in proportion to C; speed is the inverse.
    `extra_force`, `extra_slope`: beside both, 0 at w = 0; `extra_speed`: the flow speed at C w + extra, where there is
    a closed form. `opens_at`, `slope_beyond`: force from which the slope is another, by the sign of F
    too. All rise with w.
parallel
    `law`: force beside the element by x, v and a of the piston, `about_zero` where a fit looks for the zero of x too.
    It has no memory: a further slip branch (k_2, T0_2,
    C_2) or a Bouc-Wen force has a state of its own, which no place allows yet.
sensor
    `law`: the moment whose force the channel shows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    import numpy as np

Place = Literal["drive", "material", "stroke", "flow", "parallel", "sensor"]
"""Where in the damper something can be missing, in physical order."""

Need = Literal["voltage", "temperature"]
"""What must move inside a test."""


@dataclass(frozen=True)
class Scales:
    """How large things are on one rig, so that a parameter can be searched in numbers around one."""

    force: float
    """Largest force [N]."""
    low_force: float
    """Largest force of the softest condition [N]."""
    speed: float
    """Largest extension speed [m/s]."""
    stroke: float
    """Largest displacement from the middle of the stroke [m]."""
    acceleration: float
    """Largest acceleration [m/s2]."""
    damping: float
    """Median C of the conditions [N s/m]."""
    voltage: float
    """Span of the control signal [V]."""


@dataclass(frozen=True)
class Search:
    """Where a fit begins to look for a parameter, and in which unit it steps."""

    scale: Callable[[Scales], float]
    """Size that the parameter is counted in."""
    starts: tuple[float, ...]
    """Starting values, in that size; every one is tried."""
    logarithmic: bool = False
    """Whether steps are ratios."""
    within: tuple[float, float] = (-math.inf, math.inf)
    """Smallest and largest value that is looked at, in that size."""


Strength = Callable[[float], dict[str, float]]
"""Parameters of an effect at a strength between 0 (next to nothing) and 1 (the most)."""
Hiding = Callable[["np.random.Generator", Scales], Strength]
"""Draws what else there is to an effect than its strength, on a rig of that size."""


def growing(name: str, most: Callable[[Scales], float], *, either: bool = False) -> Hiding:
    """Hides an effect of one parameter that grows from 0 with the strength.

    Parameters
    ----------
    name : of the parameter
    most : its value at strength 1
    either : to either side, where the physics has no preference
    """

    def hiding(draw: np.random.Generator, scales: Scales) -> Strength:
        end = most(scales) * (float(draw.choice([-1.0, 1.0])) if either else 1.0)
        return lambda s: {name: end * s}

    return hiding


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect."""

    name: str
    """The symbol, as in configs, verdicts and files."""
    unit: str
    """SI unit; '-' for a pure number."""
    neutral: float
    """The value that switches the effect off."""
    low: float
    """Smallest admissible value."""
    high: float
    """Largest admissible value."""
    meaning: str
    search: Search
    """How a fit looks for it."""
    natural_from: float = -math.inf
    """Smallest value that the effect has in nature; a fit may go below, and is then something that looks alike."""
    natural_to: float = math.inf
    """Largest value that the effect has in nature; a fit may go beyond, and is then something that looks alike."""

    def admits(self, value: float) -> bool:
        """Whether the value lies within the limits."""
        return math.isfinite(value) and self.low <= value <= self.high


def _always(values: Mapping[str, float], damping: float) -> bool:
    return True


@dataclass(frozen=True)
class Effect:
    """One physical term that a damper may or may not have."""

    name: str
    place: Place
    law: str
    """The equation, as the documentation prints it."""
    parameters: tuple[Parameter, ...]
    source: str
    """Where the law comes from."""
    tests: tuple[tuple[Mapping[str, float], float], ...]
    """Reference numbers: the arguments of one of the effect's laws, by name, and what it gives."""
    needs: Need | None = None
    """What must move in a test for the effect to be seen at all."""
    hidden: Hiding | None = None
    """How the blind benchmark draws it; None for what it never hides, a competing form."""
    order: int = 0
    """Where it acts among the effects of its place: those of a smaller number come first."""
    about_zero: bool = False
    """Whether a fit looks for the zero of the displacement too: the law is another about another zero."""
    same_at_every_voltage: bool = False
    """Whether no control signal changes it, as a length or a mass: a fit looks for one value alone."""
    natural: Callable[[Mapping[str, float], float], bool] = _always
    """Whether its parameters are possible together, beside the C of the element [N s/m]."""

    def parameter(self, name: str) -> Parameter:
        """The parameter of that name.

        Raises
        ------
        KeyError : when the effect has no such parameter
        """
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise KeyError(name)
