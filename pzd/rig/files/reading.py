"""One rig file into its tests: the channels in SI, cut where the config says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pzd.quantities import ACCELERATION, CHANNELS, PRESSURE, TEMPERATURE, TIME, VELOCITY, VOLTAGE, Control, Quantity
from pzd.rig.config import FilesEntry, Split
from pzd.rig.files.channels import ALSO_READ, Source, Values, own, said, sources
from pzd.rig.files.formats import reader
from pzd.rig.files.listing import Listed
from pzd.rig.files.sheet import Array, Sheet
from pzd.rig.files.units import UnitError, to_canonical
from pzd.schema.errors import ConfigError, DataError, at

OPTIONAL = (VELOCITY, ACCELERATION, VOLTAGE, TEMPERATURE, PRESSURE)
"""Quantities whose column may be wholly empty, which counts as absent."""


@dataclass(frozen=True, eq=False)
class Test:
    """One test of one file, in SI and degC; every channel is (n,)."""

    __test__ = False

    path: Path
    number: int | None
    """Which test of the file, None where it holds one."""
    setting: str | None
    channels: dict[Quantity, Array]
    """By canonical quantity; the control signal under `VOLTAGE`."""
    sheet: Sheet
    first: int
    """Row of the sheet at which the test begins."""

    def place(self, row: int) -> str:
        """File and line of one sample."""
        return at(self.path, self.sheet.line(self.first + row))


def read(file: Listed, control: Control) -> tuple[Test, ...]:
    """Read every test of one file.

    Raises
    ------
    ConfigError : when the config does not say, or says wrongly, how to read it
    DataError : when a column is missing or doubled, or a cell is bad or empty
    FilesError : when the file cannot be read
    """
    entry, place = file.entry, file.place
    values, setting = said(entry, place, control, file.path)
    sheet = reader(file.path, entry.format, place)(file.path, entry, _wanted(entry, control))
    channels = _channels(sheet, sources(sheet, entry, place, control), control, place, whole=entry.split is None)
    starts = [0] if entry.split is None else _starts(sheet, entry.split, channels[TIME], place)
    bounds = list(zip(starts, [*starts[1:], sheet.rows], strict=True))
    _one_value_a_test(values, len(bounds), place, file.path, control)
    return tuple(
        Test(
            file.path,
            index + 1 if len(bounds) > 1 else None,
            setting,
            _piece(channels, values, index, first, last),
            sheet,
            first,
        )
        for index, (first, last) in enumerate(bounds)
    )


def _wanted(entry: FilesEntry, control: Control) -> set[str]:
    return {own(q, control).column for q in CHANNELS} | set(ALSO_READ.values()) | set(entry.columns.values())


def _channels(
    sheet: Sheet, found: tuple[Source, ...], control: Control, place: str, *, whole: bool
) -> dict[Quantity, Array]:
    """Every channel in SI; `whole` says that the file is one test, in which the clock must go on."""
    dated = [s for s in found if s.quantity is TIME and "%" in s.unit]
    try:
        numbers = sheet.numbers([s.column for s in found if s not in dated])
    except DataError as error:
        raise DataError([*error.messages, *(_stopped(sheet, found) if whole else [])]) from None
    channels: dict[Quantity, Array] = {s.quantity: _instants(sheet, s) for s in dated}
    faults: list[str] = []
    for source in found:
        if source in dated:
            continue
        values = numbers[source.column]
        empty = np.flatnonzero(np.isnan(values))
        if empty.size == values.size and source.quantity in OPTIONAL:
            continue
        if empty.size:
            line = at(sheet.path, sheet.line(int(empty[0])))
            more = f" ({empty.size} such cells)" if empty.size > 1 else ""
            faults.append(f"{line}: {sheet.header[source.column]}: empty cell{more}")
            continue
        try:
            channels[source.quantity] = source.sign * to_canonical(values, source.unit, own(source.quantity, control))
        except UnitError as fault:
            raise ConfigError(f"{place}.units: {fault} (in {sheet.path})") from None
    if faults:
        raise DataError(faults + (_stopped(sheet, found) if whole else []))
    return channels


def _stopped(sheet: Sheet, found: tuple[Source, ...]) -> list[str]:
    """Where the clock stands still in a file with other faults too; empty where it cannot be read."""
    (clock,) = (source for source in found if source.quantity is TIME)
    if "%" in clock.unit:
        return []
    try:
        time = sheet.numbers([clock.column])[clock.column]
    except DataError:
        return []
    return standstills(time, lambda row: at(sheet.path, sheet.line(row)))


def standstills(time: Array, place: Callable[[int], str]) -> list[str]:
    """Where the clock stands still or goes back, in a line; empty where it goes on. NaN is another's fault.

    Parameters
    ----------
    time : (n,) [s]
    place : gives file and line of a row
    """
    backwards = np.flatnonzero(np.diff(time) <= 0.0)
    if not backwards.size:
        return []
    row = int(backwards[0]) + 1
    more = f", and {backwards.size - 1} more such rows" if backwards.size > 1 else ""
    return [f"{place(row)}: time does not increase: {time[row]:.9g} s after {time[row - 1]:.9g} s{more}"]


def _instants(sheet: Sheet, source: Source) -> Array:
    """Dates and times as seconds since the first."""
    import pandas as pd

    cells = sheet.texts(source.column)
    instants = pd.to_datetime(pd.Series(cells), format=source.unit, errors="coerce")
    bad = np.flatnonzero(instants.isna().to_numpy())
    if bad.size:
        row = int(bad[0])
        more = f" ({bad.size} such cells)" if bad.size > 1 else ""
        raise DataError(
            f"{at(sheet.path, sheet.line(row))}: {sheet.header[source.column]}: "
            f"no date and time like {source.unit}{more} (got {cells[row]!r})"
        )
    return np.asarray((instants - instants[0]).dt.total_seconds(), dtype=np.float64)


def _starts(sheet: Sheet, split: Split, time: Array, place: str) -> list[int]:
    """First rows of the tests."""
    if split.gap_s is not None:
        jump = np.diff(time)
        new = (jump > split.gap_s) | (jump < 0.0)
        return [0, *(int(row) + 1 for row in np.flatnonzero(new))]
    header = split.column or split.event or ""
    if sheet.header.count(header) != 1:
        raise DataError(f"{at(sheet.path, sheet.header_line)}: {place}.split: no single column {header!r}")
    cells = np.array(sheet.texts(sheet.header.index(header)))
    if split.column is not None:
        begins: NDArray[np.bool_] = cells[1:] != cells[:-1]
    else:
        begins = np.char.find(cells[1:], split.begins or "") >= 0
    return [0, *(int(row) + 1 for row in np.flatnonzero(begins))]


def _one_value_a_test(values: Values, tests: int, place: str, path: Path, control: Control) -> None:
    faults = [
        f"{place}.split.constants: {own(quantity, control).name}: {len(given)} values for {tests} tests in {path}"
        for quantity, given in values.items()
        if len(given) not in (1, tests)
    ]
    if faults:
        raise ConfigError(faults)


def _piece(channels: dict[Quantity, Array], values: Values, index: int, first: int, last: int) -> dict[Quantity, Array]:
    piece = {quantity: column[first:last] for quantity, column in channels.items()}
    for quantity, given in values.items():
        piece[quantity] = np.full(last - first, given[index if len(given) > 1 else 0])
    return piece
