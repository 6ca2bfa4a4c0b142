"""Single events on a level road: bump, hump, pothole and step, with finite curvature everywhere."""

from __future__ import annotations

from abc import abstractmethod
from typing import Literal

import numpy as np
from pydantic import Field, model_validator
from typing_extensions import override

from pzd.record import Array
from pzd.schema.errors import ConfigError
from pzd.simulate.roads import Profile, Road, Way, through

_KNOTS = 200
"""Knots over the length of an event."""


class Unevenness(Road):
    """A single unevenness on a level road, with finite curvature everywhere."""

    height_m: float = 0.05
    """How high it rises; negative for a hole or a fall."""
    length_m: float = Field(default=1.0, gt=0.0)
    """Length along the road: the wheels never leave it, so this cannot be zero."""
    start_m: float = Field(default=10.0, ge=0.0)
    """Where it begins."""

    @override
    def own_name(self) -> str:
        return f"{self.kind}-{self.height_m:g}m"

    @abstractmethod
    def shape(self, along: Array) -> Array:
        """Return the height as a share of `height_m` over the share 0 to 1 of the length."""

    @property
    @override
    def event(self) -> tuple[float, float] | None:
        return self.start_m, self.start_m + self.length_m

    @override
    def profile(self, way: Way) -> Profile:
        if self.start_m >= way.distance:
            raise ConfigError(
                f"{way.key}.start_m: the ride ends after {way.distance:.6g} m, before the {self.kind} "
                f"(got {self.start_m:g} m)"
            )
        spacing = self.length_m / _KNOTS
        place = spacing * np.arange(round(self.start_m / spacing) + _KNOTS + 2)
        return through(self.height_m * self.shape(np.clip((place - self.start_m) / self.length_m, 0.0, 1.0)), spacing)


class Bump(Unevenness):
    """A bump: height h / 2 (1 - cos(2 pi s / L)) over the length L."""

    kind: Literal["bump"] = "bump"
    """A single bump."""
    length_m: float = Field(default=2.0, gt=0.0)
    """Length along the road."""

    @override
    def shape(self, along: Array) -> Array:
        return np.asarray(0.5 * (1.0 - np.cos(2.0 * np.pi * along)))


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
    def shape(self, along: Array) -> Array:
        return flanked(along, self.ramp_m / self.length_m)


class Pothole(Unevenness):
    """A hole: -d / 2 (1 - cos(pi s / e)) over the edge e, then level at the depth d, and up again over an edge."""

    kind: Literal["pothole"] = "pothole"
    """A hole."""
    height_m: float = Field(default=-0.05, lt=0.0)
    """Its bottom, below zero."""
    length_m: float = Field(default=0.8, gt=0.0)
    """Length along the road, with both edges."""
    edge_m: float = Field(default=0.2, gt=0.0)
    """Length of each edge: the footprint of a tyre rolls over a sharp one about so softly."""

    @model_validator(mode="after")
    def _edges_fit(self) -> Pothole:
        if 2.0 * self.edge_m > self.length_m:
            raise ValueError(f"edge_m: two edges are longer than length_m (got {self.edge_m:g} of {self.length_m:g} m)")
        return self

    @override
    def own_name(self) -> str:
        return f"pothole-{-self.height_m:g}m"

    @override
    def shape(self, along: Array) -> Array:
        return flanked(along, self.edge_m / self.length_m)


class Step(Unevenness):
    """A rise by h over the length L: h (10 r^3 - 15 r^4 + 6 r^5), r = s / L."""

    kind: Literal["step"] = "step"
    """A lasting rise."""

    @override
    def shape(self, along: Array) -> Array:
        return np.asarray(along**3 * (10.0 - 15.0 * along + 6.0 * along**2))


def flanked(along: Array, flank: float) -> Array:
    """Return the height as a share of its largest: up over a flank, level, and down over another one.

    Equation: (1 - cos(pi min(s, 1 - s, f) / f)) / 2

    Parameters
    ----------
    along : (n,) share s of the length, 0 to 1
    flank : share f of the length that each flank takes, up to a half
    """
    rise = np.minimum(np.minimum(along, 1.0 - along), flank) / flank
    return np.asarray(0.5 * (1.0 - np.cos(np.pi * rise)))


ROADS = (Bump, Hump, Pothole, Step)
