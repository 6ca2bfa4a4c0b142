"""A measured road from an OpenCRG file in its text form: one line along it."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from typing_extensions import override

from pzd.record import Array
from pzd.schema.errors import ConfigError
from pzd.simulate.road.measured import MeasuredRoad, read_grid


class OpenCrg(MeasuredRoad):
    """A line along a road of an OpenCRG file; the bends of its reference line are left out."""

    kind: Literal["opencrg"] = "opencrg"
    """A road of ASAM OpenCRG."""
    offset_m: float = 0.0
    """Place of the line across the road: from the reference line, positive to the left."""

    @override
    def heights(self, path: Path, key: str) -> tuple[Array, Array]:
        grid = read_grid(path)
        low, high = float(grid.across[0]), float(grid.across[-1])
        if not low <= self.offset_m <= high:
            raise ConfigError(
                f"{key}.offset_m: {path} reaches from {low:g} to {high:g} m across the road (got {self.offset_m:g})"
            )
        height = np.array([np.interp(self.offset_m, grid.across, row) for row in grid.heights])
        return grid.increment * np.arange(len(height), dtype=np.float64), height


ROAD = OpenCrg
