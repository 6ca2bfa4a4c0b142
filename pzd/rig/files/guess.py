"""Guesses, from the headers of rig files, the entries of a config that read them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from pzd.quantities import (
    ACCELERATION,
    CHANNELS,
    DISPLACEMENT,
    FORCE,
    PRESSURE,
    TEMPERATURE,
    TIME,
    VELOCITY,
    VOLTAGE,
    Control,
    Quantity,
)
from pzd.rig.config import FilesEntry
from pzd.rig.files.formats import reader
from pzd.rig.files.layout import ALSO_READ, NEEDED
from pzd.rig.files.layout import own_quantity as own
from pzd.rig.files.sheet import Wanted
from pzd.rig.files.units import UnitError, in_header, to_canonical
from pzd.schema.errors import DataError, at
from pzd.schema.scalars import written

_LOOKS_LIKE = {
    TIME: r"^t$|\btime",
    DISPLACEMENT: r"^[xs]$|disp|pos|stroke|travel|weg",
    VELOCITY: r"^v$|vel|speed",
    ACCELERATION: r"^a$|acc",
    FORCE: r"^f$|force|load|kraft",
    TEMPERATURE: r"temp",
    PRESSURE: r"^p$|press",
}
"""What headers of each quantity look like, a unit in brackets taken off."""
_CONTROLS = {Control(): r"^u$|volt|spannung", Control("current", "A"): r"^i$|current|strom"}
"""What the header of the control signal looks like."""

_SHOWN = 6
"""Headers that a refusal shows."""

Header = tuple[str, ...]


def guessed(files: Sequence[Path]) -> list[str]:
    """A config for rig files, as lines of YAML, with empty places where only a person knows the answer.

    Parameters
    ----------
    files : the rig files

    Returns
    -------
    the lines; each empty place says in a comment what to fill in

    Raises
    ------
    DataError : when a file is no table of a rig's channels, a line a file
    UserError : when a file cannot be read
    """
    by_header: dict[Header, list[Path]] = {}
    faults: list[str] = []
    for path in files:
        try:
            by_header.setdefault(_header(path), []).append(path)
        except DataError as error:
            faults.append(f"{error.messages[0]}; init reads tables with a line of headers on top")
    if faults:
        raise DataError(faults)
    control = _control([column for header in by_header for column in header])
    lines = ["# Guessed from the headers: check every line. Paths are relative to this file."]
    if control != Control():
        lines.append(f"control: {{name: {control.name}, unit: {control.unit}}}")
    lines += ["rig:", "  files:"]
    for header, paths in by_header.items():
        for pattern in _patterns(paths):
            lines += [f"    - path: {written(pattern)}", *(f"      {line}" for line in _entry(header, control))]
    return lines


def _header(path: Path) -> Header:
    sheet = reader(path, None, "rig.files")(
        path, FilesEntry(path=str(path)), Wanted(known=frozenset(q.column for q in CHANNELS))
    )
    if not any(_column(sheet.header, quantity, _control(sheet.header)) for quantity in CHANNELS):
        shown = ", ".join(sheet.header[:_SHOWN]) + (", ..." if len(sheet.header) > _SHOWN else "")
        raise DataError(f"{at(path, sheet.header_line)}: no header names time, displacement or force (got {shown})")
    return sheet.header


def _control(columns: Sequence[str]) -> Control:
    """The control signal that the headers show; a voltage where they show none."""
    shown = [c for c, pattern in _CONTROLS.items() if any(re.search(pattern, _bare(column)) for column in columns)]
    return next(iter(shown), Control())


def _patterns(paths: Sequence[Path]) -> list[str]:
    """One pattern for all the files where one matches exactly these, else every file by itself."""
    folders, endings = {path.parent for path in paths}, {path.suffix for path in paths}
    if len(paths) > 1 and len(folders) == len(endings) == 1:
        folder, pattern = paths[0].parent, f"*{paths[0].suffix}"
        if set(folder.glob(pattern)) == set(paths):
            return [(folder / pattern).as_posix()]
    return [path.as_posix() for path in paths]


def _entry(header: Header, control: Control) -> Iterator[str]:
    found = {q: _column(header, q, control) for q in CHANNELS}
    named = {own(q, control): c for q, c in found.items() if c is not None and not _canonical(c, q, control)}
    lost = [q for q in NEEDED if found[q] is None]
    if named or lost:
        yield "columns:"
        yield from (f"  {q.name}: {written(column)}" for q, column in named.items())
        yield from (f"  {q.name}:   # fill in: one of {', '.join(header)}" for q in lost)
    unitless = [(q, column) for q, column in named.items() if not _says_unit(column, q)]
    if unitless:
        yield "units:"
        yield from (f"  {q.name}:   # fill in: {column} names no unit, e.g. {q.unit}" for q, column in unitless)


def _column(header: Header, quantity: Quantity, control: Control) -> str | None:
    pattern = _CONTROLS[control] if quantity is VOLTAGE else _LOOKS_LIKE[quantity]
    canonical = [column for column in header if _canonical(column, quantity, control)]
    alike = [column for column in header if re.search(pattern, _bare(column))]
    taken = [column for column in alike if not any(_canonical(column, other, control) for other in CHANNELS)]
    return next(iter(canonical or taken), None)


def _canonical(column: str, quantity: Quantity, control: Control) -> bool:
    return column in (own(quantity, control).column, ALSO_READ.get(quantity))


def _says_unit(column: str, quantity: Quantity) -> bool:
    unit = in_header(column, quantity)
    try:
        return unit is not None and to_canonical(np.zeros(1), unit, quantity) is not None
    except UnitError:
        return False


def _bare(column: str) -> str:
    return re.sub(r"[\[(].*", "", column).strip().lower()
