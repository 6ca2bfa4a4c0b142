"""What a block of the config must give to be a road."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from pathlib import Path

from pzd.schema.model import OneOfAKind
from pzd.simulate.profile import Profile


@dataclass(frozen=True)
class Way:
    """What a road may ask of the ride."""

    vehicle_speed: float
    """[m/s]."""
    distance: float
    """Length of the ride [m]."""
    seed: int
    """Of the run, for roads that are drawn."""
    folder: Path
    """Of the config, for roads that are read."""
    key: str = "simulate.roads"
    """Of the road in the config, for errors."""


class Road(OneOfAKind):
    """A road under the wheels; each kind is one file in `roads/` with a `kind` of its own."""

    @property
    def event(self) -> tuple[float, float] | None:
        """Where a single event begins and ends on a level road [m]; None on a road that goes on and on."""
        return None

    @abstractmethod
    def profile(self, way: Way) -> Profile:
        """The road as the car meets it: height over distance."""
