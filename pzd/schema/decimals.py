"""Columns of numbers as lines of text, each number as the shortest decimal that reads back exactly."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

_MANY = 10_000
"""Numbers that `repr` writes in the time that it takes to load what is compiled, some milliseconds."""


def lines(columns: Sequence[NDArray[np.float64] | None], rows: int) -> bytes:
    """Rows of a CSV file, one line a row.

    Parameters
    ----------
    columns : (rows,) finite numbers each, None where the cells are empty
    rows : how many there are

    Returns
    -------
    the bytes, each number as its `repr`
    """
    filled = [column for column in columns if column is not None]
    if rows * len(filled) >= _MANY:
        from pzd.schema.shortest import shortest_lines

        return shortest_lines(np.stack(filled), np.array([column is not None for column in columns]))
    cells = [[""] * rows if column is None else map(repr, column.tolist()) for column in columns]
    return "".join(f"{','.join(row)}\n" for row in zip(*cells, strict=True)).encode()
