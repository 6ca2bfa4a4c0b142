"""Delimited text: CSV and the exports of loggers, with a preamble, any separator and decimal sign.

pandas silently misreads a trailing comma or `0,001;1,5`, so the number of fields in every line is checked first and the
separator is known before a number is parsed.
"""

from __future__ import annotations

import csv
import io
import re
from array import array
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, compress
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pzd.record import Array
from pzd.rig.config import FilesEntry
from pzd.rig.files.dialect import (
    BLANKS,
    ROW_NAMES,
    SEPARATORS,
    after_lines,
    are_numbered,
    fields_of,
    plain_numbers,
    text_of,
    unquoted_fields,
)
from pzd.rig.files.sheet import (
    MOST_BELOW,
    MOST_FAULTS,
    NO_SAMPLE,
    ReadingStep,
    Sheet,
    Wanted,
    listed_faults,
    told_below,
    words_below,
)
from pzd.schema.errors import DataError, at, counted

if TYPE_CHECKING:
    import pandas as pd

KIND = "a text file"
SUFFIXES = (".csv", ".txt", ".tsv", ".dat", ".asc")
NEEDS = None
OPTIONS = ("separator", "decimal", "skip", "header", "units_row", "comment", "leave_out", "encoding")

_EVENT_SEPARATOR = "\x1e"
"""Replaces a separator inside an event, which no logger quotes."""
_UNQUOTED = "\x1f"
"""Separator of lines that were taken out of their quotes."""
_AT_A_TIME, _CHARACTERS = 4096, 65536
"""Lines and characters that are held at a time as strings of a line or a cell, which take many times the file."""
_ROWS_READ = 16
"""Rows that tell whether each begins with its number."""
_GROUPED = re.compile(r"[+-]?\d{1,3}(?:(?:\.\d{3})+,\d*|(?:,\d{3})+\.\d*|(?:[' ]\d{3})+(?:[.,]\d*)?)")
"""A number whose thousands are grouped: 1.129,9 or 1,129.9 or 1'129.9."""
_EMPTY_LINE = re.compile(r"\n[ \t]*\n")
"""Between rows; where no clock tells whether the recording goes on behind it, such a line is refused."""
_WORD = re.compile("[A-Za-z]{2}")
"""What a message of a logger holds, and a number does not."""
_UNIT_CELL = re.compile(r"[\[(]?\s*[A-Za-z\u00b5\u00b0%][A-Za-z0-9\u00b5\u00b0%/*^ ]{0,12}[\])]?")
"""A cell that may be a unit."""


@dataclass(frozen=True, eq=False)
class _Lines:
    """A text file taken apart."""

    heads: list[list[str]]
    """Fields of the header line and the row of units, as far as the file has them."""
    body: str
    """The data lines, fields separated by `separator`, nothing quoted."""
    numbers: NDArray[np.int64]
    """(rows,) line in the file of every data row."""
    fields: NDArray[np.int64]
    """(rows,) number of fields of every data row."""
    separator: str
    left_out: tuple[int, ...] = ()
    """Lines that `leave_out` of the entry leaves out."""


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
    lines = _lines_of(path, entry, wanted)
    heads, body, numbers = lines.heads, lines.body, lines.numbers
    header = list(entry.header) if entry.header is not None else (heads[0] if heads else [])
    header_line = None
    if entry.header is None:
        header_line = int(numbers[0]) - len(heads) if numbers.size else entry.skip + 1
    if not any(header):
        raise DataError(
            f"{at(path, entry.skip + 1)}: no header line; say skip: N where N lines stand above it, or "
            f"header: [...] where there is none (got skip: {entry.skip})"
        )
    if numbers.size == 0:
        raise DataError(f"{at(path, header_line)}: no data rows below the header")
    lines, below = _without_words_below(lines)
    body, numbers = lines.body, lines.numbers
    uneven = lines.fields != len(header)
    trailing = 0
    if entry.split is not None and entry.split.event == header[-1]:
        body, uneven = _with_loose_events(lines, len(header))
    elif uneven.any():
        body, uneven, trailing = _without_trailing_separators(lines, len(header))
    if uneven.any():
        if entry.header is None:
            _refuse_repeated_header(path, numbers, header, _headers_among(body, lines.separator, header))
        raise DataError(_uneven_faults(path, lines, np.flatnonzero(uneven), header, header_line))
    units = tuple(heads[-1]) if entry.units_row else None
    if units is not None and len(units) != len(header):
        raise DataError(f"{at(path, int(numbers[0]) - 1)}: {len(units)} units for {len(header)} columns")
    table = _Table(path, tuple(header), body, numbers, lines.separator, entry.decimal)
    dated = [i for i, head in enumerate(header) if "%S" in head or (units is not None and "%S" in units[i])]
    values, faults = table.numbers([i for i, head in enumerate(header) if head in wanted.numbers and i not in dated])
    rest = (i for i in range(len(header)) if i not in (*dated, *values, *faults))
    for column in [i for i in rest if wanted.as_numbers(header[i])]:
        more, bad = table.numbers([column])
        values, faults = values | more, faults | bad
    sparse = {i: cells for i in faults if header[i] in wanted.held and (cells := table.sparse(i)) is not None}
    values, faults = values | sparse, {i: told for i, told in faults.items() if i not in sparse}
    texts = {i: table.texts(i) for i, head in enumerate(header) if head in wanted.texts or i in dated}
    steps = (*_steps(entry, header, wanted, lines, trailing), *below)
    return Sheet(path, table.header, header_line, units, int(numbers.size), numbers, values, texts, faults, steps=steps)


def _lines_of(path: Path, entry: FilesEntry, wanted: Wanted) -> _Lines:
    """Take a file apart; its text is let go of as soon as that is done, for it is copied more than once."""
    text = text_of(path, entry.encoding)
    below = text[after_lines(text, entry.skip) :]
    rows = after_lines(below, (entry.header is None) + entry.units_row)
    below = below[:rows] + plain_numbers(below[rows:], entry.decimal)
    quoted = entry.comment is not None or entry.leave_out is not None or '"' in text
    return _unquoted_lines(entry, wanted, below) if quoted else _plain_lines(entry, wanted, below)


def _plain_lines(entry: FilesEntry, wanted: Wanted, text: str) -> _Lines:
    """Take apart a file without quotes and comments, quickly: its body is parsed as it stands."""
    text = text.rstrip("\n")
    while text and not text[text.rfind("\n") + 1 :].strip():
        text = text[: max(text.rfind("\n"), 0)]
    above = (entry.header is None) + entry.units_row
    start = after_lines(text, above)
    top, body = text[:start].split("\n")[:above], text[start:]
    first = top[0] if top else text[: after_lines(text, 1)].rstrip("\n")
    separator = entry.separator or _separator_of(first, wanted.known, entry.decimal)
    empty = 0
    while body[: body.find("\n") + 1].strip(" \n") == "" and "\n" in body:  # between the head and the first row
        body, empty = body[body.find("\n") + 1 :], empty + 1
    fields = _field_counts(body, separator) if body else np.empty(0, dtype=np.int64)
    numbers = np.arange(fields.size) + entry.skip + above + empty + 1
    if entry.rate_Hz is None and _EMPTY_LINE.search(body):
        lines = body.split("\n")
        filled = np.array([bool(line.strip()) for line in lines])
        body = "\n".join(compress(lines, filled))
        numbers, fields = numbers[filled], fields[filled]
    return _Lines([fields_of(line, separator) for line in top], body, numbers, fields, separator)


def _unquoted_lines(entry: FilesEntry, wanted: Wanted, text: str) -> _Lines:
    """Take apart a file with quotes or comments, by the csv module, and put it together without them."""
    numbered = _numbered_lines(entry, text)
    first = next(numbered, None)
    separator = entry.separator or _separator_of(first[1] if first else "", wanted.known, entry.decimal)
    above = (entry.header is None) + entry.units_row
    heads: list[list[str]] = []
    numbers, fields = array("q"), array("q")  # a list of as many numbers takes five times the memory
    is_left_out = re.compile(entry.leave_out).search if entry.leave_out is not None else None
    left_out = list[int]()
    blocks: list[str] = []
    block: list[str] = []
    first_rows: list[str] = []
    for number, line in chain([first] if first else [], numbered):
        row = unquoted_fields(line, separator)
        if len(heads) < above:
            heads.append([cell.strip() for cell in row])
            continue
        if not line.strip() and (not numbers or entry.rate_Hz is None):
            continue
        if is_left_out is not None and is_left_out(line):
            left_out.append(number)
            continue
        if len(numbers) < _ROWS_READ:
            first_rows.append(line)
        numbers.append(number)
        fields.append(len(row))
        block.append(_UNQUOTED.join(cell.replace(_UNQUOTED, " ") for cell in row))
        if len(block) == _AT_A_TIME:
            blocks.append("\n".join(block))
            block.clear()
    if heads and fields and fields[0] == len(heads[0]) + 1 and are_numbered(first_rows):
        heads = [[ROW_NAMES, *head] for head in heads]
    body = "\n".join([*blocks, "\n".join(block)] if block else blocks)
    return _Lines(
        heads, body, np.array(numbers, dtype=np.int64), np.array(fields, dtype=np.int64), _UNQUOTED, tuple(left_out)
    )


def _numbered_lines(entry: FilesEntry, text: str) -> Iterator[tuple[int, str]]:
    """Yield each line that is no comment with its number, without the empty lines at the end."""
    empty: list[tuple[int, str]] = []
    number, start = entry.skip, 0
    while start <= len(text):
        end = text.find("\n", start + _CHARACTERS)
        end = len(text) if end < 0 else end
        for line in text[start:end].split("\n"):
            number += 1
            if entry.comment is not None and line.lstrip().startswith(entry.comment):
                continue
            empty.append((number, line))
            if line.strip():
                yield from empty
                empty.clear()
        start = end + 1


def _separator_of(line: str, known: Collection[str], decimal: str) -> str:
    """Return the separator that shows most of the known headers, then most fields."""
    possible = [s for s in SEPARATORS if s != decimal]
    return max(possible, key=lambda s: (len(set(known) & set(fields_of(line, s))), line.count(s)))


def _field_counts(body: str, separator: str) -> NDArray[np.int64]:
    """Count the fields of every line."""
    if separator == BLANKS or not separator.isascii():
        return np.array([len(fields_of(line, separator)) for line in body.split("\n")], dtype=np.int64)
    codes = np.frombuffer(body.encode("utf-8"), dtype=np.uint8)
    ends = np.append(np.flatnonzero(codes == ord("\n")), codes.size)
    before = np.searchsorted(np.flatnonzero(codes == ord(separator)), ends)
    result: NDArray[np.int64] = np.diff(np.concatenate(([0], before))) + 1
    return result


def _with_loose_events(lines: _Lines, width: int) -> tuple[str, NDArray[np.bool_]]:
    """Allow a last column of events to be left out, or to hold separators that nothing quotes.

    Returns
    -------
    the body with such separators marked, and (rows,) which rows are uneven all the same
    """
    uneven = (lines.fields != width) & (lines.fields != width - 1)
    longer = np.flatnonzero(lines.fields > width)
    if not longer.size:
        return lines.body, uneven
    rows = lines.body.split("\n")
    for row in longer.tolist():
        cells = rows[row].split(None if lines.separator == BLANKS else lines.separator)
        event = cells[width - 1 :]
        if all(re.search("[A-Za-z]", cell) for cell in event):
            rows[row] = lines.separator.join([*cells[: width - 1], _EVENT_SEPARATOR.join(event)])
            uneven[row] = False
    return "\n".join(rows), uneven


def _without_words_below(lines: _Lines) -> tuple[_Lines, list[ReadingStep]]:
    """Leave out the lines of words below the last row."""
    begin = [fields_of(line, lines.separator)[:1] for line in lines.body.rsplit("\n", MOST_BELOW + 1)[1:]]
    count = words_below([cell[0] if cell else "" for cell in begin])
    if not count:
        return lines, []
    last = int(lines.fields.size) - count
    kept = lines.body.rsplit("\n", count)[0]
    return replace(lines, body=kept, numbers=lines.numbers[:last], fields=lines.fields[:last]), [told_below(count)]


def _without_trailing_separators(lines: _Lines, width: int) -> tuple[str, NDArray[np.bool_], int]:
    """Take away a separator behind the last field of a row, which some loggers write on all rows or on some.

    Returns
    -------
    the body without them, (rows,) which rows are uneven all the same, and in how many there was one
    """
    longer = lines.fields == width + 1
    uneven = (lines.fields != width) & ~longer
    if lines.separator == BLANKS or np.count_nonzero(longer) < 2:  # one row alone may have lost a field
        return lines.body, lines.fields != width, 0
    rows = lines.body.split("\n")
    count = 0
    for row in np.flatnonzero(longer).tolist():
        short = rows[row].rstrip(" ")
        if short.endswith(lines.separator):
            rows[row], count = short[: -len(lines.separator)], count + 1
        else:
            uneven[row] = True
    return "\n".join(rows), uneven, count


def _headers_among(body: str, separator: str, header: Sequence[str]) -> list[tuple[int, list[str]]]:
    """Return the rows that are a header again, each with its cells: half of them name columns, maybe in other units."""
    names = {name for head in header if any(map(str.isalpha, name := _name_alone(head)))}
    any_name = re.compile("|".join(map(re.escape, names)) or r"(?!)", re.IGNORECASE)
    lines = ((row, line) for row, line in enumerate(body.split("\n")) if any_name.search(line))
    rows = ((row, [cell for cell in fields_of(line, separator) if cell]) for row, line in lines)
    return [
        (row, cells) for row, cells in rows if 2 * sum(_name_alone(c) in names for c in cells) >= max(len(cells), 3)
    ]


def _name_alone(head: str) -> str:
    """Return the name in a header without the unit behind it."""
    return re.split(r"[\[(_/,]", head)[0].strip().casefold()


def _refuse_repeated_header(
    path: Path, numbers: NDArray[np.int64], header: Sequence[str], again: Sequence[tuple[int, list[str]]]
) -> None:
    """Refuse a file whose header stands again in some rows: a logger that was started again wrote on."""
    if again:
        more = {1: "", 2: " and once more below"}.get(len(again), f" and {len(again) - 1} more times below")
        row, cells = again[0]
        other = "" if cells == [head for head in header if head] else f", as {', '.join(cells)}"
        raise DataError(
            f"{at(path, int(numbers[row]))}: the header stands here again{other}{more}: another recording begins; "
            "write each into a file of its own, cut above this line"
        )


def _uneven_faults(
    path: Path, lines: _Lines, rows: NDArray[np.int64], header: Sequence[str], header_line: int | None
) -> list[str]:
    """Describe rows with more or fewer fields than the header."""
    width, usual = len(header), int(np.argmax(np.bincount(lines.fields)))
    alike = np.count_nonzero(lines.fields[rows] == usual) > lines.fields.size - MOST_FAULTS
    if header_line is not None and 1 < usual < width and alike and not np.any(lines.fields == width):
        # Which names have no field nobody can tell: a name may hold the separator, as `Force, N` does.
        kept = f"skip: {header_line} and header: [{', '.join(header[:usual])}]"
        last = ", ".join(filter(None, header[usual:])) or "empty"
        told = f"the header has {width} names, and the rows have {usual} fields"
        return [f"{at(path, header_line)}: {told}; where the last names have none ({last}), say {kept}"]
    separator = "" if lines.separator == _UNQUOTED else f" (separator {lines.separator!r})"
    said = _how_to_leave_out(lines, rows)
    shown = [
        f"{at(path, int(lines.numbers[r]))}: {lines.fields[r]} fields where the header has {width}{separator}{said}"
        for r in rows[:MOST_FAULTS]
    ]
    if rows.size <= MOST_FAULTS:
        return shown
    most = rows.size > lines.fields.size // 2
    advice = "; if the header stands further down, say skip: lines above it" if most else ""
    return [*shown, f"{at(path)}: and {rows.size - MOST_FAULTS} more such lines{advice}"]


_LEFT_OUT = "this is no sample, say leave_out:"
"""What to do about a line with a word among the samples, followed by the words."""


def _how_to_leave_out(lines: _Lines, rows: NDArray[np.int64]) -> str:
    """Say which key leaves uneven rows out, where they are few among others and hold a word, as messages do."""
    if message := _messages_begin(lines, rows):
        return f"; if this is a message of the logger, say comment: {message}"
    if rows.size > min(MOST_FAULTS, lines.fields.size // 2):
        return ""
    every = lines.body.split("\n")
    cells = [[cell.strip() for cell in every[row].split(lines.separator)] for row in rows.tolist()]
    words = {next((cell for cell in of_row if _WORD.search(cell)), "") for of_row in cells}
    return "" if "" in words else f"; if {_LEFT_OUT} {_found_in(words)}"


def _found_in(words: Collection[str]) -> str:
    """Return the regular expression that finds any of some words, as YAML has it."""
    pattern = "|".join(re.sub(r"\\ ", " ", re.escape(word)) for word in sorted(words))
    return "'" + pattern.replace("'", "''") + "'"


def _messages_begin(lines: _Lines, rows: NDArray[np.int64]) -> str | None:
    """Return the letter or mark that begins every uneven row and no other; None where there is none."""
    every = lines.body.split("\n")
    begins = {every[row].lstrip()[:1] for row in rows.tolist()}
    if len(begins) != 1 or rows.size > lines.fields.size // 2:
        return None
    (begin,) = begins
    if not begin or begin.isdigit() or begin in "+-.\"' ":
        return None
    others = sum(line.lstrip().startswith(begin) for line in every)
    return (f"'{begin}'" if not begin.isalpha() else begin) if others == rows.size else None


def _steps(entry: FilesEntry, header: list[str], wanted: Wanted, taken: _Lines, trailing: int) -> Iterator[ReadingStep]:
    """Report what is read of a file, and the lines and columns that are left out."""
    lines = taken.numbers
    if trailing:
        yield ReadingStep("left out", None, f"{counted(trailing, 'separator')} behind the last field of a row", "")
    if entry.skip:
        yield ReadingStep("left out", None, f"{counted(entry.skip, 'line')} above the header", "")
    if taken.left_out:
        yield ReadingStep(
            "left out", None, f"{counted(len(taken.left_out), 'line')} in which {entry.leave_out!r} is found", ""
        )
    between = sum(int(lines[0]) < number < int(lines[-1]) for number in taken.left_out)
    dropped = int(lines[-1] - lines[0]) + 1 - lines.size - between
    if dropped:
        kind = "that are empty" if entry.comment is None else f"that begin with {entry.comment!r}"
        yield ReadingStep("left out", None, f"{counted(dropped, 'line')} {kind}", "")
    yield ReadingStep("read", None, f"lines {lines[0]} to {lines[-1]}", f"{lines.size} rows")
    unread = [head for head in header if head not in wanted.numbers | wanted.texts]
    if unread:
        yield ReadingStep("left out", None, f"columns {', '.join(unread)}", "")


# --- Cells ---


@dataclass(frozen=True, eq=False)
class _Table:
    """The data lines of a text file, which all have as many fields as the header."""

    path: Path
    header: tuple[str, ...]
    body: str
    lines: NDArray[np.int64]
    separator: str
    decimal: str

    def numbers(self, columns: list[int]) -> tuple[dict[int, Array], dict[int, list[str]]]:
        """Parse columns (rows,) of numbers, an empty cell NaN; those with other cells come back as faults."""
        try:
            (frame,) = self._parsed(columns, "float64", self.lines.size)
        except (ValueError, OverflowError):
            again = _headers_among(self.body, self.separator, self.header)
            _refuse_repeated_header(self.path, self.lines, self.header, again)
            return self._cell_by_cell(columns)
        values = {column: frame[column].to_numpy() for column in columns}
        infinite = {
            column: np.flatnonzero(np.isinf(cells)) for column, cells in values.items() if np.isinf(cells).any()
        }
        wrong = "a finite number is needed (got inf)"
        return values, {
            column: self._faults(column, [(int(row), wrong) for row in rows[:MOST_FAULTS]], rows.size)
            for column, rows in infinite.items()
        }

    def sparse(self, column: int) -> Array | None:
        """Parse a column (rows,) in which most cells say in a word that there is no value, which is then NaN.

        Returns
        -------
        None where fewer than half say so, or a cell is neither such a word nor a number
        """
        cells = ["" if cell.lower() in _NO_VALUE else cell for cell in self._cells(column)]
        if 2 * cells.count("") < len(cells):
            return None
        try:
            return np.array([_number(cell, self.decimal) for cell in cells])
        except ValueError:
            return None

    def texts(self, column: int) -> list[str]:
        """Return the cells of one column, stripped; empty where a line ends before it."""
        return list(self._cells(column))

    def _cells(self, column: int) -> Iterator[str]:
        """Yield the cells of one column as `texts` has them, a few at a time in memory."""
        separator = "," if self.separator == _UNQUOTED else self.separator
        for block in self._parsed([column], "str", _AT_A_TIME):
            for cell in block[column].fillna("").tolist():
                yield cell.replace(_EVENT_SEPARATOR, separator).strip()

    def _parsed(self, columns: list[int], kind: str, rows: int) -> Iterator[pd.DataFrame]:
        """Yield columns, so many rows at a time."""
        import pandas as pd

        yield from pd.read_csv(
            io.BytesIO(self.body.encode()),  # a StringIO takes four bytes for each character
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
            chunksize=rows,
        )

    def _cell_by_cell(self, columns: list[int]) -> tuple[dict[int, Array], dict[int, list[str]]]:
        """Parse the slow way, which knows the place of every bad cell."""
        found: dict[int, Array] = {}
        faults: dict[int, list[str]] = {}
        for column in columns:
            values = np.full(self.lines.size, np.nan)
            first: list[tuple[int, str]] = []
            bad, grouped, commas, words = 0, False, False, True
            for row, cell in enumerate(self._cells(column)):
                try:
                    values[row] = _number(cell, self.decimal)
                except ValueError:
                    bad += 1
                    first += [(row, cell)] if bad <= MOST_FAULTS else []
                    grouped = grouped or _GROUPED.fullmatch(cell) is not None
                    commas = commas or ("," in cell and self.decimal != ",")
                    words = words and (cell[0].isalpha() or cell.lower() in _NO_VALUE or cell[0] == "#")
            if bad:
                advice = _advice(grouped=grouped, commas=commas, words=words)
                if words and bad <= min(MOST_FAULTS, self.lines.size // 2) and all(_WORD.search(c) for _, c in first):
                    advice += f"; if {_LEFT_OUT} {_found_in({cell for _, cell in first})}"
                if bad == 1 and first[0][0] == 0 and _UNIT_CELL.fullmatch(first[0][1]):
                    advice = "; if this row holds the units, say units_row: true"
                wrong = [(row, f"a number is needed (got {cell!r}){advice}") for row, cell in first]
                faults[column] = self._faults(column, wrong, bad)
            else:
                found[column] = values
        return found, faults

    def _faults(self, column: int, first: Sequence[tuple[int, str]], count: int) -> list[str]:
        """List the first bad cells, by row and what is wrong, and how many there are in all."""
        places = [(at(self.path, int(self.lines[row])), message) for row, message in first]
        return listed_faults(self.path, self.header[column], places, count)


_NO_VALUE = frozenset({"", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "---"})
"""What loggers write where a slow channel has no sample."""
_FORTRAN = re.compile(r"[+-]?[\d.,]+[dD][+-]?\d+")
"""A number in double precision as Fortran writes it."""


def _number(cell: str, decimal: str) -> float:
    """Return the number in a cell, NaN where it is empty; infinities and NaN are no numbers."""
    if not cell:
        return float("nan")
    if "_" in cell or (decimal == "," and "." in cell):
        raise ValueError(cell)
    if _FORTRAN.fullmatch(cell):
        cell = cell.replace("D", "E").replace("d", "e")
    value = float(cell.replace(",", ".") if decimal == "," else cell)
    if not np.isfinite(value):
        raise ValueError(cell)
    return value


def _advice(*, grouped: bool, commas: bool, words: bool) -> str:
    """Return what to do about cells that are no numbers: grouped by thousands, with commas, or words all of them."""
    if grouped:
        return "; write the file without grouping thousands"
    if commas:
        return "; for decimal commas say decimal: ','"
    return f"; {NO_SAMPLE}" if words else ""
