"""Excel workbooks: every sheet is a table; `decimal`, `skip`, `header` and `units_row` as for text.

Of a formula, the value that Excel last computed is read.
"""

from __future__ import annotations

import re
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pzd.rig.files.dialect import plain_numbers
from pzd.rig.files.sheet import MOST_BELOW, FileTable, cells_of, spelled, told_below, words_below

if TYPE_CHECKING:
    from pzd.rig.config import FilesEntry

KIND = "an Excel file"
SUFFIXES = (".xlsx", ".xlsm")
NEEDS = "openpyxl"
OPTIONS = ("decimal", "skip", "header", "units_row", "table")
APART = True


def holds(path: Path, start: bytes) -> bool:
    """Whether a file is of this format, by its first bytes and what it holds."""
    if not start.startswith(b"PK\x03\x04"):
        return False
    try:
        with zipfile.ZipFile(path) as archive:
            return "xl/workbook.xml" in archive.namelist()
    except (OSError, zipfile.BadZipFile):
        return False


def rows(path: Path) -> dict[str, list[list[str]]]:
    """Read the cells of every sheet as texts, row by row."""
    return {name: [["" if v is None else spelled(v) for v in row] for row in found] for name, found in _cells(path)}


def tables(path: Path, entry: FilesEntry) -> list[FileTable]:
    """Read every sheet that has rows below its header."""
    found = (_table(name, cells, entry) for name, cells in _cells(path))
    return [table for table in found if table is not None]


def _table(name: str, cells: list[list[Any]], entry: FilesEntry) -> FileTable | None:
    """Make the table of one sheet; None where nothing stands below its header."""
    above = (entry.header is None) + entry.units_row
    heads, body = cells[entry.skip : entry.skip + above], cells[entry.skip + above :]
    named = list(entry.header) if entry.header is not None else heads[0] if heads else []
    width = max((n + 1 for n, head in enumerate(named) if head is not None), default=0)
    if not width or not body:
        return None
    begin = ["" if row[0] is None else spelled(row[0]) for row in body[-MOST_BELOW - 1 :]]
    below = words_below(begin)
    body = body[: len(body) - below]
    units = tuple(spelled(v) if v is not None else "" for v in heads[-1][:width]) if entry.units_row else None
    return FileTable(
        name,
        tuple("" if head is None else spelled(head) for head in named[:width]),
        tuple(cells_of([_with_point(row[n], entry.decimal) for row in body]) for n in range(width)),
        units,
        np.arange(len(body)) + entry.skip + above + 1,
        entry.skip + 1 if entry.header is None else None,
        steps=(told_below(below),) if below else (),
    )


_WRITTEN = re.compile(r"[-+\u2212]?\d[\d.]*,\d+(?:[eE][-+]?\d+)?")


def _with_point(value: Any, decimal: str) -> Any:
    """Return a number that stands as text with a decimal comma as text with a point."""
    if decimal != "," or not isinstance(value, str) or not _WRITTEN.fullmatch(value.strip()):
        return value
    return plain_numbers(value.strip(), decimal).replace(",", ".")


def _cells(path: Path) -> list[tuple[str, list[list[Any]]]]:
    """Read name and cells of every sheet, rows of one width, without the empty rows at the end."""
    from openpyxl import load_workbook

    with path.open("rb") as file:  # given a path, openpyxl looks at its ending
        book = load_workbook(file, read_only=True, data_only=True)
        found = [(sheet.title, [list(row) for row in sheet.iter_rows(values_only=True)]) for sheet in book.worksheets]
        book.close()
    for _, cells in found:
        width = max(map(len, cells), default=0)
        for row in cells:
            row.extend([None] * (width - len(row)))
        while cells and all(cell is None for cell in cells[-1]):
            cells.pop()
    return found
