"""What an effect declares of itself: its place, its parameters, its reference numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Place = Literal["drive", "material", "stroke", "flow", "parallel", "sensor"]
"""Where in the damper something can be missing, in physical order."""


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
