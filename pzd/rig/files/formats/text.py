"""Delimited text: CSV and the exports of loggers, with a preamble, any separator and decimal sign.

pandas reads a trailing comma or `0,001;1,5` wrongly without a word, so the number of fields
in every line is checked first and the separator is known before a number is parsed.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pzd.record import Array
from pzd.rig.config import FilesEntry
from pzd.rig.files.dialect import (
    BLANKS,
    MOST_FAULTS,
    after_lines,
    field_counts,
    fields_of,
    hint,
    refuse_another_header,
    separator_of,
    stands_again,
    text_of,
    uneven_lines,
    without_blank_end,
)
from pzd.rig.files.sheet import ReadingStep, Sheet, Wanted
from pzd.schema.errors import DataError, at, counted

if TYPE_CHECKING:
    import pandas as pd

KIND = "a text file"
SUFFIXES = (".csv", ".txt", ".tsv", ".dat", ".asc")
NEEDS = None
OPTIONS = ("separator", "decimal", "skip", "header", "units_row", "comment", "encoding")

_INSIDE = "\x1e"
"""Stands for a separator inside an event, which no logger quotes."""


@dataclass(frozen=True, eq=False)
class _Table:
    """The data lines of a text file, which all have as many fields as the header."""

    path: Path
    header: tuple[str, ...]
    body: str
    """The data lines, fields separated by `separator`, nothing quoted."""
    lines: NDArray[np.int64]
    """Line in the file of every data row."""
    separator: str
    decimal: str

    def numbers(self, columns: list[int]) -> tuple[dict[int, Array], dict[int, list[str]]]:
        """Columns (rows,) of numbers, an empty cell NaN; and the faults of those that hold other cells."""
        try:
            frame = self._parsed(columns, "float64")
            values = {column: frame[column].to_numpy() for column in columns}
            faults: dict[int, list[str]] = {}
        except (ValueError, OverflowError):
            self._refuse_repeated_header(columns)
            read = {column: self._cell_by_cell(column) for column in columns}
            values = {column: cells for column, cells in read.items() if not isinstance(cells, list)}
            faults = {column: cells for column, cells in read.items() if isinstance(cells, list)}
        infinite = {column: self._infinite(column, cells) for column, cells in values.items()}
        return values, faults | {column: found for column, found in infinite.items() if found}

    def texts(self, column: int) -> list[str]:
        """The cells of one column, stripped; empty where a line ends before it."""
        cells = self._parsed([column], "str")[column].fillna("").tolist()
        return [cell.replace(_INSIDE, "," if self.separator == "\x1f" else self.separator).strip() for cell in cells]

    def _parsed(self, columns: list[int], kind: str) -> pd.DataFrame:
        import pandas as pd

        return pd.read_csv(
            io.StringIO(self.body),
            sep=r"\s+" if self.separator == BLANKS else self.separator,
            decimal=self.decimal,
            header=None,
            names=list(range(len(self.header))),
            usecols=columns,
            dtype=kind,
            keep_default_na=False,
            na_values=[""],
            skip_blank_lines=False,
            skipinitialspace=True,
            quoting=csv.QUOTE_NONE,
            engine="c",
        )

    def _refuse_repeated_header(self, columns: list[int]) -> None:
        """Say so where the header stands among the data: a logger that was started again wrote on."""
        again = [row for row, cell in enumerate(self.texts(columns[0])) if cell == self.header[columns[0]]]
        again = again if all(self.texts(c)[row] == self.header[c] for row in again[:1] for c in columns) else []
        if again:
            raise DataError(stands_again(self.path, int(self.lines[again[0]]), len(again)))

    def _cell_by_cell(self, column: int) -> Array | list[str]:
        """The slow way, which knows the place of every bad cell; the faults where there are such."""
        cells = self.texts(column)
        values = np.full(len(cells), np.nan)
        bad: list[int] = []
        for row, cell in enumerate(cells):
            try:
                values[row] = _number(cell, self.decimal)
            except ValueError:
                bad.append(row)
        if bad:
            advice = hint([cells[row] for row in bad])
            return self._listed(column, bad, [f"a number is needed (got {cells[row]!r}){advice}" for row in bad])
        return values

    def _infinite(self, column: int, values: Array) -> list[str]:
        bad = [int(row) for row in np.flatnonzero(np.isinf(values))]
        return self._listed(column, bad, ["a finite number is needed (got inf)"] * len(bad))

    def _listed(self, column: int, rows: list[int], messages: list[str]) -> list[str]:
        name = self.header[column]
        shown = [f"{at(self.path, int(self.lines[r]))}: {name}: {m}" for r, m in zip(rows, messages, strict=True)][
            :MOST_FAULTS
        ]
        return shown + (
            [f"{at(self.path)}: {name}: and {len(rows) - MOST_FAULTS} more"] if len(rows) > len(shown) else []
        )


def read(path: Path, entry: FilesEntry, wanted: Wanted) -> Sheet:
    """Read the wanted columns of a text file, the number of fields in every line checked.

    Parameters
    ----------
    path : the file
    entry : how it is to be read
    wanted : the columns to read

    Raises
    ------
    DataError : when it is no text, has no header or no data rows, or lines differ in their number of fields
    """
    text = text_of(path, entry.encoding)
    skipped = after_lines(text, entry.skip)
    if entry.comment is None and '"' not in text:
        return _plain(path, entry, wanted, without_blank_end(text[skipped:]))
    return _quoted(path, entry, wanted, text[skipped:])


def _plain(path: Path, entry: FilesEntry, wanted: Wanted, text: str) -> Sheet:
    """A file without quotes and comments: its body is parsed as it stands."""
    above = (entry.header is None) + entry.units_row
    start = after_lines(text, above)
    top = text[:start].split("\n")[:above]
    first = top[0] if top else text[: after_lines(text, 1)].rstrip("\n")
    separator = entry.separator or separator_of(first, wanted.known, entry.decimal)
    body = text[start:]
    count = body.count("\n") + 1 if body else 0
    lines = np.arange(count) + entry.skip + above + 1
    heads = [fields_of(line, separator) for line in top]
    fields = field_counts(body, separator) if body else np.empty(0, dtype=np.int64)
    return _sheet(path, entry, wanted, heads, body, lines, fields, separator)


def _quoted(path: Path, entry: FilesEntry, wanted: Wanted, text: str) -> Sheet:
    """A file with quotes or comments: taken apart by the csv module and put together without them."""
    numbered = [
        (number, line)
        for number, line in enumerate(text.split("\n"), start=entry.skip + 1)
        if entry.comment is None or not line.lstrip().startswith(entry.comment)
    ]
    while numbered and not numbered[-1][1].strip():
        numbered.pop()
    first = numbered[0][1] if numbered else ""
    separator = entry.separator or separator_of(first, wanted.known, entry.decimal)
    if separator == BLANKS:
        rows = [line.split() for _, line in numbered]
    else:
        rows = [next(csv.reader([line], delimiter=separator, skipinitialspace=True), []) for _, line in numbered]
    above = (entry.header is None) + entry.units_row
    body = "\n".join("\x1f".join(cell.replace("\x1f", " ") for cell in row) for row in rows[above:])
    lines = np.array([number for number, _ in numbered[above:]], dtype=np.int64)
    fields = np.array([len(row) for row in rows[above:]], dtype=np.int64)
    heads = [[cell.strip() for cell in row] for row in rows[:above]]
    return _sheet(path, entry, wanted, heads, body, lines, fields, "\x1f")


def _sheet(
    path: Path,
    entry: FilesEntry,
    wanted: Wanted,
    heads: list[list[str]],
    body: str,
    lines: NDArray[np.int64],
    fields: NDArray[np.int64],
    separator: str,
) -> Sheet:
    header = list(entry.header) if entry.header is not None else (heads[0] if heads else [])
    header_line = None if entry.header is not None else int(lines[0]) - len(heads) if lines.size else entry.skip + 1
    if not any(header):
        raise DataError(
            f"{at(path, entry.skip + 1)}: no header line; say skip: N where N lines stand above it, or "
            f"header: [...] where there is none (got skip: {entry.skip})"
        )
    if lines.size == 0:
        raise DataError(f"{at(path, header_line)}: no data rows below the header")
    uneven = fields != len(header)
    if entry.split is not None and entry.split.event == header[-1]:
        body, uneven = _with_loose_events(body, fields, len(header), separator)
    if uneven.any():
        if entry.header is None:
            refuse_another_header(path, header, body, lines, separator)
        raise DataError(uneven_lines(path, lines, fields, np.flatnonzero(uneven), len(header), separator))
    units = tuple(heads[-1]) if entry.units_row else None
    if units is not None and len(units) != len(header):
        raise DataError(f"{at(path, int(lines[0]) - 1)}: {len(units)} units for {len(header)} columns")
    table = _Table(path, tuple(header), body, lines, separator, entry.decimal)
    dated = [i for i, head in enumerate(header) if "%S" in head or (units is not None and "%S" in units[i])]
    numbers, faults = table.numbers([i for i, head in enumerate(header) if head in wanted.numbers and i not in dated])
    texts = {i: table.texts(i) for i, head in enumerate(header) if head in wanted.texts or i in dated}
    steps = tuple(_steps(entry, header, wanted, lines))
    return Sheet(path, tuple(header), header_line, units, int(lines.size), lines, numbers, texts, faults, steps=steps)


def _steps(entry: FilesEntry, header: list[str], wanted: Wanted, lines: NDArray[np.int64]) -> Iterator[ReadingStep]:
    """What is read of a file, and the lines and columns that are left out."""
    if entry.skip:
        yield ReadingStep("left out", None, f"{counted(entry.skip, 'line')} above the header", "")
    dropped = int(lines[-1] - lines[0]) + 1 - lines.size
    if dropped:
        yield ReadingStep("left out", None, f"{counted(dropped, 'line')} that begin with {entry.comment!r}", "")
    yield ReadingStep("read", None, f"lines {lines[0]} to {lines[-1]}", f"{lines.size} rows")
    unread = [head for head in header if head not in wanted.numbers | wanted.texts]
    if unread:
        yield ReadingStep("left out", None, f"columns {', '.join(unread)}", "")


def _with_loose_events(
    body: str, fields: NDArray[np.int64], width: int, separator: str
) -> tuple[str, NDArray[np.bool_]]:
    """Rows whose last column is that of events: it may be left out, or hold separators that nothing quotes.

    Returns
    -------
    the body with such separators marked, and (rows,) which rows are uneven all the same
    """
    uneven = (fields != width) & (fields != width - 1)
    longer = np.flatnonzero(fields > width)
    if not longer.size:
        return body, uneven
    rows = body.split("\n")
    for row in longer.tolist():
        cells = rows[row].split(None if separator == BLANKS else separator)
        event = cells[width - 1 :]
        if all(re.search("[A-Za-z]", cell) for cell in event):
            rows[row] = separator.join([*cells[: width - 1], _INSIDE.join(event)])
            uneven[row] = False
    return "\n".join(rows), uneven


def _number(cell: str, decimal: str) -> float:
    """The number in a cell, NaN where it is empty; infinities and NaN are no numbers."""
    if not cell:
        return float("nan")
    if "_" in cell or (decimal == "," and "." in cell):
        raise ValueError(cell)
    value = float(cell.replace(",", ".") if decimal == "," else cell)
    if not np.isfinite(value):
        raise ValueError(cell)
    return value
