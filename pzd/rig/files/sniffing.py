"""How a file of unknown layout is written: encoding, separator, decimal sign, preamble, row of units.

Only for the guess of a config: what is read for a run is read as the config says.
"""

from __future__ import annotations

import codecs
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pzd.quantities import CHANNELS
from pzd.rig.config import FilesEntry
from pzd.rig.files.dialect import BLANKS, SEPARATORS, fields_of, kind_of, unread
from pzd.rig.files.formats import TEXT, format_of, formats, read_sheet, rows_in, tables_in
from pzd.rig.files.headers import assigned, control_of
from pzd.rig.files.sheet import Wanted
from pzd.rig.files.tables import spelled
from pzd.schema.errors import DataError, FilesError, at

MOST_LINES = 400
"""Lines from the top that are looked at."""
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_CLOCK = re.compile(r"\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4}([T ].*)?|\d{1,2}:\d{2}(:\d{2}.*)?|\d{4}-\d{2}-\d{2}T.*")
_UNIT = re.compile(r"[\[(]?\s*[A-Za-zµ°%/²³^*.0-9-]{1,8}\s*[\])]?|-")


@dataclass(frozen=True)
class Dialect:
    """How the lines of a file are written; the keys that the config needs differ from the defaults alone."""

    encoding: str
    separator: str
    decimal: str
    skip: int
    header: tuple[str, ...]
    units: tuple[str, ...] | None
    """The unit of every column where the file says it apart from the header."""
    first: tuple[str, ...]
    """The first row of data."""
    units_row: bool = False
    """Whether the units are the row below the header, as the config then has to say."""

    @property
    def header_line(self) -> int:
        """Line of the header in the file."""
        return self.skip + 1


def described(path: Path) -> tuple[Dialect, str]:
    """How a file is written, and its format; of several tables, the one with most of a rig's channels.

    Raises
    ------
    UserError : when the file cannot be read, or holds no table
    """
    form = format_of(path, None, "rig.files")
    module, entry = formats()[form], FilesEntry(path=str(path))
    if form == TEXT:
        found = sniffed(path)
        if found is not None:
            return found, form
        sheet = read_sheet(path, entry, Wanted(known=frozenset(q.column for q in CHANNELS)), "rig.files")
        skip = (sheet.header_line or 1) - 1
        return Dialect("utf-8", ",", ".", skip, sheet.header, None, ("",) * len(sheet.header)), form
    sheets = rows_in(path, module)
    if sheets is not None:
        sniffs = [dialect for rows in sheets.values() if (dialect := sniffed_rows(rows)) is not None]
    else:
        filled = [table for table in tables_in(path, entry, module) if table.rows]
        sniffs = [
            Dialect("utf-8", ",", ".", 0, t.header, t.units, tuple(spelled(cells[0]) for cells in t.cells))
            for t in filled
        ]
    if not sniffs:
        raise DataError(f"{at(path)}: {module.KIND} without a table of numbers below headers")
    return max(sniffs, key=lambda d: len(assigned(d.header, d.units, control_of(d.header)))), form


def sniffed(path: Path) -> Dialect | None:
    """How a file is written; None where no line of numbers below a header is found.

    Raises
    ------
    FilesError : when the file cannot be read
    DataError : when it is a file of another kind
    """
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise FilesError(f"{at(path)}: cannot be read ({error.strerror})") from None
    kind = kind_of(raw)
    if kind:
        raise DataError(unread(path, kind))
    encoding = _encoding(raw)
    text = raw.decode(encoding, errors="replace").removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    lines = text.split("\n")[:MOST_LINES]
    ways = [(separator, decimal) for separator in (*SEPARATORS, BLANKS) for decimal in ".," if separator != decimal]
    tables = [_table([fields_of(line, way[0]) for line in lines], encoding, *way) for way in ways]
    found = [table for table in tables if table is not None]
    return max(found, key=lambda rated: rated[0])[1] if found else None


def sniffed_rows(rows: Sequence[Sequence[str]]) -> Dialect | None:
    """The same of rows of cells, say those of a workbook's sheet."""
    width = max((sum(bool(cell) for cell in row) for row in rows), default=0)
    found = _table([[cell.strip() for cell in row[:width]] for row in rows[:MOST_LINES]], "utf-8", ",", ".")
    return found[1] if found else None


def _encoding(raw: bytes) -> str:
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    try:
        raw.decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8"


def _table(
    cells: list[list[str]], encoding: str, separator: str, decimal: str
) -> tuple[tuple[int, int], Dialect] | None:
    """The table that the rows hold read this way, rated by the rows and then the numbers in it."""
    rows = [[cell.strip('"') for cell in row] for row in cells]
    numbers = [_numbers(row, decimal) for row in rows]
    data = [n for n, row in enumerate(rows) if len(row) > 1 and 2 * numbers[n] >= len(row) and numbers[n]]
    # A line of the preamble, say one of a date, may hold numbers too, but it is narrower than the table.
    usual = Counter(len(rows[n]) for n in data).most_common(1)[0][0] if data else 0
    data = [n for n in data if len(rows[n]) >= usual]
    if not data or data[0] == 0:
        return None
    first = data[0]
    width = len(rows[first])
    below = rows[first - 1]
    units = first > 1 and len(rows[first - 2]) == len(below) == width and bool(below[0] or rows[first - 2][0])
    units = units and any(below) and all(_UNIT.fullmatch(cell) for cell in below if cell)
    top = first - 1 - units
    if len(rows[top]) != width:
        return None
    if separator == BLANKS and any(head.endswith((",", ";")) for head in rows[top]):
        return None  # blanks behind the separator
    # A row may leave out the last column where that is one of events.
    shortest = width - (not _numbers(rows[first][-1:], decimal))
    alike = [n for n in data if shortest <= len(rows[n]) <= width]
    found = Dialect(
        encoding,
        separator,
        decimal,
        top,
        tuple(rows[top]),
        tuple(rows[first - 1]) if units else None,
        tuple(rows[first]),
        units_row=units,
    )
    return (len(alike), sum(numbers[n] for n in alike[:1])), found


def _numbers(row: list[str], decimal: str) -> int:
    """Cells of a row that are numbers, or a date or time."""
    spelled = [cell.replace(",", ".") if decimal == "," and "." not in cell else cell for cell in row]
    return sum(bool(_NUMBER.fullmatch(cell) or _CLOCK.fullmatch(cell)) for cell in spelled)
