"""How a text file of unknown layout is written: encoding, separator, decimal sign, preamble, row of units.

Only for the guess of a config: what is read for a run is read as the config says.
"""

from __future__ import annotations

import codecs
import re
from dataclasses import dataclass
from pathlib import Path

from pzd.rig.files.dialect import BLANKS, SEPARATORS, fields_of, kind_of
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
    """The row of units below the header, None where there is none."""
    first: tuple[str, ...]
    """The first row of data."""

    @property
    def header_line(self) -> int:
        """Line of the header in the file."""
        return self.skip + 1


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
        raise DataError(f"{at(path)}: this is {kind}; export the table as CSV or other delimited text")
    encoding = _encoding(raw)
    text = raw.decode(encoding, errors="replace").removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    lines = text.split("\n")[:MOST_LINES]
    ways = [(separator, decimal) for separator in (*SEPARATORS, BLANKS) for decimal in ".," if separator != decimal]
    tables = [_table(lines, encoding, *way) for way in ways]
    found = [table for table in tables if table is not None]
    return max(found, key=lambda rated: rated[0])[1] if found else None


def _encoding(raw: bytes) -> str:
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    try:
        raw.decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8"


def _table(lines: list[str], encoding: str, separator: str, decimal: str) -> tuple[tuple[int, int], Dialect] | None:
    """The table that the lines hold read this way, rated by the rows and then the numbers in it."""
    rows = [[cell.strip('"') for cell in fields_of(line, separator)] for line in lines]
    numbers = [_numbers(row, decimal) for row in rows]
    data = [n for n, row in enumerate(rows) if len(row) > 1 and 2 * numbers[n] >= len(row) and numbers[n]]
    if not data or data[0] == 0:
        return None
    first = data[0]
    width = len(rows[first])
    units = _UNIT.fullmatch(rows[first - 1][0]) is not None and first > 1 and len(rows[first - 2]) == width
    units = units and len(rows[first - 1]) == width and all(_UNIT.fullmatch(cell) for cell in rows[first - 1] if cell)
    top = first - 1 - units
    if len(rows[top]) != width:
        return None
    alike = [n for n in data if len(rows[n]) == width]
    found = Dialect(
        encoding,
        separator,
        decimal,
        top,
        tuple(rows[top]),
        tuple(rows[first - 1]) if units else None,
        tuple(rows[first]),
    )
    return (len(alike), sum(numbers[n] for n in alike[:1])), found


def _numbers(row: list[str], decimal: str) -> int:
    """Cells of a row that are numbers, or a date or time."""
    spelled = [cell.replace(",", ".") if decimal == "," and "." not in cell else cell for cell in row]
    return sum(bool(_NUMBER.fullmatch(cell) or _CLOCK.fullmatch(cell)) for cell in spelled)
