"""Motion from a file: the cubic spline through its samples, with exact derivatives."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from pzd.quantities import DISPLACEMENT, TIME, Control
from pzd.record import Array, clock_fault
from pzd.rig.stand.waveforms import Course, Waveform
from pzd.schema.csvfile import read_columns
from pzd.schema.errors import ConfigError, DataError, at


class FileMotion(Waveform):
    """A measured or computed motion: a CSV file with the columns time_s,displacement_m."""

    usual_cycles: ClassVar[int] = 1

    kind: Literal["file"] = "file"
    """A motion from a file."""
    path: str = Field(min_length=1)
    """The CSV file; a relative path counts from the config. Between its samples the motion is a cubic spline."""

    def own_name(self) -> str:
        """Return the stem of the file."""
        return Path(self.path).stem

    def cycle(self, folder: Path) -> float:
        """Return the length of the file."""
        time, _ = _read(folder / self.path)
        return float(time[-1] - time[0])

    def course(self, draw: np.random.Generator, folder: Path) -> Course:
        """Return the spline; before the file begins, a smooth approach from rest, and rest after it has ended."""
        from scipy.interpolate import CubicSpline

        time, displacement = _read(folder / self.path)
        spline = CubicSpline(time - time[0], displacement)
        slope, bend = spline.derivative(1), spline.derivative(2)
        first = float(spline(0.0)), float(slope(0.0)), float(bend(0.0))

        def motion(at_time: Array) -> tuple[Array, Array, Array]:
            inside = np.clip(at_time, 0.0, time[-1] - time[0])
            x, v, a = spline(inside), slope(inside), bend(inside)
            before = at_time < 0.0
            x[before], v[before], a[before] = _approach(at_time[before], *first, self.settling_time)
            return x, v, a

        return motion


def _approach(time: Array, x: float, v: float, a: float, lead: float) -> tuple[Array, Array, Array]:
    """Compute a quintic from rest half-way back along the first speed into x, v, a at time 0."""
    start = x - 0.5 * v * lead
    r = time / lead + 1.0
    rows = [[1.0, 1.0, 1.0], [3.0, 4.0, 5.0], [6.0, 12.0, 20.0]]
    c3, c4, c5 = np.linalg.solve(np.array(rows), np.array([x - start, v * lead, a * lead**2]))
    place = start + r**3 * (c3 + r * (c4 + r * c5))
    speed = r**2 * (3.0 * c3 + r * (4.0 * c4 + r * 5.0 * c5)) / lead
    return place, speed, r * (6.0 * c3 + r * (12.0 * c4 + r * 20.0 * c5)) / lead**2


def _read(path: Path) -> tuple[Array, Array]:
    if not path.is_file():
        raise ConfigError(f"{path}: the file of the waveform is missing; the path is relative to the config's folder")
    columns = read_columns(path, (TIME.column, DISPLACEMENT.column), Control())
    time, displacement = columns[TIME.column], columns[DISPLACEMENT.column]
    if time.size < 4:
        raise DataError(f"{at(path)}: a motion needs four samples or more (got {time.size})")
    if fault := clock_fault(time):
        raise DataError(f"{at(path, fault[0] + 2)}: {fault[1]}")
    return time, displacement


WAVEFORM = FileMotion
