"""A test that two loggers recorded, each into a file and by a clock of its own: joined before anything else is done.

The clock of the second is put on that of the first: as it is where both count from one instant; by the pulses of an
event that both recorded, which tell a different pace as well; or by a column that both recorded, such as the
displacement, where the two agree best. From there on they are channels of several clocks in one file, see `one_clock`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from fnmatch import translate
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pzd.quantities import TIME
from pzd.record import Array, clock_fault
from pzd.rig.config import Beside, FilesEntry
from pzd.rig.files.channels import instants
from pzd.rig.files.formats import read_sheet
from pzd.rig.files.layout import ChannelSpec, Layout, layouts
from pzd.rig.files.one_clock import on_one_clock, resampled
from pzd.rig.files.sheet import FileTable, ReadingStep, Sheet, Wanted, sheet_of
from pzd.rig.files.sniffing import described
from pzd.rig.files.units import UnitError, in_header, to_canonical
from pzd.schema.errors import ConfigError, DataError, at

CLOCK = "time of both loggers"
"""Header of the clock of the joined table."""
BESIDE = "beside: "
"""In front of the headers of the second logger."""
SAME_PACE = 1e-3
"""Share by which the paces of two clocks may differ: quartz keeps to 1e-4, and a wrong pulse shows far more."""
SAME_SIGNAL = 0.95
"""Correlation from which on two columns show the same signal: noise of a third of the signal leaves as much."""
NO_DOUBT = 0.02
"""By so much the best agreement of two columns must exceed any other: a motion that repeats agrees at every period."""
LEAST_OVERLAP = 0.5
"""Share of the shorter record in which both must have run."""


def with_other_logger(path: Path, layout: Layout, beside: Beside) -> tuple[Sheet, Layout]:
    """Read a file and that of the other logger, as one sheet on one clock.

    Parameters
    ----------
    path : the file of the first logger
    layout : specification of its quantities
    beside : the second logger, its path from the current folder

    Returns
    -------
    the sheet, and the layout by which its columns are read

    Raises
    ------
    ConfigError : when the config does not describe the files
    DataError : when the clocks cannot be aligned
    """
    entry = layout.entry
    place = f"{layout.place}.beside"
    other = _file_beside(path, entry, beside, place)
    sync = beside.event or beside.column or ("", "")
    first = _Logger.read(path, entry, {TIME.name: entry.columns.get(TIME.name, TIME.column)}, layout, sync[0])
    dialect, form = described(other)
    theirs = dialect.entry(other, form).model_copy(update={"columns": beside.columns, "units": beside.units})
    second = _Logger.read(other, theirs, beside.columns, replace(layout, place=place), sync[1])
    pace, offset, how = _aligned(first, second, beside, place)
    step = ReadingStep("clock", None, f"{other.name}, {how}", _in_words(pace, offset, path.name))
    merged = _merged(entry, beside, layout)
    joined_layout = replace(layouts((merged,), layout.control, Path())[0], place=layout.place)
    wanted = joined_layout.wanted()
    mine = first.table({head: head for head in first.sheet.header if head in wanted.numbers})
    others = {head: f"{BESIDE}{head}" for name, head in beside.columns.items() if name != TIME.name}
    table = replace(second.table(others), begins=offset, steps=(step,))
    table = replace(table, cells=(pace * np.asarray(table.cells[0]), *table.cells[1:]))
    joined = on_one_clock(path, [mine, table], wanted)
    return sheet_of(path, joined, (), wanted), joined_layout


def _file_beside(path: Path, entry: FilesEntry, beside: Beside, place: str) -> Path:
    """Return the file of the other logger: `*` in its path stands for what `*` in that of the first matched."""
    pattern = Path(entry.path).name
    starred = re.fullmatch(translate(pattern).replace(".*", "(.*)", 1), path.name) if pattern.count("*") == 1 else None
    middle = starred[1] if starred else path.stem
    other = Path(beside.path.replace("*", middle))
    if not other.is_file():
        raise ConfigError(
            f"{place}.path: no such file for {path.name}; * stands for {middle!r} here, what * of path matched (got "
            f"{other.as_posix()!r})"
        )
    return other


def _merged(entry: FilesEntry, beside: Beside, layout: Layout) -> FilesEntry:
    """Return the entry that reads the joined sheet."""
    mine = {name: head for name, head in entry.columns.items() if name != TIME.name}
    theirs = {name: f"{BESIDE}{head}" for name, head in beside.columns.items() if name != TIME.name}
    twice = sorted(mine.keys() & theirs.keys())
    if twice:
        raise ConfigError(f"{layout.place}.beside.columns: {twice[0]}: said twice, here and under columns")
    units = {name: unit for name, unit in (*entry.units.items(), *beside.units.items()) if name != TIME.name}
    columns = {**mine, **theirs, TIME.name: CLOCK}
    return entry.model_copy(update={"columns": columns, "units": {**units, TIME.name: "s"}, "beside": None})


def _in_words(pace: float, offset: float, name: str) -> str:
    quick = f", each of its seconds {pace:.7g} s" if pace != 1.0 else ""
    return f"its 0 is {offset:.6g} s on the clock of {name}{quick}"


# --- One logger's file ---


@dataclass(frozen=True, eq=False)
class _Logger:
    """A file as read, with its clock in seconds."""

    sheet: Sheet
    specs: Mapping[str, ChannelSpec]
    """Specification of the quantity in a column, by its header."""
    time: Array
    """(n,) [s]"""
    begun: datetime | None
    """Instant of its first sample, where the clock is one of dates; the time then counts from it."""
    sync: str
    """Header of the event or column that both recorded; empty where none is needed."""

    @classmethod
    def read(cls, path: Path, entry: FilesEntry, columns: Mapping[str, str], layout: Layout, sync: str) -> _Logger:
        """Read a file.

        Raises
        ------
        ConfigError : when the clock has no unit
        DataError : when a column is missing, the file holds several recordings, or the clock is none
        """
        bare = entry.model_copy(update={"beside": None})
        (own,) = layouts((bare,), layout.control, Path())
        own = replace(own, place=layout.place)
        specs = {head: spec for spec in own.channels for head in spec.headers}
        head = columns[TIME.name]
        unit = entry.units.get(TIME.name) or in_header(head, TIME) or ("s" if head == TIME.column else "")
        dated = "%" in unit
        wanted = own.wanted()
        numbers = wanted.numbers | {sync} - {""} | (set() if dated else {head})
        clock = frozenset((head,))
        asked = Wanted(
            wanted.known | {sync, head}, numbers, wanted.texts | (clock if dated else frozenset()), needed=(clock,)
        )
        sheet = read_sheet(path, bare, asked, layout.place)
        lacking = [name for name in (*columns.values(), sync) if name and name not in sheet.header]
        if lacking:
            raise DataError(f"{sheet.top}: missing column {lacking[0]} (got {', '.join(sheet.header)})")
        if len(sheet.starts) > 1:
            raise DataError(f"{at(path)}: holds {len(sheet.starts)} recordings; a logger's file beside another has one")
        index = sheet.header.index(head)
        unit = unit or (sheet.units[index].strip("[]() ") if sheet.units else "")
        if not unit:
            raise ConfigError(
                f"{layout.place}.units: time: the header {head!r} of {path} names no unit; say it, e.g. "
                "units: {time: s}"
            )
        return cls(sheet, specs, *_clock(sheet, index, unit, layout.place), sync)

    @property
    def step(self) -> float:
        """Median step of its clock [s]."""
        return float(np.median(np.diff(self.time)))

    def values(self, head: str) -> Array:
        """Return the (n,) numbers of a column.

        Raises
        ------
        DataError : when a cell is none
        """
        index = self.sheet.header.index(head)
        if index in self.sheet.faults:
            raise DataError(self.sheet.faults[index])
        return self.sheet.numbers[index]

    def table(self, named: Mapping[str, str]) -> FileTable:
        """Return a table of some columns under other headers, on its clock in seconds."""
        units = [self._unit(head) for head in named]
        cells = (self.time, *(self.values(head) for head in named))
        header = (CLOCK, *named.values())
        name = self.sheet.path.name
        return FileTable(name, header, cells, ("s", *units), clock=CLOCK, begins=0.0, group="two loggers")

    def _unit(self, head: str) -> str:
        index, spec = self.sheet.header.index(head), self.specs.get(head)
        beside = self.sheet.units[index].strip("[]() ") if self.sheet.units else ""
        if beside or spec is None:
            return beside
        return spec.own.unit if head in spec.canonical_headers else in_header(head, spec.own) or ""


def _clock(sheet: Sheet, index: int, unit: str, place: str) -> tuple[Array, datetime | None]:
    """Return the clock of a sheet in seconds, and when it began where it is one of dates."""
    if "%" in unit:
        time, begun = instants(sheet, index, unit), _instant(sheet.texts[index][0], unit)
    else:
        if index in sheet.faults:
            raise DataError(sheet.faults[index])
        try:
            time, begun = to_canonical(sheet.numbers[index], unit, TIME), None
        except UnitError as error:
            raise ConfigError(f"{place}.units: {error}") from None
    if fault := clock_fault(time):
        raise DataError(f"{sheet.place(fault[0])}: {sheet.header[index]}: {fault[1]}")
    return time, begun


def _instant(text: str, form: str) -> datetime:
    return datetime.strptime(text, form)  # noqa: DTZ007  # that of the other logger is taken from it


# --- The clock of the second on that of the first ---


def _aligned(first: _Logger, second: _Logger, beside: Beside, place: str) -> tuple[float, float, str]:
    """Return pace and offset [s] of the second clock on the first, t_1 = pace t_2 + offset, and how they were found.

    Raises
    ------
    ConfigError : when one clock is of dates and the other is not
    DataError : when event or column do not tell
    """
    if beside.same_clock:
        if (first.begun is None) != (second.begun is None):
            raise ConfigError(f"{place}.same_clock: one clock is of dates, and the other counts; say event or column")
        began = (second.begun - first.begun).total_seconds() if first.begun and second.begun else 0.0
        return 1.0, began, "whose clock counts from the same instant"
    names = f"{first.sync!r} and {second.sync!r}"
    if beside.event is not None:
        pace, offset = _by_pulses(first, second)
        known = 0.5 * max(first.step, second.step)
        return pace, offset, f"by the rising edges of {names}, known to {known:.3g} s"
    return 1.0, _by_agreement(first, second), f"where {names} agree best"


def _by_pulses(first: _Logger, second: _Logger) -> tuple[float, float]:
    one, other = (_rising(logger) for logger in (first, second))
    if one.size != other.size:
        raise DataError(
            f"{at(second.sheet.path)}: {other.size} rising edges of {second.sync!r}, and {one.size} of {first.sync!r} "
            f"in {first.sheet.path.name}: cut one file where the other did not run, or say column"
        )
    if one.size == 1:
        return 1.0, float(one[0] - other[0])
    pace = float((one[-1] - one[0]) / (other[-1] - other[0]))
    offset = float(one[0] - pace * other[0])
    apart = float(np.max(np.abs(pace * other + offset - one)))
    if abs(pace - 1.0) > SAME_PACE or apart > first.step + second.step:
        raise DataError(
            f"{at(second.sheet.path)}: the edges of {second.sync!r} are not those of {first.sync!r} in "
            f"{first.sheet.path.name}: they differ by up to {apart:.3g} s at a pace of {pace:.5g}"
        )
    return pace, offset


def _rising(logger: _Logger) -> Array:
    """Return the (m,) instants at which an event rises through the middle of its range [s].

    Raises
    ------
    DataError : when it never does
    """
    values = logger.values(logger.sync)
    middle = 0.5 * float(values.min() + values.max())
    below = values < middle
    at_rows = np.flatnonzero(below[:-1] & ~below[1:])
    if not at_rows.size or np.ptp(values) == 0.0:
        raise DataError(f"{at(logger.sheet.path)}: {logger.sync!r} has no rising edge")
    share = (middle - values[at_rows]) / (values[at_rows + 1] - values[at_rows])
    return np.asarray(logger.time[at_rows] + share * (logger.time[at_rows + 1] - logger.time[at_rows]))


def _by_agreement(first: _Logger, second: _Logger) -> float:
    """Return the offset at which two columns agree best [s].

    Raises
    ------
    DataError : when they do not, or at several as well
    """
    from scipy.optimize import minimize_scalar

    step = max(first.step, second.step)
    grids = [np.arange(logger.time[0], logger.time[-1], step) for logger in (first, second)]
    one, other = (
        np.interp(grid, logger.time, logger.values(logger.sync))
        for grid, logger in zip(grids, (first, second), strict=True)
    )
    shifts, agreement = _correlation(one, other)
    best = int(np.argmax(agreement))
    names = f"{first.sync!r} of {first.sheet.path.name} and {second.sync!r}"
    if not agreement[best] >= SAME_SIGNAL:
        raise DataError(
            f"{at(second.sheet.path)}: {names} do not show the same signal: at best their correlation is "
            f"{agreement[best]:.3g}; name a column that both recorded, or an event"
        )
    falls = np.flatnonzero(agreement < SAME_SIGNAL)
    low = max(falls[falls < best], default=-1) + 1
    high = min(falls[falls > best], default=agreement.size)
    rest = np.concatenate([agreement[:low], agreement[high:]])
    if rest.size and rest.max() > agreement[best] - NO_DOUBT:
        again = int(np.flatnonzero(agreement == rest.max())[0])
        raise DataError(
            f"{at(second.sheet.path)}: {names} agree as well {abs(shifts[again] - shifts[best]) * step:.4g} s apart, "
            "since the motion repeats: record its beginning in both, or say event"
        )
    rough = float(grids[0][0] - grids[1][0] + shifts[best] * step)

    def disagreement(offset: float) -> float:
        inside = (grids[0] >= second.time[0] + offset) & (grids[0] <= second.time[-1] + offset)
        theirs = resampled(second.time, second.values(second.sync), grids[0][inside] - offset, held=False)
        return -float(np.corrcoef(one[inside], theirs)[0, 1])

    found = minimize_scalar(disagreement, bounds=(rough - step, rough + step), method="bounded")
    return float(found.x)


def _correlation(one: Array, other: Array) -> tuple[NDArray[np.int64], Array]:
    """Correlate two signals of one step at every shift at which enough of both overlaps.

    Returns
    -------
    (m,) shifts of the second in steps, and (m,) the correlation over what overlaps there
    """
    from scipy.signal import fftconvolve

    least = max(int(LEAST_OVERLAP * min(one.size, other.size)), 2)
    shifts = np.arange(-(other.size - least), one.size - least + 1, dtype=np.int64)
    begins, ends = np.maximum(shifts, 0), np.minimum(shifts + other.size, one.size)
    count = (ends - begins).astype(np.float64)
    one, other = one - one.mean(), other - other.mean()
    products = fftconvolve(one, other[::-1])[shifts + other.size - 1]

    def sums(values: Array, low: NDArray[np.int64], high: NDArray[np.int64]) -> Array:
        total = np.concatenate([[0.0], np.cumsum(values)])
        return np.asarray(total[high] - total[low])

    s1, q1 = sums(one, begins, ends), sums(one**2, begins, ends)
    s2, q2 = sums(other, begins - shifts, ends - shifts), sums(other**2, begins - shifts, ends - shifts)
    spread = np.sqrt(np.maximum((q1 - s1**2 / count) * (q2 - s2**2 / count), 0.0))
    with np.errstate(invalid="ignore", divide="ignore"):
        found = (products - s1 * s2 / count) / spread
    return shifts, np.where(np.isfinite(found), found, -1.0)
