"""A road from a file: heights over distance."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field
from typing_extensions import override

from pzd.record import Array
from pzd.schema.errors import ConfigError, DataError, FilesError
from pzd.simulate.profile import Profile, through
from pzd.simulate.road import Road, Way

_HEADER = "distance_m,height_m"
_SAME = 1e-9
"""Lengths that differ by less than this share are the same."""


class RoadFile(Road):
    """A measured road: a CSV file with the columns distance_m,height_m."""

    kind: Literal["file"] = "file"
    """A road from a file."""
    path: str
    """The CSV file; a relative path counts from the config."""
    spacing_m: float = Field(default=0.05, gt=0.0)
    """The heights are read at this spacing or a little closer, by linear interpolation, and joined by a smooth
    curve."""

    @override
    def own_name(self) -> str:
        return Path(self.path).stem

    @override
    def profile(self, way: Way) -> Profile:
        path = way.folder / self.path
        place, height = _read(path)
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


def _read(path: Path) -> tuple[Array, Array]:
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise FilesError(f"{path}: cannot be read ({error.strerror})") from error
    if not lines or lines[0].replace(" ", "") != _HEADER:
        raise DataError(f"{path}:1: the header must be {_HEADER} (got {lines[0] if lines else 'nothing'})")
    rows = [_numbers(line) for line in lines[1:]]
    wrong = [f"{path}:{n}: two numbers are needed (got {lines[n - 1]})" for n, row in enumerate(rows, 2) if row is None]
    values = np.array([row for row in rows if row is not None]).reshape(-1, 2)
    if not wrong and (len(values) < 2 or not np.all(np.isfinite(values)) or np.any(np.diff(values[:, 0]) <= 0.0)):
        wrong.append(f"{path}: the distance must rise from row to row, with finite numbers and two rows or more")
    if wrong:
        raise DataError(wrong)
    return values[:, 0], values[:, 1]


def _numbers(line: str) -> tuple[float, float] | None:
    try:
        place, height = (float(cell) for cell in line.split(","))
    except ValueError:
        return None
    return place, height


ROAD = RoadFile
