"""What measured roads have in common: a file of heights, which must reach as far as the ride."""

from __future__ import annotations

import math
from abc import abstractmethod
from pathlib import Path

import numpy as np
from pydantic import Field
from typing_extensions import override

from pzd.record import Array
from pzd.schema.errors import ConfigError, DataError, FilesError
from pzd.simulate.profile import Profile, through
from pzd.simulate.road import Road, Way

_SAME = 1e-9
"""Lengths that differ by less than this share are the same."""


class MeasuredRoad(Road):
    """A road from a file."""

    path: str
    """The file; a relative path counts from the config."""
    spacing_m: float = Field(default=0.05, gt=0.0)
    """The heights are read at this spacing or a little closer, by linear interpolation, and joined by a smooth
    curve."""

    @abstractmethod
    def heights(self, path: Path, key: str) -> tuple[Array, Array]:
        """(n,) places along the road, rising, and heights there [m]; the key is that of the road, for errors."""

    @override
    def own_name(self) -> str:
        return Path(self.path).stem

    @override
    def profile(self, way: Way) -> Profile:
        path = way.folder / self.path
        if not path.is_file():
            raise ConfigError(
                f"{way.key}.path: there is no such file; the path counts from the config (got {self.path})"
            )
        try:
            place, height = self.heights(path, way.key)
        except (DataError, FilesError) as error:
            raise ConfigError(f"{way.key}.path: {message}" for message in error.messages) from error
        length = float(place[-1] - place[0])
        if length < way.distance * (1.0 - _SAME):
            raise ConfigError(
                f"{way.key}.path: {path} is shorter than the ride: {way.distance:.6g} m are needed for "
                f"{way.distance / way.vehicle_speed:g} s at {way.vehicle_speed:.4g} m/s; make simulate.duration_s "
                f"{length / way.vehicle_speed:.4g} s or less, or give a longer road (got {length:.6g} m)"
            )
        spaces = math.ceil(length / self.spacing_m * (1.0 - _SAME))
        even = np.linspace(0.0, length, spaces + 1)
        return through(np.interp(even, place - place[0], height), length / spaces)
