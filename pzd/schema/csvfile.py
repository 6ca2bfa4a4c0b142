"""CSV and Parquet artefacts: rows of a validated model, or long columns of numbers, read back strictly.

The header is the model's field names (or the columns named), with the control signal under its own name; every refusal
has file and line.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from types import NoneType
from typing import Any, TextIO, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter, ValidationError

from pzd.quantities import Control
from pzd.schema.errors import ConfigError, DataError, at, read_text, worded
from pzd.schema.model import Frozen, nearest

# --- Columns of numbers as text: each number as the shortest decimal that reads back exactly ---

_NUMBERS = TypeAdapter(list[float])
_EMPTY = b"nul"
"""Letters of `null`, which is JSON for a NaN; no number holds one of them."""


def lines(columns: Sequence[NDArray[np.float64] | None], rows: int) -> bytes:
    """Write the rows of a CSV file.

    Parameters
    ----------
    columns : (rows,) finite numbers each, None where the cells are empty
    rows : how many there are

    Returns
    -------
    the bytes, one line for each row
    """
    if not rows:
        return b""
    cells = np.full((rows, len(columns)), np.nan)
    for place, column in enumerate(columns):
        if column is not None:
            cells[:, place] = column
    # JSON writes the same digits as `repr` in a quarter of its time.
    text = np.frombuffer(_NUMBERS.dump_json(cells.ravel().tolist()), dtype=np.uint8)[1:].copy()
    ends = np.flatnonzero(text == ord(","))[len(columns) - 1 :: len(columns)]
    text[ends] = text[-1] = ord("\n")
    return text.tobytes().translate(None, _EMPTY)


def numbers(body: str, columns: Sequence[int], width: int) -> NDArray[np.float64]:
    """Read some columns of lines with `width` cells each, as an array (rows, columns).

    Raises
    ------
    ValueError : where a cell is no number
    """
    if len(columns) == width:
        try:
            cells = _NUMBERS.validate_json("[" + body.strip().replace("\n", ",") + "]", strict=True)
            return np.array(cells).reshape(-1, width)
        except ValueError:
            pass  # written by hand, perhaps, with numbers that JSON does not know: .5, 1., +1
    return np.loadtxt(io.StringIO(body), delimiter=",", comments=None, usecols=columns, ndmin=2)


# --- CSV files ---

Row = TypeVar("Row", bound=Frozen)
Columns = dict[str, NDArray[np.float64]]

_WRITTEN = 10_000
"""Rows that are turned into text at a time, so that memory does not grow with the file."""
_FORMULA = re.compile(r"'*[=+\-@\t\r\n].", re.DOTALL)
"""Text that a spreadsheet computes, or would without the apostrophes; one character alone, as the unit -, is none."""
_MOST_FAULTS = 20
"""Faults of one file that a message lists before it only counts them."""


def write_rows(path: Path, model: type[Row], rows: Iterable[Row], control: Control) -> None:
    """Write one line for each row under the model's field names; None is an empty cell, text is disarmed."""
    names = tuple(model.model_fields)
    texts = [name for name, field in model.model_fields.items() if _takes_text(field.annotation)]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(_Lines(file), lineterminator="\r\n")
        writer.writerow([control.renamed(name) for name in names])
        # The writer leaves None empty and writes a float as `repr` has it, which reads back exactly.
        writer.writerows(
            [disarmed(getattr(row, name)) if name in texts else getattr(row, name) for name in names] for row in rows
        )


class _Lines:
    """A file of lines that end in a line feed, for a writer that quotes a carriage return only if lines end in one."""

    def __init__(self, file: TextIO) -> None:
        self._file = file

    def write(self, line: str) -> int:
        """Write a line."""
        return self._file.write(line.removesuffix("\r\n") + "\n")


def disarmed(cell: Any) -> Any:
    """Return a cell that no spreadsheet takes for a formula: text that begins like one, behind an apostrophe.

    Numbers stay as they are, those in text too.

    Examples
    --------
    >>> disarmed("=HYPERLINK(1)"), disarmed("-1.5"), disarmed("'=1")
    ("'=HYPERLINK(1)", '-1.5', "''=1")
    """
    armed = isinstance(cell, str) and _FORMULA.match(cell) is not None and not _is_number(cell)
    return f"'{cell}" if armed else cell


def _restored(cell: str) -> str:
    """Return the text that `disarmed` made a cell of."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell


def _takes_text(annotation: Any) -> bool:
    return not {annotation, *get_args(annotation)}.isdisjoint({str})


def read_rows(path: Path, model: type[Row], control: Control) -> tuple[Row, ...]:
    """Read what `write_rows` wrote (or a person edited), now or in a version whose model had fewer fields.

    Raises
    ------
    DataError : when the header or a cell does not fit the model, with every place
    """
    lines = _records(path)
    header, fields = lines[0][1] if lines else [], model.model_fields
    names = [name for name in fields if fields[name].is_required() or control.renamed(name) in header]
    if header != [control.renamed(name) for name in names]:
        _check_header(path, header, [control.renamed(name) for name in fields])
    return tuple(row for _, row in _validated_rows(path, lines[1:], model, names, control))


def read_table(
    path: Path, model: type[Row], control: Control, also: Mapping[str, str] | None = None
) -> tuple[tuple[int, Row], ...]:
    """Read rows that a person wrote: columns in any order, and those of fields with a default may be missing.

    An empty cell of a field with a default takes the default; empty lines are passed over.

    Parameters
    ----------
    path : the file
    model : of a row
    control : the control signal, which names its columns
    also : other headers, with the field of each

    Returns
    -------
    each row with the number of its line

    Raises
    ------
    DataError : when the header or a cell does not fit the model, with every place
    """
    lines = _records(path)
    names = _columns_of(path, lines[0][1] if lines else [], model, control, also or {})
    filled = [(number, cells) for number, cells in lines[1:] if cells]
    return _validated_rows(path, filled, model, names, control, defaults=True)


def _validated_rows(
    path: Path,
    lines: Sequence[tuple[int, list[str]]],
    model: type[Row],
    names: Sequence[str],
    control: Control,
    *,
    defaults: bool = False,
) -> tuple[tuple[int, Row], ...]:
    """Validate lines of cells, each with its number.

    Parameters
    ----------
    path, lines : of the file
    model : of a row
    names : field of each column
    control : the control signal, for messages
    defaults : whether an empty cell of a field with a default takes the default
    """
    rows: list[tuple[int, Row]] = []
    faults: list[str] = []
    fields = model.model_fields
    columns = [(name, fields[name].is_required() or not defaults, _reader(fields[name].annotation)) for name in names]
    for number, cells in lines:
        if len(cells) != len(names):
            faults.append(f"{at(path, number)}: {len(cells)} fields where the header has {len(names)}")
            continue
        given = zip(columns, cells, strict=True)
        try:
            row = model.model_validate({name: read(cell) for (name, always, read), cell in given if cell or always})
            rows.append((number, row))
        except ValidationError as error:
            for detail in error.errors():
                column = control.renamed(str(detail["loc"][0])) if detail["loc"] else "row"
                wrong = worded(detail["type"], str(detail["msg"]))
                faults.append(f"{at(path, number)}: {column}: {wrong} (got {detail['input']!r})")
    _refuse(path, faults)
    return tuple(rows)


def _columns_of(
    path: Path, header: Sequence[str], model: type[Row], control: Control, also: Mapping[str, str]
) -> list[str]:
    """Return the field of each column."""
    known = {control.renamed(name): name for name in model.model_fields}
    names = [known.get(name) or also.get(name) or "" for name in header]
    faults = []
    for place, (given, name) in enumerate(zip(header, names, strict=True)):
        near = nearest(given, known)
        hint = f"did you mean {near}?" if near else f"there is {', '.join(known)}"
        if not name:
            faults.append(f"{at(path, 1)}: no such column; {hint} (got {given})")
        elif name in names[:place]:
            faults.append(f"{at(path, 1)}: the column occurs twice (got {given})")
    for column, name in known.items():
        if model.model_fields[name].is_required() and name not in names:
            faults.append(f"{at(path, 1)}: column {column} is missing (got {','.join(header)})")
    _refuse(path, faults)
    return names


def write_columns(
    path: Path, columns: Mapping[str, NDArray[np.float64] | None], control: Control, header: Sequence[str] | None = None
) -> None:
    """Write arrays of one length as columns, each number so that it reads back exactly.

    None stands for a column that is absent, as does a name in the header alone: its cells are empty.

    Raises
    ------
    ValueError : when a number is not finite or the lengths differ, which no reader would take
    """
    names = header or tuple(columns)
    length = max((values.size for values in map(columns.get, names) if values is not None), default=0)
    for first in range(0, length, _WRITTEN):
        wrong = [n for n, v in _block(columns, names, first) if v is not None and not np.isfinite(v).all()]
        if wrong:
            raise ValueError(f"{path.name}: {', '.join(wrong)} must hold finite numbers")
    with path.open("wb") as file:
        file.write(f"{','.join(control.renamed(name) for name in names)}\n".encode())
        for first in range(0, length, _WRITTEN):
            file.write(lines([v for _, v in _block(columns, names, first)], min(length - first, _WRITTEN)))


def _block(
    columns: Mapping[str, NDArray[np.float64] | None], names: Sequence[str], first: int
) -> Iterator[tuple[str, NDArray[np.float64] | None]]:
    """Yield some rows of each column, asked for anew, so that a column in a file is mapped no longer than needed."""
    for name in names:
        values = columns.get(name)
        yield name, None if values is None else np.array(values[first : first + _WRITTEN], dtype=np.float64)


def read_columns(path: Path, header: Sequence[str], control: Control, optional: Sequence[str] = ()) -> Columns:
    """Read columns of finite numbers; those in `optional` may be missing or wholly empty, and are then left out.

    Raises
    ------
    DataError : when the header, a field count or a cell is wrong, with file and line
    """
    top, _, body = _text(path).partition("\n")
    given = top.split(",")
    names = [name for name in header if name not in optional or control.renamed(name) in given]
    _check_header(path, given, [control.renamed(name) for name in names])
    if not body.strip():
        raise DataError(f"{at(path, 1)}: no data rows stand below the header")
    widths = _widths(path, body, len(names))
    empty = [i for i, width in enumerate(widths[0]) if names[i] in optional and width == 0]
    filled = [i for i in range(len(names)) if i not in empty]
    if widths[:, empty].any():
        columns = {i: control.renamed(names[i]) for i in empty}
        _refuse(path, _cell_faults(path, body, columns, bool, "the column is empty above, so it must be here"))
    try:
        table = numbers(body, filled, len(names))
    except ValueError:
        table = None
    if table is None or not np.isfinite(table).all():
        columns = {i: control.renamed(names[i]) for i in filled}
        bad = _cell_faults(path, body, columns, lambda cell: not _is_number(cell), "a finite number is needed")
        _refuse(path, bad)
    return {names[i]: np.ascontiguousarray(table[:, n]) for n, i in enumerate(filled)} if table is not None else {}


def _widths(path: Path, body: str, wanted: int) -> NDArray[np.int64]:
    """Return the bytes of each field (lines, wanted); refuse lines with more or fewer. Such a file has no quotes."""
    codes = np.frombuffer(body.removesuffix("\n").encode() + b"\n", dtype=np.uint8)
    ends = np.flatnonzero((codes == ord(",")) | (codes == ord("\n")))
    fields = np.diff(np.flatnonzero(codes[ends] == ord("\n")), prepend=-1)
    uneven = np.flatnonzero(fields != wanted)
    _refuse(path, [f"{at(path, int(i) + 2)}: {fields[i]} fields where the header has {wanted}" for i in uneven])
    return (np.diff(ends, prepend=-1) - 1).reshape(-1, wanted)


def _cell_faults(
    path: Path, body: str, columns: Mapping[int, str], wrong: Callable[[str], object], message: str
) -> list[str]:
    """List the cells of some columns that are wrong, each with its line."""
    lines = body.removesuffix("\n").split("\n")
    return [
        f"{at(path, number)}: {name}: {message} (got {cells[i]!r})"
        for number, cells in enumerate((line.split(",") for line in lines), start=2)
        for i, name in columns.items()
        if wrong(cells[i])
    ]


def _is_number(cell: str) -> bool:
    try:
        return math.isfinite(float(cell)) and "_" not in cell
    except ValueError:
        return False


def _text(path: Path) -> str:
    text = read_text(path, DataError, "run the stage again").replace("\r\n", "\n")
    if "\0" in text:
        raise DataError(f"{at(path, text.count(chr(10), 0, text.index(chr(0))) + 1)}: a zero byte; this is no text")
    return text


def _records(path: Path) -> list[tuple[int, list[str]]]:
    """Read every record of the file with the number of its first line; a quoted cell may span several."""
    found: list[tuple[int, list[str]]] = []
    reader = csv.reader(io.StringIO(_text(path)), strict=True)
    line = 1
    try:
        for cells in reader:
            found.append((line, cells))
            line = reader.line_num + 1
    except csv.Error as error:
        raise DataError(f"{at(path, line)}: not CSV: {error}") from None
    return found


def _check_header(path: Path, given: Sequence[str], wanted: Sequence[str]) -> None:
    if list(given) == list(wanted):
        return
    twice = sorted({name for name in given if given.count(name) > 1})
    parts = {
        "missing": [name for name in wanted if name not in given],
        "unknown": [name for name in given if name not in wanted],
        "twice": twice,
    }
    wrong = "; ".join(f"{what}: {', '.join(names)}" for what, names in parts.items() if names) or "another order"
    raise DataError(f"{at(path, 1)}: the header must read {','.join(wanted)}; {wrong} (got {','.join(given)})")


def _refuse(path: Path, faults: Sequence[str]) -> None:
    if faults:
        more = len(faults) - _MOST_FAULTS
        raise DataError([*faults[:_MOST_FAULTS], *([f"{at(path)}: and {more} more such faults"] if more > 0 else [])])


def _reader(annotation: Any) -> Callable[[str], str | float | None]:
    """Return what reads the cells of a field: None where one is empty and may be, a number where it takes one, or text.

    One for each column: a file of thousands of rows asks ten thousands of cells.
    """
    kinds = {annotation, *get_args(annotation)}
    empty = None if NoneType in kinds else ""
    takes_text = str in kinds
    takes_numbers = not kinds.isdisjoint({int, float}) or any(isinstance(kind, int) for kind in kinds)

    def read(cell: str) -> str | float | None:
        if not cell:
            return empty
        if takes_text:
            cell = _restored(cell)
        if not takes_numbers:
            return cell
        try:
            value = float(cell)
        except ValueError:
            return cell
        if not math.isfinite(value) or "_" in cell:
            return cell
        return int(cell) if cell.lstrip("+-").isdecimal() else value

    return read


# --- Parquet files, where a CSV would be large; they need pyarrow, an extra ---


def check_installed(key: str) -> None:
    """Refuse a config whose `key` asks for Parquet where nothing can write it.

    Raises
    ------
    ConfigError : when pyarrow is not installed
    """
    if find_spec("pyarrow") is None:
        raise ConfigError(f"{key}: parquet is written with pyarrow, which is not installed; pip install 'pzd[formats]'")


def write_parquet(path: Path, columns: Mapping[str, NDArray[np.float64]], control: Control) -> None:
    """Write arrays of one length as columns.

    Raises
    ------
    ValueError : when a number is not finite, which the reader would not take
    """
    import pyarrow as pa
    from pyarrow import parquet

    wrong = [name for name, values in columns.items() if not np.isfinite(values).all()]
    if wrong:
        raise ValueError(f"{path.name}: {', '.join(wrong)} must hold finite numbers")
    parquet.write_table(pa.table({control.renamed(name): values for name, values in columns.items()}), path)


def read_parquet(
    path: Path, header: Sequence[str], control: Control, optional: Sequence[str] = ()
) -> dict[str, NDArray[np.float64]]:
    """Read columns of finite numbers; those in `optional` may be missing, and are then left out.

    Raises
    ------
    ConfigError : when pyarrow is not installed
    DataError : when the file is missing or is none, or a column is missing or holds anything but finite numbers
    """
    check_installed(at(path))
    import pyarrow as pa
    from pyarrow import parquet

    try:
        table = parquet.read_table(path)
    except FileNotFoundError:
        raise DataError(f"{at(path)}: the file is missing; run the stage again") from None
    except (pa.ArrowInvalid, OSError) as error:
        raise DataError(f"{at(path)}: is no Parquet file ({error}); run the stage again") from None
    found, faults = {}, []
    for name in header:
        column = control.renamed(name)
        if column not in table.column_names:
            faults += [] if name in optional else [f"{at(path)}: column {column} is missing"]
            continue
        values = table.column(column)
        if values.null_count or not pa.types.is_float64(values.type) or not np.isfinite(values.to_numpy()).all():
            faults.append(f"{at(path)}: column {column} must hold finite numbers")
            continue
        found[name] = np.array(values.to_numpy())
    if faults:
        raise DataError(faults)
    return found
