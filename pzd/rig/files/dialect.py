"""The dialect of a text file: its characters, its lines, its separator, its fields."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pzd.schema.errors import DataError, FilesError, at

# ----------------------------------------------------------------------------------------------------


SEPARATORS = (",", ";", "\t")
"""Separators that are recognised from the header line."""
KINDS = (
    (b"PK\x03\x04", "a zip archive"),
    (b"\xd0\xcf\x11\xe0", "an Excel file of before 2007"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"%PDF", "a PDF file"),
    (b"<?xml", "an XML file"),
    (b"<html", "an HTML page"),
    (b"<!DOCTYPE", "an HTML page"),
)
"""How files begin that no format reads, and what they are."""
BLANKS = " "
"""Stands for any run of blanks."""


def text_of(path: Path, encoding: str) -> str:
    """The characters of a file, lines ending in a newline.

    Raises
    ------
    FilesError : when the file cannot be read
    DataError : when it is no text of this encoding, or a file of another kind, by its content
    """
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise FilesError(f"{at(path)}: cannot be read ({error.strerror})") from None
    kind = kind_of(raw)
    if kind:
        raise DataError(unread(path, kind))
    try:
        text = raw.decode("utf-8-sig" if encoding.lower().replace("_", "-") in ("utf-8", "utf8") else encoding)
    except UnicodeError as error:
        place = raw[: error.start].count(b"\n") + 1 if isinstance(error, UnicodeDecodeError) else None
        raise DataError(f"{at(path, place)}: not {encoding} text; say its encoding, e.g. encoding: latin-1") from None
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    if "\0" in text:
        raise DataError(f"{at(path, text[: text.index(chr(0))].count(chr(10)) + 1)}: not a text file (a zero byte)")
    return text


def kind_of(raw: bytes) -> str | None:
    """What a file is that no format reads, by its content whatever its name; None where it may be text."""
    return next((kind for magic, kind in KINDS if raw.startswith(magic)), None)


def unread(path: Path, kind: str) -> str:
    """What to say of a file of a kind that no format reads."""
    return f"{at(path)}: this is {kind}; export the table as xlsx, CSV or other delimited text"


def without_blank_end(text: str) -> str:
    """The text without the blank lines at its end."""
    text = text.rstrip("\n")
    while text and not text[text.rfind("\n") + 1 :].strip():
        text = text[: max(text.rfind("\n"), 0)]
    return text


def after_lines(text: str, count: int) -> int:
    """Position behind the first `count` lines."""
    position = 0
    for _ in range(count):
        end = text.find("\n", position)
        if end < 0:
            return len(text)
        position = end + 1
    return position


def separator_of(line: str, wanted: Collection[str], decimal: str) -> str:
    """The separator that shows most of the wanted headers, then most fields."""
    possible = [s for s in SEPARATORS if s != decimal]
    return max(possible, key=lambda s: (len(set(wanted) & set(fields_of(line, s))), line.count(s)))


def fields_of(line: str, separator: str) -> list[str]:
    """The fields of one line, stripped."""
    return line.split() if separator == BLANKS else [cell.strip() for cell in line.split(separator)]


def field_counts(body: str, separator: str) -> NDArray[np.int64]:
    """Number of fields in every line."""
    if separator == BLANKS or not separator.isascii():
        return np.array([len(fields_of(line, separator)) for line in body.split("\n")], dtype=np.int64)
    codes = np.frombuffer(body.encode("utf-8"), dtype=np.uint8)
    ends = np.append(np.flatnonzero(codes == ord("\n")), codes.size)
    before = np.searchsorted(np.flatnonzero(codes == ord(separator)), ends)
    result: NDArray[np.int64] = np.diff(np.concatenate(([0], before))) + 1
    return result


# ----------------------------------------------------------------------------------------------------
# What is wrong with the lines and cells of a text file, and what to do about it.


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
