"""A rig file as its format reads it: headers, and the columns that were asked for.

A workbook has several sheets, a TDMS or MDF file several groups, a MATLAB or JSON file several structures: every table
that holds a recording is read, the others are reported as left out.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pzd.record import Array
from pzd.rig.files.dialect import plain_numbers
from pzd.schema.errors import DataError, at, counted

LIKE_A_CLOCK = re.compile(r"^t(?![a-z0-9])|time|clock|zeit|\btemps\b|tiempo|^second|^sek", re.IGNORECASE)
"""Headers of a column of time, whatever is in it."""


@dataclass(frozen=True)
class Wanted:
    """Columns to read, by their headers."""

    known: frozenset[str] = frozenset()
    """Every header that may occur in the file, from which the separator is recognised."""
    numbers: frozenset[str] = frozenset()
    """Columns of numbers."""
    texts: frozenset[str] = frozenset()
    """Columns of texts: dates, labels, events."""
    beside: re.Pattern[str] | None = None
    """Further columns of numbers, by what their headers are like; cells that are none do no harm there."""
    needed: tuple[frozenset[str], ...] = ()
    """For each quantity that a recording must have, the headers that may hold it."""
    held: frozenset[str] = frozenset()
    """Columns whose value holds until the next sample: what labels a test."""
    quantities: Mapping[str, str] = field(default_factory=dict)
    """Header -> name of its quantity."""

    def as_numbers(self, head: str) -> bool:
        """Whether a column is to be read as numbers."""
        return head in self.numbers or (self.beside is not None and self.beside.search(head) is not None)


@dataclass(frozen=True)
class ReadingStep:
    """One step from a file to its records, for the ingest report."""

    step: Literal["read", "left out", "rename", "unit", "sign", "value", "cut", "clock", "fixture"]
    quantity: str | None
    """The quantity concerned; None for the file as a whole."""
    was: str
    """As in the file or in the config."""
    became: str
    """As in the record."""


@dataclass(frozen=True, eq=False)
class Sheet:
    """A file as its format reads it: every line counted and every wanted cell read."""

    path: Path
    header: tuple[str, ...]
    """Header of every column, stripped."""
    header_line: int | None
    """Line of the header in the file, None where a format has no lines."""
    units: tuple[str, ...] | None
    """Unit of every column where the file gives it apart from the header."""
    rows: int
    """Number of data rows."""
    lines: NDArray[np.int64] | None = None
    """(rows,) line of every data row in the file, None where a format has no lines."""
    numbers: dict[int, Array] = field(default_factory=dict)
    """Column -> (rows,); an empty cell is NaN."""
    texts: dict[int, list[str]] = field(default_factory=dict)
    """Column -> its cells as text, stripped."""
    faults: dict[int, list[str]] = field(default_factory=dict)
    """Column of numbers -> the cells that are no finite numbers, each with its line."""
    starts: tuple[int, ...] = (0,)
    """Rows at which the file itself begins another recording: another table of a workbook, group or block."""
    tables: tuple[str, ...] = ("",)
    """Name of the table that begins at each start; empty where the file is one table."""
    elsewhere: dict[str, str] = field(default_factory=dict)
    """Headers of the tables that are left out, each with its table."""
    steps: tuple[ReadingStep, ...] = ()
    """What was read and what was left out."""

    @property
    def top(self) -> str:
        """File, table and line of the header."""
        return at(table_place(self.path, self.tables[0]), self.header_line)

    def place(self, row: int) -> str:
        """Return file, table and line of a data row; the number of the row where a format has no lines."""
        number = bisect_right(self.starts, row) - 1
        file = table_place(self.path, self.tables[number])
        return f"{file}: row {row - self.starts[number] + 1}" if self.lines is None else f"{file}:{self.lines[row]}"

    def place_in_file(self, row: int) -> str:
        """Return the place of a data row in words, without the file."""
        number = bisect_right(self.starts, row) - 1
        line = f"row {row - self.starts[number] + 1}" if self.lines is None else f"line {self.lines[row]}"
        return f"{line} of {self.tables[number]!r}" if self.tables[number] else line


def table_place(path: Path, table: str) -> str:
    """Return a file with the table in it, where that has a name."""
    return f"{path}:{table}" if table else at(path)


def listed_faults(path: Path, header: str, bad: Sequence[tuple[str, str]], count: int | None = None) -> list[str]:
    """List bad cells of one column by their places and what is wrong; the first few, and how many more.

    Parameters
    ----------
    path, header : of the column
    bad : the cells, or the first of them
    count : how many there are, where these are the first
    """
    shown = [f"{place}: {header}: {message}" for place, message in bad[:MOST_FAULTS]]
    more = (len(bad) if count is None else count) - len(shown)
    return shown + ([f"{at(path)}: {header}: and {more} more"] if more else [])


# --- Tables of a file, and the sheet that is read from them ---

Cells = Array | list[str]
"""One column: numbers (an empty cell is NaN), or texts."""

MOST_FAULTS = 5
"""Faults of one kind that are listed for one file or column: enough to see what they have in common."""
_NAMES, _UNITS, _VALUES = ("name", "channel", "label"), ("unit", "units"), ("values", "value", "data", "samples")
"""Keys under which a structure holds name, unit and samples of one column."""


@dataclass(frozen=True, eq=False)
class FileTable:
    """Named columns of one length."""

    name: str
    """Name of the sheet, group or structure; empty where the file is one table."""
    header: tuple[str, ...]
    cells: tuple[Cells, ...]
    """One a column, all of one length."""
    units: tuple[str, ...] | None = None
    """Unit of every column where the file gives it apart from the header."""
    lines: NDArray[np.int64] | None = None
    """(rows,) line of every data row in the file, None where a format has no lines."""
    header_line: int | None = None
    """Line of the headers, None where a format has no lines."""
    clock: str = ""
    """Header of the column of seconds, where the format says which it is."""
    begins: float | None = None
    """Its zero on the clock that tables of the file share [s]; None where they share none."""
    group: str = ""
    """Name of the recording of which this table is a part; empty where it is one by itself."""
    steps: tuple[ReadingStep, ...] = ()
    """What made the table."""

    @property
    def rows(self) -> int:
        """Number of data rows."""
        return len(self.cells[0]) if self.cells else 0


def named_tables(path: Path, tables: Sequence[FileTable], pattern: str | None) -> list[FileTable]:
    """Select the tables with data rows by their names.

    Parameters
    ----------
    path : the file
    tables : of the file
    pattern : name or pattern of the tables to read; by default every one

    Raises
    ------
    DataError : when there is no such table, or none has rows
    """
    filled = [table for table in tables if table.rows]
    if not filled:
        raise DataError(f"{at(path)}: no table with data rows")
    named = [table for table in filled if pattern is None or fnmatchcase(table.name, pattern)]
    if not named:
        raise DataError(f"{at(path)}: no table {pattern!r} (got {', '.join(table.name for table in filled)})")
    return named


def sheet_of(path: Path, named: Sequence[FileTable], others: Sequence[FileTable], wanted: Wanted) -> Sheet:
    """Read the wanted columns of every table that holds a recording, one below the other.

    Parameters
    ----------
    path : the file
    named : tables that may be read
    others : tables that are left out by their names
    wanted : the columns to read

    Raises
    ------
    DataError : when two of the tables differ in columns or units that are wanted
    """
    taken = [table for table in named if _matches(table, wanted) == len(wanted.needed)]
    taken = taken or [max(named, key=lambda table: _matches(table, wanted))]
    left = [*(table for table in named if table not in taken), *others]
    first = taken[0]
    asked = wanted.numbers | wanted.texts
    faults = [fault for other in taken[1:] for fault in _differences(path, first, other, asked)]
    if faults:
        raise DataError(faults)
    starts = tuple(int(start) for start in np.cumsum([0, *(table.rows for table in taken[:-1])]))
    bare = Sheet(
        path,
        first.header,
        first.header_line,
        first.units,
        sum(table.rows for table in taken),
        None if first.lines is None else np.concatenate([t.lines for t in taken if t.lines is not None]),
        starts=starts,
        tables=tuple(table.name for table in taken),
        elsewhere={head: table.name for table in left for head in table.header},
        steps=tuple(_steps(left, taken, asked)),
    )
    return _with_cells(bare, taken, wanted)


def tables_of_tree(
    tree: Mapping[str, Any], name: str = "", constants: Mapping[str, float] | None = None
) -> list[FileTable]:
    """Make tables of a tree of structures: arrays of one length in one structure are the columns of one table.

    Parameters
    ----------
    tree : name -> array (n,) or (n, k), list, number, text, or a structure below
    name : of the structure, its parents in front; empty at the top
    constants : numbers of the parents

    Returns
    -------
    tables, each with the single numbers of its structure and the parents as constant columns behind its own
    """
    columns: dict[str, tuple[Cells, str]] = {}
    numbers = dict(constants or {})
    below: list[tuple[str, Mapping[str, Any]]] = []
    for key, value in tree.items():
        inner, unit = _leaf(value)
        if isinstance(inner, Mapping):
            below.append((key, inner))
        elif (channels := named_channels(inner)) is not None:
            below.append((key, channels))
        elif isinstance(inner, list) and inner and all(isinstance(one, Mapping) for one in inner):
            below += [(f"{key}.{n + 1}", one) for n, one in enumerate(inner)]
        elif isinstance(inner, bool | int | float | np.number):
            numbers[key] = float(inner)
        else:
            columns |= {head: (cells, unit) for head, cells in _columns(key, inner)}
    found = tables_by_length(name, columns, numbers)
    for key, inner in below:
        found += tables_of_tree(inner, f"{name}.{key}" if name else key, numbers)
    return found


def table_of_rows(name: str, rows: Sequence[Mapping[str, Any]]) -> FileTable:
    """Make the table of a list of rows, each a mapping of header to cell."""
    header = list(dict.fromkeys(head for row in rows for head in row))
    return FileTable(name, tuple(header), tuple(cells_of([row.get(head) for row in rows]) for head in header))


def cells_of(values: Sequence[Any]) -> Cells:
    """Make a column of loose cells: numbers where every filled cell is one, else texts."""
    if all(value is None or (isinstance(value, int | float | np.number)) for value in values):
        return np.array([np.nan if value is None else float(value) for value in values])
    return ["" if value is None else spelled(value) for value in values]


def spelled(value: Any) -> str:
    """Write a cell as text: instants as ISO 8601 with microseconds, numbers with up to 15 digits."""
    if hasattr(value, "isoformat"):
        try:
            return str(value.isoformat(timespec="microseconds"))
        except TypeError:  # a date without a time
            return str(value.isoformat())
    return f"{value:.15g}" if isinstance(value, float) else str(value).strip()


NO_SAMPLE = "take a row without a value out: it is told as a lost sample"
"""What to do about a cell that holds no value of its channel."""
IN_STEP = (
    "write the mean of its neighbours there: no column holds the time, and a row taken out would shift those behind it"
)
"""The same where the rows are counted by `rate_Hz`."""
MOST_BELOW = 10
"""Lines of words below a table; more are none."""


_WORDS_ALONE = re.compile(r"[^\d]*[^\W\d_][^\d]*")
"""Words without a digit, as `--- End of test ---`."""


def words_below(first: Sequence[str]) -> int:
    """Return how many rows at the end of a table say something in words: its extremes, a remark, `End of test`.

    Parameters
    ----------
    first : first cell of the last rows, as many as there are up to one more than `MOST_BELOW`

    Examples
    --------
    >>> words_below(["1.998", "", "Max", "Remark: warm"]), words_below(["A", "B"]), words_below(["1.998", ""])
    (3, 0, 0)
    """
    count, words = 0, False
    for cell in reversed(first):
        if cell and not (cell[0].isalpha() or _WORDS_ALONE.fullmatch(cell)):
            return count if words else 0
        count, words = count + 1, words or bool(cell)
    return 0


def told_below(count: int) -> ReadingStep:
    """Report the lines of words below a table that are left out."""
    return ReadingStep("left out", None, f"{counted(count, 'line')} of words below the table", "")


def number(text: str) -> float:
    """Read the number in a text; infinities, NaN and digits grouped by `_` are none.

    Raises
    ------
    ValueError : when it is no finite number
    """
    value = float(text)
    if "_" in text or not np.isfinite(value):
        raise ValueError(text)
    return value


def tables_by_length(
    name: str, columns: Mapping[str, tuple[Cells, str]], numbers: Mapping[str, float] | None = None
) -> list[FileTable]:
    """Make one table of the columns of each length: channels of different rates are not one table.

    Parameters
    ----------
    name : of the group
    columns : header -> cells and unit
    numbers : header -> value of columns that are constant in every table
    """
    lengths = list(dict.fromkeys(len(cells) for cells, _ in columns.values()))
    found = []
    for length in lengths:
        mine = {head: both for head, both in columns.items() if len(both[0]) == length}
        constant = {head: (np.full(length, value), "") for head, value in (numbers or {}).items() if head not in mine}
        every: dict[str, tuple[Cells, str]] = {**mine, **constant}
        units = tuple(unit for _, unit in every.values())
        called = f"{name} of {length} rows".strip() if len(lengths) > 1 else name
        cells = tuple(cells for cells, _ in every.values())
        found.append(FileTable(called, tuple(every), cells, units if any(units) else None))
    return found


def named_channels(value: Any) -> dict[str, Any] | None:
    """Return a list of channels, each with its name and samples, as columns by name; None where it is none.

    Examples
    --------
    >>> named_channels([{"name": "Load", "unit": "N", "data": [1.0, 2.0]}])
    {'Load': {'unit': 'N', 'values': [1.0, 2.0]}}
    """
    if not isinstance(value, list) or not value or not all(isinstance(one, Mapping) for one in value):
        return None
    found: dict[str, Any] = {}
    for one in value:
        name, unit, samples = (_under(one, keys) for keys in (_NAMES, _UNITS, _VALUES))
        if not isinstance(name, str) or name in found or not isinstance(samples, list | np.ndarray):
            return None
        found[name] = {"unit": unit, "values": samples} if isinstance(unit, str) else samples
    return found


def _under(structure: Mapping[str, Any], keys: Sequence[str]) -> Any:
    """Return what stands under the first of some keys, in capitals or not; None where none is there."""
    held = {key.lower(): value for key, value in structure.items()}
    return next((held[key] for key in keys if key in held), None)


def _leaf(value: Any) -> tuple[Any, str]:
    """Return the samples of a column and its unit where a structure holds just these; else the value itself."""
    if not isinstance(value, Mapping):
        return value, ""
    unit, samples = _under(value, _UNITS), _under(value, _VALUES)
    return (samples, unit) if isinstance(unit, str) and samples is not None else (value, "")


def _columns(key: str, value: Any) -> Iterator[tuple[str, Cells]]:
    """Yield one column, or one for each of the short side of a matrix; none where it is no list of samples."""
    if isinstance(value, list):
        if not all(value is None or isinstance(value, bool | int | float | str) for value in value):
            try:
                value = np.asarray(value, dtype=np.float64)
            except (ValueError, TypeError):
                return
        else:
            value = cells_of(value)
    if isinstance(value, list):
        yield key, value
    elif isinstance(value, np.ndarray) and value.dtype.kind in "biuf" and value.ndim in (1, 2):
        numbers = np.asarray(value, dtype=np.float64)
        if numbers.ndim == 1 or 1 in numbers.shape:
            yield key, numbers.ravel()
        else:
            upright = numbers if numbers.shape[0] >= numbers.shape[1] else numbers.T
            yield from ((f"{key}.{n + 1}", np.ascontiguousarray(column)) for n, column in enumerate(upright.T))
    elif isinstance(value, np.ndarray) and value.dtype.kind in "OU" and value.ndim == 1:
        yield key, [str(cell).strip() for cell in value]


def _matches(table: FileTable, wanted: Wanted) -> int:
    """Count the quantities of a table that a recording must have."""
    return sum(bool(heads & set(table.header)) for heads in wanted.needed)


def _differences(path: Path, first: FileTable, other: FileTable, asked: Iterable[str]) -> Iterator[str]:
    """Describe where a second table cannot be read as the first is."""
    for head in asked:
        if (head in first.header) != (head in other.header):
            holds, lacks = (first, other) if head in first.header else (other, first)
            yield (
                f"{table_place(path, lacks.name)}: no column {head!r}, which {holds.name!r} has; "
                "read them by entries of their own, with table: NAME"
            )
        elif head in first.header and _unit(first, head) != _unit(other, head):
            yield (
                f"{table_place(path, other.name)}: {head!r} is in {_unit(other, head)!r} here and in "
                f"{_unit(first, head)!r} in {first.name!r}; read them by entries of their own, with table: NAME"
            )


def _unit(table: FileTable, head: str) -> str:
    return "" if table.units is None else table.units[table.header.index(head)]


def _steps(left: Sequence[FileTable], taken: Sequence[FileTable], asked: Iterable[str]) -> Iterator[ReadingStep]:
    """Report the tables and columns that are read, and those that are left out."""
    names = ", ".join(repr(table.name) for table in taken if table.name)
    yield ReadingStep("read", None, f"table {names}".strip(), f"{sum(table.rows for table in taken)} rows")
    unread = list(dict.fromkeys(head for table in taken for head in table.header if head not in asked))
    if unread:
        yield ReadingStep("left out", None, f"columns {', '.join(unread)}", "")
    for table in left:
        yield ReadingStep(
            "left out", None, f"table {table.name!r}, {table.rows} rows", "no recording, or not asked for"
        )
    yield from dict.fromkeys(step for table in taken for step in table.steps)


def _with_cells(bare: Sheet, tables: Sequence[FileTable], wanted: Wanted) -> Sheet:
    """Fill in the wanted cells of every table, and their faults."""
    for index, head in enumerate(bare.header):
        unit = bare.units[index] if bare.units else ""
        dated = "%S" in head or "%S" in unit
        pieces = [table.cells[table.header.index(head)] for table in tables if head in table.header]
        if head in wanted.texts or (dated and head in wanted.numbers):
            bare.texts[index] = [cell if isinstance(cell, str) else spelled(float(cell)) for p in pieces for cell in p]
        elif wanted.as_numbers(head):
            values, faults = _numbers(bare, head, pieces)
            bare.numbers[index] = values
            if faults:
                bare.faults[index] = faults
    return bare


def _numbers(sheet: Sheet, head: str, pieces: Sequence[Cells]) -> tuple[Array, list[str]]:
    """Read a column as numbers, and list the cells that are none."""
    values, bad = np.full(sheet.rows, np.nan), []
    for start, piece in zip(sheet.starts, pieces, strict=True):
        if not isinstance(piece, list):
            values[start : start + len(piece)] = piece
            bad += [(start + int(row), "inf") for row in np.flatnonzero(np.isinf(piece))]
            continue
        for row, cell in enumerate(piece, start=start):
            try:
                values[row] = number(plain_numbers(cell)) if cell else np.nan
            except ValueError:
                bad.append((row, cell))
    places = [(sheet.place(row), f"a number is needed (got {cell!r})") for row, cell in bad]
    return values, listed_faults(sheet.path, head, places)
