"""A hump with cosine ramps and a level top, as speed tables have, with finite curvature everywhere."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator
from typing_extensions import override

from pzd.record import Array
from pzd.simulate.road.unevenness import Unevenness, flanked


class Hump(Unevenness):
    """A hump: h / 2 (1 - cos(pi s / r)) over the ramp r, then level h, and down again over a ramp."""

    kind: Literal["hump"] = "hump"
    """A cosine hump."""
    height_m: float = Field(default=0.1, gt=0.0)
    """How high its top is."""
    length_m: float = Field(default=4.0, gt=0.0)
    """Length along the road, with both ramps."""
    ramp_m: float = Field(default=1.0, gt=0.0)
    """Length of each ramp; half of `length_m` leaves no level top."""

    @model_validator(mode="after")
    def _ramps_fit(self) -> Hump:
        if 2.0 * self.ramp_m > self.length_m:
            raise ValueError(f"ramp_m: two ramps are longer than length_m (got {self.ramp_m:g} of {self.length_m:g} m)")
        return self

    @override
    def own_name(self) -> str:
        return f"hump-{self.height_m:g}m"

    @override
    def shape(self, along: Array) -> Array:
        return flanked(along, self.ramp_m / self.length_m)


ROAD = Hump
