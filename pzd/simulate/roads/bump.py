"""A single bump, with finite curvature everywhere."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field
from typing_extensions import override

from pzd.record import Array
from pzd.simulate.road.unevenness import Unevenness


class Bump(Unevenness):
    """A bump: height h / 2 (1 - cos(2 pi s / L)) over the length L."""

    kind: Literal["bump"] = "bump"
    """A single bump."""
    length_m: float = Field(default=2.0, gt=0.0)
    """Length along the road."""

    @override
    def own_name(self) -> str:
        return f"bump-{self.height_m:g}m"

    @override
    def shape(self, along: Array) -> Array:
        return np.asarray(0.5 * (1.0 - np.cos(2.0 * np.pi * along)))


ROAD = Bump
