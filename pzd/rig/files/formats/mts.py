"""Text of servo-hydraulic stands by MTS: blocks of a line `Data Acquisition`, headers, units and rows, tab between.

Every block is a table, so one with other channels (peaks and valleys) is left out. The first line holds the decimal
sign: `MTS793|MPT|DEU|1|2|,|.|:|...`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pzd.record import Array
from pzd.rig.config import FilesEntry
from pzd.rig.files.dialect import text_of
from pzd.rig.files.sheet import Cells, FileTable, number
from pzd.schema.errors import DataError, at

KIND = "a file of MTS's acquisition blocks"
SUFFIXES = ()
NEEDS = None
OPTIONS = ("decimal", "encoding", "table")

Block = tuple[tuple[str, ...], tuple[Cells, ...], tuple[str, ...], NDArray[np.int64], int]
"""Headers, columns, units, line of every row, and line of the headers."""
SIGNATURE = "MTS793|"
BEGINS = "Data Acquisition"
"""Beginning of the line above each block."""
DECIMAL = 5
"""Index of the decimal sign among the fields of the first line."""
MOST_ABOVE = 20
"""Lines between the beginning of a block and its first row, at most."""


def holds(path: Path, start: bytes) -> bool:
    """Whether a file is of this format, by its first bytes."""
    return start.removeprefix(b"\xef\xbb\xbf").startswith(SIGNATURE.encode())


def tables(path: Path, entry: FilesEntry) -> list[FileTable]:
    """Read one table from each block.

    Raises
    ------
    DataError : when a block has no headers and units above its rows, or rows differ in their number of fields
    """
    lines = text_of(path, entry.encoding).split("\n")
    signature = lines[0].split("|")
    decimal = next((sign for sign in signature[DECIMAL : DECIMAL + 1] if sign in (".", ",")), entry.decimal)
    begins = [number for number, line in enumerate(lines) if line.startswith(BEGINS)]
    blocks = [
        _block(path, lines, first, last, decimal) for first, last in zip(begins, [*begins[1:], len(lines)], strict=True)
    ]
    return [
        FileTable(f"block {n + 1}" if len(blocks) > 1 else "", *block)
        for n, block in enumerate(blocks)
        if block is not None
    ]


def _block(path: Path, lines: list[str], begin: int, end: int, decimal: str) -> Block | None:
    """Read one block; None where it has no rows."""
    first = next(
        (n for n in range(begin + 1, min(end, begin + MOST_ABOVE)) if _numbers(lines[n], decimal) is not None), None
    )
    if first is None:
        return None
    header, units = (tuple(cell.strip() for cell in lines[n].rstrip("\t").split("\t")) for n in (first - 2, first - 1))
    width = len(header)
    if first - begin < 3 or len(units) != width:
        raise DataError(f"{at(path, first + 1)}: no line of headers and line of units above these rows")
    rows: list[Array] = []
    numbers: list[int] = []
    for n in range(first, end):
        if not lines[n].strip():
            continue
        row = _numbers(lines[n], decimal)
        if row is None or row.size != width:
            got = len(lines[n].rstrip("\t").split("\t"))
            raise DataError(f"{at(path, n + 1)}: {width} numbers are needed here (got {got} fields: {lines[n][:60]!r})")
        rows.append(row)
        numbers.append(n + 1)
    return header, tuple(np.array(rows).T), units, np.array(numbers, dtype=np.int64), first - 1


def _numbers(line: str, decimal: str) -> Array | None:
    """Read the numbers of a row; None where it holds anything else."""
    cells = line.rstrip("\t").replace(decimal, ".").split("\t")
    try:
        return np.array([number(cell) for cell in cells])
    except ValueError:
        return None
