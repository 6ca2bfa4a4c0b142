"""The dialect of a text file: its characters, lines, separators and fields."""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Sequence
from pathlib import Path

from pzd.schema.errors import DataError, FilesError, at

SEPARATORS = (",", ";", "\t", "|")
"""Separators that are recognised from the header line."""
KINDS = (
    (b"PK\x03\x04", "a zip archive"),
    (b"\xd0\xcf\x11\xe0", "an Excel file of before 2007"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"%PDF", "a PDF file"),
    (b"|CF,", "a file of imc FAMOS"),
    (b"<?xml", "an XML file"),
    (b"<html", "an HTML page"),
    (b"<!DOCTYPE", "an HTML page"),
)
"""First bytes of files that no format reads, and their kinds."""
BLANKS = " "
"""A separator that stands for any run of blanks."""


def text_of(path: Path, encoding: str) -> str:
    """Read the characters of a file, lines ending in a newline.

    Raises
    ------
    FilesError : when the file cannot be read
    DataError : when it is no text of this encoding, or a file of another kind, by its content
    """
    raw = text_bytes(path)
    try:
        text = raw.decode("utf-8-sig" if encoding.lower().replace("_", "-") in ("utf-8", "utf8") else encoding)
    except UnicodeError as error:
        place = raw[: error.start].count(b"\n") + 1 if isinstance(error, UnicodeDecodeError) else None
        likely = "utf-16" if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) else "latin-1"
        raise DataError(f"{at(path, place)}: not {encoding} text; say its encoding, e.g. encoding: {likely}") from None
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    text = text.rstrip("\0")  # a logger that claims a block of its card in advance leaves the rest of it at zero
    if "\0" in text:
        wide = without_mark(raw)
        hint = f"; it is text in {wide}: say encoding: {wide}" if wide else ""
        line = text[: text.index(chr(0))].count(chr(10)) + 1
        raise DataError(f"{at(path, line)}: not a text file (a zero byte){hint}")
    return text


def without_mark(raw: bytes) -> str | None:
    """Return the encoding of UTF-16 text that does not begin with its mark; None where it is none.

    The characters of a table are ASCII for the most part, of which every second byte is zero.
    """
    start = raw[:4096]
    zeros = start[0::2].count(0), start[1::2].count(0)
    half = 0.5 * len(start) / 2.0
    if zeros[1] > half and zeros[0] == 0:
        return "utf-16-le"
    return "utf-16-be" if zeros[0] > half and zeros[1] == 0 else None


def text_bytes(path: Path) -> bytes:
    """Read the bytes of a text file.

    Raises
    ------
    FilesError : when the file cannot be read
    DataError : when it is a file of a kind that no format reads, by its content whatever its name
    """
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise FilesError(f"{at(path)}: cannot be read ({error.strerror})") from None
    for magic, kind in KINDS:
        if raw.startswith(magic):
            raise DataError(f"{at(path)}: this is {kind}; export the table as xlsx, CSV or other delimited text")
    return raw


_POINT_OF_THOUSANDS = re.compile(r"(?<=\d)\.(?=\d{3}(?:\.\d{3})*,\d)")
"""A point before three digits and a comma, where that is the decimal one."""
_QUOTED_COMMAS = re.compile(r'"\s*[+-]?\d{1,3}(?:,\d{3})+\.\d*\s*"')
"""A number in quotes with commas between its thousands and a point: outside of quotes a comma may separate."""
_BETWEEN_THOUSANDS = re.compile(r"(?<=\d)['\u2019\u00a0\u202f](?=\d{3})")
"""Marks that stand between digits for nothing but thousands; a comma or a point may be that of a decimal."""


def plain_numbers(text: str, decimal: str = ".") -> str:
    """Return text without marks between thousands that mean nothing else, and with every minus as a hyphen.

    Examples
    --------
    >>> plain_numbers("\u22121'234,5")
    '-1234,5'
    >>> plain_numbers("1.234,5", ",")
    '1234,5'
    >>> plain_numbers('0.1,"1,077.59"')
    '0.1,"1077.59"'
    """
    if decimal == ",":
        text = _POINT_OF_THOUSANDS.sub("", text)
    elif '"' in text:
        text = _QUOTED_COMMAS.sub(lambda found: found[0].replace(",", ""), text)
    if "\u2212" in text:
        text = text.replace("\u2212", "-")
    return _BETWEEN_THOUSANDS.sub("", text) if any(mark in text for mark in "'\u2019\u00a0\u202f") else text


def after_lines(text: str, count: int) -> int:
    """Return the position behind the first `count` lines."""
    position = 0
    for _ in range(count):
        end = text.find("\n", position)
        if end < 0:
            return len(text)
        position = end + 1
    return position


def fields_of(line: str, separator: str) -> list[str]:
    """Split one line into its fields, stripped."""
    return line.split() if separator == BLANKS else [cell.strip() for cell in line.split(separator)]


def unquoted_fields(line: str, separator: str) -> list[str]:
    """Split one line into its fields, stripped, separators in quotes left alone."""
    if separator == BLANKS:
        line = " ".join(line.split())
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])]


ROW_NAMES = "row"
"""Name of a first column of row numbers, which the header of R's `write.table` leaves out."""


def are_numbered(rows: Sequence[str]) -> bool:
    """Whether some rows, one behind the other, begin with their number in quotes, as `write.table` of R writes them.

    A number without quotes may be one of the columns that the header names, and the last one be without a name.
    """
    return len(rows) > 1 and all(row.lstrip().startswith(f'"{n}"') for n, row in enumerate(rows, start=1))
