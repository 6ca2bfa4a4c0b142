"""A rig file as its reader gives it: headers, and the columns that were asked for."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pzd.record import Array
from pzd.schema.errors import at


@dataclass(frozen=True)
class Wanted:
    """The columns that a reader is asked for, by their headers."""

    known: frozenset[str] = frozenset()
    """Every header that may stand in the file; they tell the separator."""
    numbers: frozenset[str] = frozenset()
    """Columns of numbers."""
    texts: frozenset[str] = frozenset()
    """Columns of texts: dates, labels, events."""
    needed: tuple[frozenset[str], ...] = ()
    """For each quantity that a recording must have, the headers that may hold it."""


@dataclass(frozen=True)
class ReadingStep:
    """One thing that was done on the way from a file to its records, for the ingest report."""

    step: Literal["read", "left out", "rename", "unit", "sign", "value", "cut", "clock", "fixture"]
    quantity: str | None
    """The quantity concerned; None for the file as a whole."""
    was: str
    """What stands in the file or in the config."""
    became: str
    """What was made of it."""


@dataclass(frozen=True, eq=False)
class Sheet:
    """What a format hands on: every line has been counted and every wanted cell read."""

    path: Path
    header: tuple[str, ...]
    """Header of every column, stripped."""
    header_line: int | None
    """Line of the header in the file, None where a format has no lines."""
    units: tuple[str, ...] | None
    """Unit of every column where the file says it apart from the header."""
    rows: int
    """Number of data rows."""
    lines: NDArray[np.int64] | None = None
    """(rows,) line of every data row in the file, None where a format has no lines."""
    numbers: dict[int, Array] = field(default_factory=dict)
    """Column -> (rows,); an empty cell is NaN."""
    texts: dict[int, list[str]] = field(default_factory=dict)
    """Column -> its cells as they stand, stripped."""
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
        """File, table and line of a data row; the number of the row where a format has no lines."""
        number = bisect_right(self.starts, row) - 1
        file = table_place(self.path, self.tables[number])
        return f"{file}: row {row - self.starts[number] + 1}" if self.lines is None else f"{file}:{self.lines[row]}"

    def place_in_file(self, row: int) -> str:
        """The same in words, without the file."""
        number = bisect_right(self.starts, row) - 1
        line = f"row {row - self.starts[number] + 1}" if self.lines is None else f"line {self.lines[row]}"
        return f"{line} of {self.tables[number]!r}" if self.tables[number] else line


def table_place(path: Path, table: str) -> str:
    """A file, and the table in it where that has a name."""
    return f"{path}:{table}" if table else at(path)
