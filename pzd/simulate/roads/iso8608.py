"""A road drawn from the spectrum of an ISO 8608 class; each seed is another road of the same class."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field, field_validator
from typing_extensions import override

from pzd.signals.iso8608 import classes
from pzd.signals.iso8608 import profile as drawn
from pzd.simulate.profile import Profile, through
from pzd.simulate.road import Road, Way

_LEAST_LENGTH = 100.0
"""A shorter ride still gets a road of this length [m], so that its long waves are there."""
_RUN_IN = 5.0
"""Length over which the road rises out of the level [m]."""


class Iso8608(Road):
    """A road of ISO 8608, by class."""

    kind: Literal["iso8608"] = "iso8608"
    """A road of ISO 8608."""
    road_class: str = "C"
    """Class A (very good) to H."""
    shortest_wave_m: float = Field(default=0.3, gt=0.0)
    """Waves shorter than this are left out: the tyre's footprint swallows them."""

    @field_validator("road_class")
    @classmethod
    def _known(cls, name: str) -> str:
        if name not in classes():
            raise ValueError(f"there is no class {name}; there are {', '.join(classes())}")
        return name

    @override
    def own_name(self) -> str:
        return f"iso8608-{self.road_class}"

    @override
    def profile(self, way: Way) -> Profile:
        length = max(way.distance, _LEAST_LENGTH)
        draw = np.random.default_rng([way.seed, ord(self.road_class[0])])
        road = drawn(classes()[self.road_class], length, draw, (0.01, 1.0 / self.shortest_wave_m))
        steps = int(16.0 * length / self.shortest_wave_m)
        spacing = length / steps
        place = spacing * np.arange(steps + 1, dtype=np.float64)
        rising = np.clip(place / _RUN_IN, 0.0, 1.0)
        return through(road(place)[0] * rising * rising * (3.0 - 2.0 * rising), spacing)


ROAD = Iso8608
