"""A road from a file: heights over distance."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field
from typing_extensions import override

from pzd.record import Array
from pzd.schema.errors import DataError, FilesError
from pzd.simulate.profile import Profile, through
from pzd.simulate.road import Road, Way

_HEADER = "distance_m,height_m"


class RoadFile(Road):
    """A measured road: a CSV file with the columns distance_m,height_m."""

    kind: Literal["file"] = "file"
    """A road from a file."""
    path: str
    """The CSV file; a relative path counts from the config."""
    spacing_m: float = Field(default=0.05, gt=0.0)
    """The heights are read at this spacing, by linear interpolation, and joined by a smooth curve."""

    @override
    def own_name(self) -> str:
        return Path(self.path).stem

    @override
    def profile(self, way: Way) -> Profile:
        place, height = _read(way.folder / self.path)
        even = np.arange(0.0, place[-1] - place[0], self.spacing_m)
        return through(np.interp(even, place - place[0], height), self.spacing_m)


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
