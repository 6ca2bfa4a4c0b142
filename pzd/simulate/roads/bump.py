"""A single bump or a lasting rise, with finite curvature everywhere."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field
from typing_extensions import override

from pzd.simulate.profile import Profile, through
from pzd.simulate.road import Road, Way

_KNOTS = 200
"""Knots over the length of the bump."""


class Bump(Road):
    """A bump: height h / 2 (1 - cos(2 pi s / L)) over the length L."""

    kind: Literal["bump"] = "bump"
    """A single bump."""
    height_m: float = Field(default=0.05)
    """Height at its top; negative for a hole."""
    length_m: float = Field(default=2.0, gt=0.0)
    """Length along the road."""
    start_m: float = Field(default=10.0, ge=0.0)
    """Where it begins."""

    @override
    def own_name(self) -> str:
        return f"bump-{self.height_m:g}m"

    @override
    def profile(self, way: Way) -> Profile:
        spacing = self.length_m / _KNOTS
        place = spacing * np.arange(round(self.start_m / spacing) + _KNOTS + 2)
        within = np.clip((place - self.start_m) / self.length_m, 0.0, 1.0)
        return through(0.5 * self.height_m * (1.0 - np.cos(2.0 * np.pi * within)), spacing)


ROAD = Bump
