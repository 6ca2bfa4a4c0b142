"""CSV artefacts: rows of a validated model, or long columns of numbers, read back strictly.

The header is the model's field names (or the columns named), with the control signal
under its own name; every refusal says file and line.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from pzd.quantities import Control
from pzd.schema.errors import DataError, at
from pzd.schema.model import Frozen

Row = TypeVar("Row", bound=Frozen)
Columns = dict[str, NDArray[np.float64]]


def write_rows(path: Path, model: type[Row], rows: Iterable[Row], control: Control) -> None:
    """Write one line a row under the model's field names; None is an empty cell."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([control.renamed(name) for name in model.model_fields])
        for row in rows:
            writer.writerow([_cell(getattr(row, name)) for name in model.model_fields])


def read_rows(path: Path, model: type[Row], control: Control) -> tuple[Row, ...]:
    """Read what `write_rows` wrote (or a person edited).

    Raises
    ------
    DataError : when the header or a cell is not what the model asks for, with every place
    """
    lines = list(csv.reader(io.StringIO(_text(path))))
    _check_header(path, lines, [control.renamed(name) for name in model.model_fields])
    rows: list[Row] = []
    faults: list[str] = []
    for number, cells in enumerate(lines[1:], start=2):
        if len(cells) != len(model.model_fields):
            faults.append(f"{at(path, number)}: {len(cells)} fields where the header has {len(model.model_fields)}")
            continue
        fields = zip(model.model_fields.items(), cells, strict=True)
        try:
            rows.append(model.model_validate({n: _plain(cell, field.annotation) for (n, field), cell in fields}))
        except ValidationError as error:
            faults += [_fault(path, number, detail, control) for detail in error.errors()]
    if faults:
        raise DataError(faults)
    return tuple(rows)


def write_columns(path: Path, columns: Mapping[str, NDArray[np.float64] | None], control: Control) -> None:
    """Write arrays of one length as columns, each number so that it reads back exactly.

    None stands for a column that is absent: its cells are empty.
    """
    import pandas as pd

    frame = pd.DataFrame({control.renamed(name): values for name, values in columns.items()})
    frame.to_csv(path, index=False, lineterminator="\n")


def read_columns(path: Path, header: Sequence[str], control: Control, optional: Sequence[str] = ()) -> Columns:
    """Read columns of finite numbers; those in `optional` may be missing or wholly empty, and are then left out.

    Raises
    ------
    DataError : when the header, a field count or a cell is wrong, with file and line
    """
    lines = _text(path).splitlines()
    given = lines[0].split(",") if lines else []
    names = [name for name in header if name not in optional or control.renamed(name) in given]
    _check_header(path, [given], [control.renamed(name) for name in names])
    faults = [
        f"{at(path, number)}: {line.count(',') + 1} fields where the header has {len(names)}"
        for number, line in enumerate(lines[1:], start=2)
        if line.count(",") != len(names) - 1
    ]
    if faults:
        raise DataError(faults)
    columns: Columns = {}
    for name, cells in zip(names, zip(*(line.split(",") for line in lines[1:]), strict=True), strict=False):
        if name in optional and not any(cells):
            continue
        columns[name] = _numbers(path, control.renamed(name), cells)
    return columns


def _numbers(path: Path, name: str, cells: Sequence[str]) -> NDArray[np.float64]:
    try:
        values = np.array(cells, dtype=np.float64)
    except ValueError:
        values = np.array([_number(cell) for cell in cells])
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise DataError(
            f"{at(path, int(row) + 2)}: {name}: a finite number is needed (got {cells[int(row)]!r})" for row in bad
        )
    return values


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return float("nan")


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise DataError(f"{at(path)}: the file is missing; run the stage again") from None
    except UnicodeDecodeError as error:
        raise DataError(f"{at(path)}: not UTF-8 text ({error.reason})") from None


def _check_header(path: Path, lines: Sequence[Sequence[str]], wanted: Sequence[str]) -> None:
    given = list(lines[0]) if lines else []
    if given != list(wanted):
        raise DataError(f"{at(path, 1)}: the header must read {','.join(wanted)} (got {','.join(given)})")


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return repr(value) if isinstance(value, float) else str(value)


def _plain(cell: str, annotation: Any) -> str | float | None:
    """What a cell stands for: nothing, a number where the field takes one, else its text."""
    if not cell:
        return None
    kinds = {annotation, *get_args(annotation)}
    if kinds.isdisjoint({int, float}) and not any(isinstance(kind, int) for kind in kinds):
        return cell
    for number in (int, float):
        try:
            return number(cell)
        except ValueError:
            continue
    return cell


def _fault(path: Path, number: int, detail: Any, control: Control) -> str:
    name = control.renamed(str(detail["loc"][0])) if detail["loc"] else "row"
    return f"{at(path, number)}: {name}: {detail['msg']} (got {detail['input']!r})"
