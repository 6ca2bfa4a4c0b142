"""A rig file as its reader gives it: headers, and columns on demand."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Sheet(Protocol):
    """What a format hands on. Field counts are checked before there is a sheet."""

    path: Path
    header: tuple[str, ...]
    """Header of every column, stripped."""
    header_line: int | None
    """Line of the header in the file, None where a format has no lines."""
    units: tuple[str, ...] | None
    """Unit of every column where the file says it apart from the header."""
    rows: int
    """Number of data rows."""

    def numbers(self, columns: list[int]) -> dict[int, Array]:
        """Columns (rows,) of numbers; an empty cell is NaN.

        Raises
        ------
        DataError : when a cell is no finite number and not empty, with its line
        """
        ...

    def texts(self, column: int) -> list[str]:
        """The cells of one column as they stand, stripped."""
        ...

    def line(self, row: int) -> int | None:
        """Line of a data row in the file."""
        ...
