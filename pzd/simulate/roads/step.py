"""A lasting rise of the road over a short ramp, with finite curvature everywhere."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field
from typing_extensions import override

from pzd.simulate.profile import Profile, through
from pzd.simulate.road import Road, Way

_KNOTS = 200
"""Knots over the length of the ramp."""


class Step(Road):
    """A rise by h over the length L: h (10 r^3 - 15 r^4 + 6 r^5), r = s / L."""

    kind: Literal["step"] = "step"
    """A lasting rise."""
    height_m: float = Field(default=0.05)
    """How much the road rises; negative for a fall."""
    length_m: float = Field(default=1.0, gt=0.0)
    """Length of the ramp: the wheels never leave the road, so it cannot be nought."""
    start_m: float = Field(default=10.0, ge=0.0)
    """Where it begins."""

    @override
    def own_name(self) -> str:
        return f"step-{self.height_m:g}m"

    @override
    def profile(self, way: Way) -> Profile:
        spacing = self.length_m / _KNOTS
        place = spacing * np.arange(round(self.start_m / spacing) + _KNOTS + 2)
        r = np.clip((place - self.start_m) / self.length_m, 0.0, 1.0)
        return through(self.height_m * r**3 * (10.0 - 15.0 * r + 6.0 * r**2), spacing)


ROAD = Step
