"""Accelerations of a ride from a file: columns of axes, units from their headers, the rate from the clock.

Files of any format that rigs write are read; so is the history of a simulated ride.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pzd.comfort.rating import UNITS, same_in
from pzd.record import Array, clock_fault
from pzd.rig.config import FilesEntry
from pzd.rig.files.formats import TEXT, read_sheet
from pzd.rig.files.sheet import LIKE_A_CLOCK, Sheet, Wanted
from pzd.rig.files.sniffing import Dialect, described
from pzd.schema.errors import ConfigError, DataError, no_file

_EVEN = 0.01
"""Largest departure of a sample from an even clock, in steps, that is none: a stamp is rounded by as much."""
_GAP = 1.5
"""A step of so many usual ones is a gap, in which nothing is known."""
_UNIT = re.compile(r"[\[(]\s*(m/s\^?2|m/s²|m/s\*\*2|m s-2|g|gn|rad/s\^?2|rad/s²)\s*[\])]\s*$|_(m_per_s2|g|rad_per_s2)$")
_AXIS = re.compile(r"(?<![a-z])(?:a|acc|accel|acceleration|beschl\w*)?[ _.]*(r?[xyz])(?![a-z])", re.IGNORECASE)
_OF_A_RIDE = "a_K_m_per_s2"
"""Column of a simulated ride: the vertical acceleration at K."""


@dataclass(frozen=True, eq=False)
class RideRecord:
    """Accelerations at even steps."""

    acceleration: Array
    """(n, m) [m/s2], of a rotation [rad/s2]."""
    rate: float
    """[Hz]"""
    columns: tuple[str, ...]
    """The m headers in the file."""


def read_ride(
    path: Path,
    axes: Sequence[str],
    unit: str | None = None,
    columns: Mapping[str, str] | None = None,
    rate_Hz: float | None = None,
) -> RideRecord:
    """Read the accelerations of a ride.

    Parameters
    ----------
    path : the file
    axes : m of them, in the order wanted
    unit : of all of them; by default what the headers say
    columns : axis, or `time`, -> header in the file, where it cannot be told
    rate_Hz : sampling rate, where no column holds the time

    Raises
    ------
    ConfigError : when it cannot be told which column or unit is meant
    DataError : when the file cannot be used
    FilesError : when it cannot be read
    """
    if not path.is_file():
        raise ConfigError(f"{path}: {no_file(path)}")
    dialect, form = described(path)
    named = dict(columns or {})
    heads = {axis: _head_of(path, axis, dialect.header, named, alone=len(axes) == 1) for axis in axes}
    clock = None if rate_Hz is not None else _clock_of(path, dialect.header, named)
    wanted = [*heads.values()] + ([clock] if clock is not None else [])
    sheet = read_sheet(path, _entry(path, dialect, form), Wanted(frozenset(wanted), frozenset(wanted)), str(path))
    factors = {axis: unit or _unit_of(path, head, sheet) for axis, head in heads.items()}
    acceleration = np.column_stack([same_in(factors[axis], _cells(sheet, head)) for axis, head in heads.items()])
    if clock is None:
        return RideRecord(acceleration, float(rate_Hz or 0.0), tuple(heads.values()))
    even, rate = _at_even_steps(sheet, _cells(sheet, clock) * _seconds(clock, sheet), acceleration)
    return RideRecord(even, rate, tuple(heads.values()))


def _entry(path: Path, dialect: Dialect, form: str) -> FilesEntry:
    if form != TEXT:
        return FilesEntry(path=str(path))
    return FilesEntry(
        path=str(path),
        skip=dialect.skip,
        units_row=dialect.units_row,
        separator=dialect.separator,
        decimal=dialect.decimal,
        encoding=dialect.encoding,
    )


def _head_of(path: Path, axis: str, header: Sequence[str], named: Mapping[str, str], *, alone: bool) -> str:
    """Return the header of an axis: as named, by its letter, or the only column that is no clock."""
    if axis in named:
        return _there(path, named[axis], header)
    others = [head for head in header if not LIKE_A_CLOCK.search(head)]
    if alone and axis == "z" and _OF_A_RIDE in others:
        return _OF_A_RIDE
    found = [head for head in others if any(m[1].lower() == axis for m in _AXIS.finditer(_UNIT.sub("", head)))]
    if not found and alone and len(others) == 1:
        found = others
    if len(found) == 1:
        return found[0]
    which = (
        f"several columns may be it: {', '.join(found)}" if found else f"no column is called so: {', '.join(header)}"
    )
    raise ConfigError(f"{path}: axis {axis}: {which}; say --column {axis}=HEADER")


def _clock_of(path: Path, header: Sequence[str], named: Mapping[str, str]) -> str:
    if "time" in named:
        return _there(path, named["time"], header)
    found = [head for head in header if LIKE_A_CLOCK.search(head)]
    if len(found) != 1:
        which = f"several columns may be it: {', '.join(found)}" if found else f"no column is one: {', '.join(header)}"
        raise ConfigError(f"{path}: clock: {which}; say --column time=HEADER, or --rate N for N samples a second")
    return found[0]


def _there(path: Path, name: str, header: Sequence[str]) -> str:
    if name not in header:
        raise ConfigError(f"{path}: no such column; there are {', '.join(header)} (got {name})")
    return name


def _cells(sheet: Sheet, head: str) -> Array:
    column = sheet.header.index(head)
    if column in sheet.faults:
        raise DataError(sheet.faults[column])
    cells = sheet.numbers[column]
    empty = np.flatnonzero(~np.isfinite(cells))
    if empty.size:
        more = f" ({empty.size} such cells)" if empty.size > 1 else ""
        raise DataError(f"{sheet.place(int(empty[0]))}: {head}: empty cell{more}")
    return cells


def _unit_of(path: Path, head: str, sheet: Sheet) -> str:
    """Return the unit in a header or below it."""
    below = sheet.units[sheet.header.index(head)].strip("[]() ") if sheet.units else ""
    found = _UNIT.search(head)
    text = (found[1] or found[2]) if found else below
    said = {"m_per_s2": "m/s2", "rad_per_s2": "rad/s2", "gn": "g", "m s-2": "m/s2"}.get(text, text)
    said = said.replace("²", "2").replace("^", "").replace("**", "")
    if said in UNITS:
        return said
    raise ConfigError(f"{path}: {head}: its unit cannot be told; say --unit m/s2 or --unit g")


def _seconds(clock: str, sheet: Sheet) -> float:
    below = sheet.units[sheet.header.index(clock)].strip("[]() ") if sheet.units else ""
    return 1e-3 if re.search(r"[\[(]\s*ms\s*[\])]|_ms$", clock) or below == "ms" else 1.0


def _at_even_steps(sheet: Sheet, time: Array, acceleration: Array) -> tuple[Array, float]:
    """Return the samples at even steps, and their rate; a clock that scatters is straightened by interpolation."""
    if time.size < 2:
        raise DataError(f"{sheet.top}: only {time.size} data rows")
    if fault := clock_fault(time):
        raise DataError(f"{sheet.place(fault[0])}: {fault[1]}")
    steps = np.diff(time)
    usual = float(np.median(steps))
    gaps = np.flatnonzero(steps > _GAP * usual)
    if gaps.size:
        row = int(gaps[0]) + 1
        more = f", and {gaps.size - 1} more such gaps" if gaps.size > 1 else ""
        raise DataError(
            f"{sheet.place(row)}: the clock leaps by {steps[row - 1]:.4g} s, not {usual:.4g} s{more}; rate each part"
        )
    mean = float(time[-1] - time[0]) / steps.size
    even = time[0] + mean * np.arange(time.size)
    if np.max(np.abs(time - even)) > _EVEN * mean:
        acceleration = np.column_stack([np.interp(even, time, column) for column in acceleration.T])
    return acceleration, 1.0 / mean
