"""What a single unevenness of the road has in common: where it begins, how long and how high it is."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np
from pydantic import Field
from typing_extensions import override

from pzd.record import Array
from pzd.schema.errors import ConfigError
from pzd.simulate.road.profile import Profile, through
from pzd.simulate.roads import Road, Way

_KNOTS = 200
"""Knots over its length."""


class Unevenness(Road):
    """A single unevenness on a level road, with finite curvature everywhere."""

    height_m: float = 0.05
    """How high it rises; negative for a hole or a fall."""
    length_m: float = Field(default=1.0, gt=0.0)
    """Length along the road: the wheels never leave it, so this cannot be zero."""
    start_m: float = Field(default=10.0, ge=0.0)
    """Where it begins."""

    @abstractmethod
    def shape(self, along: Array) -> Array:
        """Height as a share of `height_m` over the share 0 to 1 of the length."""

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


def flanked(along: Array, flank: float) -> Array:
    """Height as a share of its largest: up over a flank, level, and down over another one.

    Equation: (1 - cos(pi min(s, 1 - s, f) / f)) / 2

    Parameters
    ----------
    along : (n,) share s of the length, 0 to 1
    flank : share f of the length that each flank takes, up to a half
    """
    rise = np.minimum(np.minimum(along, 1.0 - along), flank) / flank
    return np.asarray(0.5 * (1.0 - np.cos(np.pi * rise)))
