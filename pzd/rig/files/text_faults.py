"""What is wrong with the lines and cells of a text file, and what to do about it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pzd.rig.files.dialect import fields_of
from pzd.schema.errors import DataError, at

MOST_FAULTS = 5
"""Faults of one kind that are listed for one file."""
_GROUPED = re.compile(r"[+-]?\d{1,3}(?:(?:\.\d{3})+,\d*|(?:,\d{3})+\.\d*|(?:[' ]\d{3})+(?:[.,]\d*)?)")
"""A number whose thousands are grouped: 1.129,9 or 1,129.9 or 1'129.9."""


def refuse_another_header(path: Path, head: list[str], body: str, lines: NDArray[np.int64], separator: str) -> None:
    """Say so where the header stands among lines of other lengths: another test begins there.

    Parameters
    ----------
    path : the file
    head : fields of its header line
    body : its data lines
    lines : (rows,) where these stand in the file
    separator : between fields

    Raises
    ------
    DataError : with the line of the first such header
    """
    rows = body.split("\n")
    again = [i for i, row in enumerate(rows) if fields_of(row, separator) == head]
    if again:
        raise DataError(stands_again(path, int(lines[again[0]]), len(again)))


def stands_again(path: Path, line: int, times: int) -> str:
    """That the header stands in a line again, and so many times in all."""
    more = {1: "", 2: " and once more below"}.get(times, f" and {times - 1} more times below")
    return (
        f"{at(path, line)}: the header stands here again{more}: another recording begins; write each into a file of "
        "its own"
    )


def hint(cells: Sequence[str]) -> str:
    """What to do about cells that are no numbers, where they tell it by themselves."""
    if any(_GROUPED.fullmatch(cell) for cell in cells):
        return "; write the file without grouping thousands"
    return "; for decimal commas say decimal: ','" if any("," in cell for cell in cells) else ""


def uneven_lines(
    path: Path,
    lines: NDArray[np.int64],
    fields: NDArray[np.int64],
    rows: NDArray[np.int64],
    wanted: int,
    separator: str,
) -> list[str]:
    """That some lines have more or fewer fields than the header.

    Parameters
    ----------
    path : the file
    lines : (rows,) where its data lines stand
    fields : (rows,) of each line
    rows : which of them are at fault
    wanted : fields of the header
    separator : between fields
    """
    said = "" if separator == "\x1f" else f" (separator {separator!r})"
    shown = [
        f"{at(path, int(lines[r]))}: {fields[r]} fields where the header has {wanted}{said}" for r in rows[:MOST_FAULTS]
    ]
    if rows.size <= MOST_FAULTS:
        return shown
    advice = "; if the header stands further down, say skip: lines above it" if rows.size > lines.size // 2 else ""
    return [*shown, f"{at(path)}: and {rows.size - MOST_FAULTS} more such lines{advice}"]
