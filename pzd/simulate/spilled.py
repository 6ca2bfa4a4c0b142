"""The history of a long ride in a file: what a ride keeps in memory does not grow with its length."""

from __future__ import annotations

import tempfile
import weakref
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from typing_extensions import override

from pzd.record import Array


class SpilledRows:
    """Rows of a history in a nameless file in the folder for temporary files, gone with this object."""

    def __init__(self, columns: int) -> None:
        """Begin a history of so many columns."""
        self._file = tempfile.TemporaryFile(prefix="pzd-ride-")  # noqa: SIM115  # it lives as long as the rows
        weakref.finalize(self, self._file.close)
        self._columns, self._rows = columns, 0

    def add(self, rows: Array) -> None:
        """Add (m, columns) rows behind those so far."""
        self._file.write(np.ascontiguousarray(rows).tobytes())
        self._file.flush()
        self._rows += len(rows)

    def column(self, number: int) -> Array:
        """(n,) one column, mapped from the file: pages that nobody reads take no memory."""
        if self._rows == 0:
            return np.zeros(0)
        return np.memmap(self._file, np.float64, "r", shape=(self._rows, self._columns))[:, number]


class SpilledColumns(Mapping[str, Array]):
    """Named columns of such rows, each mapped anew when it is asked for."""

    def __init__(self, rows: SpilledRows, numbers: Mapping[str, int]) -> None:
        """Take the rows, and the number of each column."""
        self._rows, self._numbers = rows, numbers

    @override
    def __getitem__(self, name: str) -> Array:
        return self._rows.column(self._numbers[name])

    @override
    def __iter__(self) -> Iterator[str]:
        return iter(self._numbers)

    @override
    def __len__(self) -> int:
        return len(self._numbers)


def columns_of(history: Array | SpilledRows, names: Sequence[str], left_out: set[str]) -> Mapping[str, Array]:
    """The columns of a history by their names, but for those left out."""
    numbers = {name: n for n, name in enumerate(names) if name not in left_out}
    if isinstance(history, SpilledRows):
        return SpilledColumns(history, numbers)
    return {name: np.ascontiguousarray(history[:, n]) for name, n in numbers.items()}
