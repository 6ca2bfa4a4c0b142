"""A road from a file: heights over distance."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from typing_extensions import override

from pzd.record import Array
from pzd.schema.errors import DataError, FilesError
from pzd.simulate.road.measured import MeasuredRoad

_HEADER = "distance_m,height_m"


class RoadFile(MeasuredRoad):
    """A measured road: a CSV file with the columns distance_m,height_m."""

    kind: Literal["file"] = "file"
    """A road from a file."""

    @override
    def heights(self, path: Path, key: str) -> tuple[Array, Array]:
        try:
            lines = path.read_text(encoding="utf-8").splitlines()
        except OSError as error:
            raise FilesError(f"{path}: cannot be read ({error.strerror})") from error
        if not lines or lines[0].replace(" ", "") != _HEADER:
            raise DataError(f"{path}:1: the header must be {_HEADER} (got {lines[0] if lines else 'nothing'})")
        rows = [_numbers(line) for line in lines[1:]]
        wrong = [
            f"{path}:{n}: two numbers are needed (got {lines[n - 1]})" for n, row in enumerate(rows, 2) if row is None
        ]
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
