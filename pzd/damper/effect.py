"""What an effect declares of itself: its place, its parameters, its reference numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

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

    def admits(self, value: float) -> bool:
        """Whether the value lies within the limits."""
        return math.isfinite(value) and self.low <= value <= self.high


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
    """Reference numbers: the arguments of the module's `law`, and what it gives."""
    needs: Need | None = None
    """What must move in a test for the effect to be seen at all."""
    about_zero: bool = False
    """Whether a fit looks for the zero of the displacement too: the law is another about another zero."""

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
