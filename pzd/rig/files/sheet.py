"""A rig file as its reader gives it: headers, and the columns that were asked for."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

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

    @property
    def top(self) -> str:
        """File and line of the header."""
        return at(self.path, self.header_line)

    def place(self, row: int) -> str:
        """File and line of a data row."""
        return at(self.path, None if self.lines is None else int(self.lines[row]))
