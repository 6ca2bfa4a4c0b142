"""LabVIEW measurement files (.lvm): text with a head that declares separator, decimal sign and columns of time.

A segment has a head of its own, then headers and rows; one that goes on where the last ended is part of its test, else
a test begins. By `X_Columns` there is one column of time, one for each channel (`Multi`), or none (`No`): then time is
counted from `X0` by `Delta_X`. The column `Comment` and special blocks are left out.
Source: NI, "Specification for the LabVIEW Measurement File (.lvm)".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

import numpy as np

from pzd.record import Array
from pzd.rig.config import FilesEntry
from pzd.rig.files.dialect import text_of
from pzd.rig.files.sheet import Cells, FileTable, number, tables_by_length
from pzd.schema.errors import DataError, at

KIND = "a LabVIEW measurement file"
SUFFIXES = (".lvm",)
NEEDS = None
OPTIONS = ("encoding", "table")
SIGNATURE = b"LabVIEW Measurement"
CLOCK = "X_Value"
"""Header of every column of time."""
_END, _SPECIAL, _SPECIAL_END = "***End_of_Header***", "***Start_Special***", "***End_Special***"
_SEPARATORS = {"tab": "\t", "comma": ",", "space": " ", "semicolon": ";"}
_COMMENT = "Comment"
_GOES_ON = 1.5
"""Steps of the clock from the last row of a segment to the first of the next, up to which they are one recording."""
_DIGITS = 6
"""Digits of a difference of dates and times [s]: those of the largest number that a date makes."""
_SLOWER = 1.5
"""Ratio of steps above which a channel is slower than its rows."""


def holds(path: Path, start: bytes) -> bool:
    """Whether a file is of this format, by its first bytes."""
    return start.removeprefix(b"\xef\xbb\xbf").startswith(SIGNATURE)


def tables(path: Path, entry: FilesEntry) -> list[FileTable]:
    """Read a table of the channels of each clock in each segment.

    Raises
    ------
    DataError : when a head has no end, a cell is no number, or nothing stands below the headers
    """
    lines = _text(path, entry.encoding).split("\n")
    separator = next(
        (
            _SEPARATORS.get(line[9:].strip(" \t,;").lower(), line[9])
            for line in lines[:40]
            if line.startswith("Separator") and len(line) > 9
        ),
        "\t",
    )
    head, first = _head(path, lines, 0, separator)
    said = {key: cells[0] if cells else "" for key, cells in head.items()}
    way = _Way(separator, said.get("Decimal_Separator", "."), said.get("X_Columns", "One").lower())
    found: list[_Segment] = []
    for segment in _segments(path, lines, first, head, way):
        if found and found[-1].goes_on_in(segment):
            found[-1] = found[-1].with_rows_of(segment)
        else:
            found.append(segment)
    if not found:
        raise DataError(f"{at(path)}: no rows of numbers below a line of headers")
    names = [f"segment {n + 1}" if len(found) > 1 else "" for n in range(len(found))]
    read = [table for name, segment in zip(names, found, strict=True) for table in segment.tables(name)]
    earliest = min((table.begins for table in read if table.begins is not None), default=0.0)
    return [
        table if table.begins is None else replace(table, begins=round(table.begins - earliest, _DIGITS))
        for table in read
    ]


@dataclass(frozen=True)
class _Way:
    """How the file is written."""

    separator: str
    decimal: str
    x_columns: str
    """`one`, `multi` or `no`."""


@dataclass(frozen=True, eq=False)
class _Segment:
    """Headers, rows and head of one segment."""

    way: _Way
    head: dict[str, list[str]]
    names: tuple[str, ...]
    """Header of every column, `Comment` left out."""
    cells: Array
    """(rows, columns); an empty cell is NaN."""
    lines: tuple[int, ...]
    """(rows,) in the file."""
    header_line: int

    @property
    def _step(self) -> float:
        """Step of the clock of its first channel [s]; 0 where it is not known."""
        x = self.cells[:, 0]
        if self.way.x_columns != "no" and x.size > 1 and np.isfinite(x[:2]).all():
            return float(x[1] - x[0])
        return self._number("Delta_X", 0) or 0.0

    @property
    def _first(self) -> float:
        """Its first instant on the clock of the file [s]."""
        x0 = self._number("X0", 0) or 0.0
        return self.begins(0) + (x0 if self.way.x_columns == "no" else float(self.cells[0, 0]))

    def goes_on_in(self, other: _Segment) -> bool:
        """Whether another segment begins where this one ends, in its own column of time or by the time of day."""
        if other.names != self.names or self.way.x_columns == "multi" or not self._step:
            return False
        last = self._first + (self.cells.shape[0] - 1) * self._step
        ways = [other._first - last]
        if self.way.x_columns == "one":
            ways.append(float(other.cells[0, 0] - self.cells[-1, 0]))
        return any(0.0 < pause <= _GOES_ON * self._step for pause in ways)

    def with_rows_of(self, other: _Segment) -> _Segment:
        """Return this segment with the rows of one that goes on where it ends."""
        more = other.cells.copy()
        if self.way.x_columns == "one" and more[0, 0] <= self.cells[-1, 0]:
            more[:, 0] += round(other.begins(0) - self.begins(0), _DIGITS)
        return replace(self, cells=np.concatenate((self.cells, more)), lines=(*self.lines, *other.lines))

    def tables(self, name: str) -> list[FileTable]:
        """Make a table of the channels of each clock."""
        numbers = np.array(self.lines, dtype=np.int64)
        if self.way.x_columns == "one" and self._declared_slower():
            found = self._by_clock(name, {0: self.cells[:, 0]})
        elif self.way.x_columns == "multi":
            found = self._by_pairs(name)
        elif self.way.x_columns == "no":
            found = self._by_clock(name, {})
        else:
            units = ("s", *(self._text("Y_Unit_Label", n) for n in range(len(self.names) - 1)))
            cells = tuple(np.ascontiguousarray(column) for column in self.cells.T)
            found = [FileTable(name, (CLOCK, *self.names[1:]), cells, units, numbers, self.header_line, CLOCK)]
        if len(found) == 1:
            return [replace(found[0], name=name, group="", begins=self.begins(0))]
        return [
            replace(table, name=f"{name} clock {n + 1}".strip(), group=name or "file") for n, table in enumerate(found)
        ]

    def _declared_slower(self) -> bool:
        """Whether a channel has fewer samples in the first rows than there are, by a longer step of its own."""
        first = self._number("Delta_X", 0)
        return any(
            first and (step := self._number("Delta_X", n)) and step > _SLOWER * first and self._filled_first(n + 1)
            for n in range(1, len(self.names) - 1)
        )

    def _filled_first(self, column: int) -> int:
        """Return how many cells of a column are filled, where these are the first rows and not all; else 0."""
        filled = np.isfinite(self.cells[:, column])
        count = int(filled.sum())
        return count if 1 < count < filled.size and bool(filled[:count].all()) else 0

    def _by_clock(self, name: str, given: dict[int, Array]) -> list[FileTable]:
        """Make tables of channels by start and step, of the first channel by the column of time where there is one."""
        clocks: dict[tuple[float, float, float, int], dict[str, tuple[Cells, str]]] = {}
        for n, head in enumerate(self.names[1:]):
            values = self.cells[:, n + 1]
            count = self._filled_first(n + 1) or values.size
            step = self._number("Delta_X", n) or self._step
            key = (self.begins(n), self._number("X0", n) or 0.0, step, count)
            clocks.setdefault(key, {})[head] = (np.ascontiguousarray(values[:count]), self._text("Y_Unit_Label", n))
        found = []
        for (begins, start, step, count), columns in clocks.items():
            if not step:
                found += tables_by_length(name, columns)
                continue
            regular = start + step * np.arange(count)
            time = given.get(0) if count == self.cells.shape[0] else None
            clock: dict[str, tuple[Cells, str]] = {CLOCK: (np.asarray(regular) if time is None else time, "s")}
            (table,) = tables_by_length(name, clock | columns)
            found.append(replace(table, clock=CLOCK, begins=begins))
        return found

    def _by_pairs(self, name: str) -> list[FileTable]:
        """Make a table of every pair of time and channel; of pairs with equal times, one."""
        clocks: list[tuple[Array, float, dict[str, tuple[Cells, str]]]] = []
        for n in range(len(self.names) // 2):
            time, values = self.cells[:, 2 * n], self.cells[:, 2 * n + 1]
            count = int(np.max(np.flatnonzero(np.isfinite(time) | np.isfinite(values)), initial=-1)) + 1
            if not count:
                continue
            column = (np.ascontiguousarray(values[:count]), self._text("Y_Unit_Label", n))
            begins = self.begins(n)
            same = next((c for t, b, c in clocks if b == begins and np.array_equal(t, time[:count])), None)
            if same is None:
                same = {}
                clocks.append((np.ascontiguousarray(time[:count]), begins, same))
            same[self.names[2 * n + 1]] = column
        found = []
        for time, begins, columns in clocks:
            clock: dict[str, tuple[Cells, str]] = {CLOCK: (time, "s")}
            (table,) = tables_by_length(name, clock | columns)
            found.append(replace(table, clock=CLOCK, begins=begins))
        return found

    def begins(self, channel: int) -> float:
        """Return the date and time at which a channel begins [s]; 0 where times are absolute or unknown."""
        if (self.head.get("Time_Pref") or ["Relative"])[0] == "Absolute":
            return 0.0
        day, clock = self._text("Date", channel), self._text("Time", channel)
        whole, _, fraction = clock.replace(",", ".").partition(".")
        try:
            begun = datetime.strptime(f"{day} {whole}", "%Y/%m/%d %H:%M:%S")  # noqa: DTZ007  # a recorder knows no zone
            return (begun - datetime(2000, 1, 1)).total_seconds() + float(f"0.{fraction or 0}")  # noqa: DTZ001  # as above
        except ValueError:
            return 0.0

    def _text(self, key: str, channel: int) -> str:
        """Return what the head says of a channel; with a time for each channel two cells belong to each."""
        cells = self.head.get(key, [])
        width = 2 if self.way.x_columns == "multi" and len(cells) > (len(self.names) + 1) // 2 else 1
        mine = cells[width * channel : width * (channel + 1)]
        return next((cell for cell in mine if cell), "")

    def _number(self, key: str, channel: int) -> float | None:
        try:
            return number(self._text(key, channel).replace(self.way.decimal, "."))
        except ValueError:
            return None


def _text(path: Path, encoding: str) -> str:
    """Read the characters: UTF-8, else the code page of Western Windows, where the config says nothing else."""
    try:
        return text_of(path, encoding)
    except DataError:
        if encoding != "utf-8" or not path.read_bytes().startswith(SIGNATURE):
            raise
        return text_of(path, "latin-1")


def _head(path: Path, lines: list[str], begin: int, separator: str) -> tuple[dict[str, list[str]], int]:
    """Read the head that begins at a line: what is said under each key, and the line behind its end."""
    found: dict[str, list[str]] = {}
    for n in range(begin, len(lines)):
        if lines[n].startswith(_END):
            return found, n + 1
        key, *cells = (cell.strip() for cell in lines[n].split(separator))
        if key:
            found[key] = cells
    raise DataError(f"{at(path, begin + 1)}: a head without its end, {_END}: the file is cut off")


def _segments(path: Path, lines: list[str], first: int, head: dict[str, list[str]], way: _Way) -> list[_Segment]:
    """Read the segments behind the head of the file."""
    found: list[_Segment] = []
    names: tuple[str, ...] = ()
    position, header_line, of_file = first, 0, head
    while position < len(lines):
        line = lines[position]
        if not line.strip():
            position += 1
        elif line.startswith(_SPECIAL):
            position = (
                next((n for n in range(position, len(lines)) if lines[n].startswith(_SPECIAL_END)), len(lines)) + 1
            )
        elif _row(line, way) is None and not _named(line, way):
            own, position = _head(path, lines, position, way.separator)
            head = {**of_file, **own}
        elif _named(line, way):
            names, header_line = _names(line, way), position + 1
            position += 1
        else:
            rows, numbers, position = _rows(path, lines, position, way, len(names))
            for part in _where_time_goes_back(rows, way):
                if names and part.stop > part.start:
                    cells = np.array(rows[part])
                    found.append(_Segment(way, head, names, cells, tuple(numbers[part]), header_line))
            _refuse_cut_off(path, head, len(rows), numbers[-1])
    return found


def _refuse_cut_off(path: Path, head: dict[str, list[str]], rows: int, last: int) -> None:
    """Refuse rows that are fewer than their head says."""
    samples = max((int(cell) for cell in head.get("Samples", []) if cell.isdecimal()), default=0)
    if rows < samples:
        raise DataError(f"{at(path, last)}: ends after {rows} rows of {samples} that its head says; export it again")


def _named(line: str, way: _Way) -> bool:
    """Whether a line holds the headers."""
    return line.split(way.separator, maxsplit=1)[0].strip() == CLOCK


def _names(line: str, way: _Way) -> tuple[str, ...]:
    cells = [cell.strip() for cell in line.split(way.separator)]
    while cells and cells[-1] in ("", _COMMENT):
        cells.pop()
    return tuple(cells)


def _row(line: str, way: _Way, width: int | None = None) -> list[float] | None:
    """Read the numbers of a row, NaN where a cell is empty; None where it holds anything else."""
    cells = line.split(way.separator)
    taken = cells[: 1 if width is None else width]
    try:
        row = [number(cell.replace(way.decimal, ".")) if cell.strip() else float("nan") for cell in taken]
    except ValueError:
        return None
    return row if width is None else row + [float("nan")] * (width - len(row))


def _rows(path: Path, lines: list[str], begin: int, way: _Way, width: int) -> tuple[list[list[float]], list[int], int]:
    """Read rows up to an empty line, a special block or a head; and the line behind them."""
    rows: list[list[float]] = []
    numbers: list[int] = []
    n = begin
    while n < len(lines) and lines[n].strip() and not lines[n].startswith(_SPECIAL):
        row = _row(lines[n], way, width)
        if row is None:
            if _row(lines[n], way) is None:
                break
            shown = lines[n][:60]
            raise DataError(
                f"{at(path, n + 1)}: numbers are needed here, with {way.decimal!r} as the head says (got {shown!r})"
            )
        rows.append(row)
        numbers.append(n + 1)
        n += 1
    return rows, numbers, n


def _where_time_goes_back(rows: Sequence[Sequence[float]], way: _Way) -> list[slice]:
    """Cut rows where their column of time goes back: a segment without a head of its own begins."""
    if way.x_columns != "one":
        return [slice(0, len(rows))]
    times = np.array([row[0] for row in rows])
    cuts = (np.flatnonzero(np.diff(times) < 0.0) + 1).tolist()
    return [slice(first, last) for first, last in zip([0, *cuts], [*cuts, len(rows)], strict=True)]
