"""Measured roads: heights over distance from a CSV file, and a line along a road of an OpenCRG file."""

from __future__ import annotations

import math
import re
from abc import abstractmethod
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field
from typing_extensions import override

from pzd.record import Array
from pzd.schema.errors import ConfigError, DataError, FilesError
from pzd.simulate.roads import Profile, Road, Way, through

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
        """Read (n,) places along the road, rising, and heights there [m]; the key is that of the road, for errors."""

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


def _lines(path: Path, encoding: str) -> list[str]:
    try:
        return path.read_text(encoding=encoding).splitlines()
    except OSError as error:
        raise FilesError(f"{path}: cannot be read ({error.strerror})") from error


# --- CSV ---

_HEADER = "distance_m,height_m"


class RoadFile(MeasuredRoad):
    """A measured road: a CSV file with the columns distance_m,height_m."""

    kind: Literal["file"] = "file"
    """A road from a file."""

    @override
    def heights(self, path: Path, key: str) -> tuple[Array, Array]:
        lines = _lines(path, "utf-8")
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


# --- OpenCRG: heights of a road on a grid along a reference line (u) and across it (v) ---
#
# Source: ASAM OpenCRG 1.2, file format; plain-text data `LRFI` (fields of 10 characters) and `LDFI` (of 20), in lines
# of 80, each cross section on lines of its own. Binary data, files that include others and modifiers are refused.


class OpenCrg(MeasuredRoad):
    """A line along a road of an OpenCRG file; the bends of its reference line are left out."""

    kind: Literal["opencrg"] = "opencrg"
    """A road of ASAM OpenCRG."""
    offset_m: float = 0.0
    """Place of the line across the road: from the reference line, positive to the left."""

    @override
    def heights(self, path: Path, key: str) -> tuple[Array, Array]:
        increment, across, heights = read_grid(path)
        low, high = float(across[0]), float(across[-1])
        if not low <= self.offset_m <= high:
            raise ConfigError(
                f"{key}.offset_m: {path} reaches from {low:g} to {high:g} m across the road (got {self.offset_m:g})"
            )
        height = np.array([np.interp(self.offset_m, across, row) for row in heights])
        return increment * np.arange(len(height), dtype=np.float64), height


_WIDTHS = {"LRFI": 10, "LDFI": 20}
"""Characters of a number."""
_LINE = 80
"""Characters of a line of data."""
_SECTIONS = (
    "$CT",
    "$ROAD_CRG",
    "$ROAD_CRG_OPTS",
    "$ROAD_CRG_MPRO",
    "$ROAD_CRG_FILE",
    "$ROAD_CRG_MODS",
    "$KD_DEFINITION",
)
"""A line with one of these begins a section, the next one with a $ sign ends it."""
_REFUSED = {"$ROAD_CRG_FILE": "includes another file", "$ROAD_CRG_MODS": "modifies what it holds"}


@dataclass
class _Head:
    """What stands before the data."""

    numbers: dict[str, float] = field(default_factory=dict)
    form: str = ""
    channels: list[str] = field(default_factory=list)


def read_grid(path: Path) -> tuple[float, Array, Array]:
    """Read the heights of a road.

    Returns
    -------
    distance between two cross sections [m]; (m,) places v of the long sections, left of the reference line positive,
    rising [m]; and (n, m) heights [m], slope and banking of the reference line included

    Raises
    ------
    FilesError : when it cannot be read
    DataError : when it is no plain-text OpenCRG file, or a number in it is none
    """
    lines = _lines(path, "latin-1")
    head, first = _head(path, lines)
    if head.form not in _WIDTHS:
        raise DataError(
            f"{path}: plain-text data of the forms {' and '.join(_WIDTHS)} are read; save it as one of them "
            f"(got {head.form or 'no #: line'})"
        )
    increment = head.numbers.get("REFERENCE_LINE_INCREMENT", 0.0)
    if not increment > 0.0:
        raise DataError(f"{path}: REFERENCE_LINE_INCREMENT above 0 is needed (got {increment:g})")
    records = _records(path, lines, first, head)
    sections = [n for n, name in enumerate(head.channels) if name.startswith("long section")]
    across = np.array([_place(path, head, head.channels[n]) for n in sections])
    order = np.argsort(across, kind="stable")
    if across.size == 0 or np.any(np.diff(across[order]) <= 0.0):
        raise DataError(f"{path}: long sections at places of their own are needed (got {across.size} of them)")
    heights = records[:, sections][:, order]
    slope, bank = (_channel(records, head, name) for name in ("slope", "banking"))
    along = np.concatenate([[0.0], np.cumsum(0.5 * increment * (slope[1:] + slope[:-1]))])
    return increment, across[order], heights + along[:, np.newaxis] + bank[:, np.newaxis] * across[order]


def _head(path: Path, lines: list[str]) -> tuple[_Head, int]:
    """Read what stands before the data, and the index of their first line."""
    head, section = _Head(), ""
    for number, line in enumerate(lines, 1):
        text = line.strip()
        if text.startswith("$$$$"):
            return head, number
        if text.startswith("$"):
            tag = text.split()[0].upper()
            section = tag if section == "" and tag in _SECTIONS else ""
            if section in _REFUSED:
                raise DataError(f"{path}:{number}: the file {_REFUSED[section]}; give one that stands for itself")
            continue
        text = text.split("!")[0].strip()
        if section == "$ROAD_CRG" and "=" in text and not text.startswith("*"):
            key, _, value = text.partition("=")
            head.numbers[key.strip().upper()] = _number(path, number, value)
        elif section == "$KD_DEFINITION" and text.startswith("#:"):
            head.form = text[2:].strip().upper()
        elif section == "$KD_DEFINITION" and text.upper().startswith("D:"):
            head.channels.append(text[2:].strip().lower())
    raise DataError(f"{path}: no line of $ signs begins the data; is it an OpenCRG file?")


def _records(path: Path, lines: list[str], first: int, head: _Head) -> Array:
    """Read (n, c) numbers of every cross section."""
    width, count = _WIDTHS[head.form], len(head.channels)
    a_line = _LINE // width
    each = math.ceil(count / a_line)
    numbered = [(n, line) for n, line in enumerate(lines[first:], first + 1) if line.strip()]
    found = []
    for start in range(0, len(numbered), each):
        values = [
            _number(path, n, line[place : place + width])
            for n, line in numbered[start : start + each]
            for place in range(0, len(line.rstrip()), width)
        ]
        if len(values) != count:
            raise DataError(
                f"{path}:{numbered[start][0]}: a cross section has {count} numbers, {a_line} a line in fields of "
                f"{width} characters (got {len(values)})"
            )
        found.append(values)
    if len(found) < 2:
        raise DataError(f"{path}: two cross sections or more are needed (got {len(found)})")
    return np.array(found)


def _number(path: Path, line: int, text: str) -> float:
    try:
        value = float(text.upper().replace("D", "E"))
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise DataError(f"{path}:{line}: a finite number is needed (got {text.strip() or 'nothing'})")
    return value


def _place(path: Path, head: _Head, name: str) -> float:
    """Return the place v of a long section [m], that it says itself or that follows from its number."""
    said = re.match(r"long section\s+at\s+v\s*=\s*([-+]?\d*\.?\d+(?:e[-+]?\d+)?)", name)
    if said:
        return float(said[1])
    numbered = re.match(r"long section\s+(\d+)", name)
    keys = ("LONG_SECTION_V_RIGHT", "LONG_SECTION_V_INCREMENT")
    if numbered is None or any(key not in head.numbers for key in keys):
        raise DataError(f"{path}: a long section says `at v = ...`, or its number where {' and '.join(keys)} are given")
    return head.numbers[keys[0]] + (int(numbered[1]) - 1) * head.numbers[keys[1]]


def _channel(records: Array, head: _Head, name: str) -> Array:
    """Return (n,) of a channel of the reference line; 0 where it has none."""
    for n, channel in enumerate(head.channels):
        if channel.startswith("reference line") and name in channel:
            return np.asarray(records[:, n])
    return np.zeros(len(records))


ROADS = (RoadFile, OpenCrg)
