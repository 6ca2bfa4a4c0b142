"""The roads, one file each: a block of the config that gives a profile. Every module here is found by itself."""

from __future__ import annotations

import importlib
import pkgutil
from abc import abstractmethod
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from pzd.schema.model import OneOfAKind
from pzd.simulate.road.profile import Profile

# ----------------------------------------------------------------------------------------------------
# What a block of the config must give to be a road.


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


# ----------------------------------------------------------------------------------------------------


@cache
def roads() -> dict[str, type[Road]]:
    """The block of every kind of road, by its `kind`."""
    found = [importlib.import_module(f"{__name__}.{info.name}").ROAD for info in pkgutil.iter_modules(__path__)]
    return {road.model_fields["kind"].default: road for road in found}
