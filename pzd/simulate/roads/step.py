"""A lasting rise of the road over a short ramp, with finite curvature everywhere."""

from __future__ import annotations

from typing import Literal

import numpy as np
from typing_extensions import override

from pzd.record import Array
from pzd.simulate.road.unevenness import Unevenness


class Step(Unevenness):
    """A rise by h over the length L: h (10 r^3 - 15 r^4 + 6 r^5), r = s / L."""

    kind: Literal["step"] = "step"
    """A lasting rise."""

    @override
    def own_name(self) -> str:
        return f"step-{self.height_m:g}m"

    @override
    def shape(self, along: Array) -> Array:
        return np.asarray(along**3 * (10.0 - 15.0 * along + 6.0 * along**2))


ROAD = Step
