"""Guesses, from rig files, the entries of a config that read them; what only a person knows stays empty."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from pzd.quantities import DISPLACEMENT, FORCE, TEMPERATURE, TIME, VOLTAGE, Control, Quantity
from pzd.record import Array
from pzd.rig.config import FilesEntry, FileSplit, NamedLayout
from pzd.rig.files.fitting import best_layout
from pzd.rig.files.formats import TEXT, read_sheet
from pzd.rig.files.headers import assigned, control_of, is_canonical, unit_of
from pzd.rig.files.layout import NEEDED, own_quantity
from pzd.rig.files.sheet import Wanted
from pzd.rig.files.sniffing import Dialect, described
from pzd.schema.errors import DataError, at
from pzd.schema.scalars import written
from pzd.signals.work import work

_SHOWN = 6
"""Headers that a refusal shows."""
_NAMES = {
    "voltage": re.compile(r"(?<![A-Za-z0-9])([0-9]+(?:[.x,][0-9]+)?)(mV|kV|V)(?![A-Za-z])"),
    "current": re.compile(r"(?<![A-Za-z0-9])([0-9]+(?:[.x,][0-9]+)?)(mA|A)(?![A-Za-z])"),
    "temperature": re.compile(r"(?<![A-Za-z0-9])([0-9]+(?:[.x,][0-9]+)?)(degC|C)(?![A-Za-z])"),
}
"""How a file's name tells what no column holds: 150V, 0x5A, 22degC."""
_DATES = ("%Y-%m-%d", "%Y/%m/%d", "%d.%m.%Y", "%m/%d/%Y", "%d/%m/%Y")
_TIMES = ("%H:%M:%S.%f", "%H:%M:%S", "%I:%M:%S.%f %p", "%I:%M:%S %p")
FORMATS = (
    *(f"{date}{between}{time}" for date in _DATES for between in "T " for time in (*_TIMES, "%H:%M:%S.%f%z")),
    *_TIMES,
)
"""Formats of date and time that are tried on the first row."""

_EVENTS = re.compile(r"event|marker|marke|ereignis", re.IGNORECASE)
_GOES_ON = re.compile(r"resume|restart|start|begin|weiter", re.IGNORECASE)
"""Words of an event with which another recording begins."""


@dataclass(frozen=True)
class _File:
    """A rig file as it was sniffed."""

    path: Path
    dialect: Dialect
    columns: tuple[tuple[Quantity, str], ...]
    form: str
    """Its format."""

    @property
    def layout(self) -> tuple[object, ...]:
        """What two files must share to be read by one entry."""
        d = self.dialect
        kind = [_date_format(cell) for cell in d.first]
        return self.form, d.header, d.units, d.separator, d.decimal, d.skip, d.encoding, tuple(kind)


def guessed(files: Sequence[Path], layout: str | None = None, folder: Path = Path()) -> list[str]:
    """A config for rig files, as lines of YAML, with empty places where only a person knows the answer.

    Parameters
    ----------
    files : the rig files
    layout : the layout to read them by; by default one that fits, else none
    folder : where layouts of the user may lie

    Returns
    -------
    the lines; each empty place says in a comment what to fill in

    Raises
    ------
    DataError : when a file is no table of a rig's channels, a line a file
    UserError : when a file cannot be read, or not by the layout that was asked for
    """
    fitting, found = _sorted_out(files, layout, folder)
    control = next((one.control.signal() for one, _ in fitting.values()), None) or _control(found)
    lines = [] if not found else ["# Guessed from the headers: check every line. Paths are relative to this file."]
    if fitting:
        lines.append("# By the layout that fits: check its values for your rig. Paths are relative to this file.")
    if control != Control():
        lines.append(f"control: {{name: {control.name}, unit: {control.unit}}}")
    lines += ["rig:", "  files:"]
    for name, (fits, paths) in fitting.items():
        for pattern, _ in _patterns(paths):
            lines += [f"    - path: {written(pattern)}", f"      layout: {name}    # {fits.about}"]
    groups: dict[tuple[object, ...], list[_File]] = {}
    for file in found:
        groups.setdefault(file.layout, []).append(file)
    for group in groups.values():
        for pattern, members in _patterns([file.path for file in group]):
            mine = [file for file in group if file.path in members]
            lines += [f"    - path: {written(pattern)}", *(f"      {line}" for line in _entry(mine, control))]
    return lines


def _sorted_out(
    files: Sequence[Path], layout: str | None, folder: Path
) -> tuple[dict[str, tuple[NamedLayout, list[Path]]], list[_File]]:
    """The layouts that fit, each with its files, and the files that none fits."""
    fitting: dict[str, tuple[NamedLayout, list[Path]]] = {}
    found: list[_File] = []
    faults: list[str] = []
    for path in files:
        try:
            dialect, form = described(path)
            fits = best_layout(path, dialect.header, folder, layout)
            if fits is None:
                found.append(_file(path, dialect, form))
            else:
                fitting.setdefault(fits[0], (fits[1], []))[1].append(path)
        except DataError as error:
            faults += error.messages if layout else [f"{error.messages[0]}; init reads tables of named columns"]
    if faults:
        raise DataError(faults)
    return fitting, found


def _control(files: Sequence[_File]) -> Control:
    control = control_of([header for file in files for header in file.dialect.header])
    if control == Control() and not any(VOLTAGE in dict(file.columns) for file in files):
        control = Control("current", "A") if _in_names(files, "current") else control
    return control


def _file(path: Path, dialect: Dialect, form: str) -> _File:
    columns = assigned(dialect.header, dialect.units, control_of(dialect.header))
    if not columns:
        shown = ", ".join(dialect.header[:_SHOWN]) + (", ..." if len(dialect.header) > _SHOWN else "")
        line = dialect.header_line if form == TEXT else None
        raise DataError(f"{at(path, line)}: no header names time, displacement or force (got {shown})")
    return _File(path, dialect, tuple(columns.items()), form)


def _patterns(paths: Sequence[Path]) -> list[tuple[str, Sequence[Path]]]:
    """One pattern for all the files where one matches exactly these, else every file by itself."""
    folders, endings = {path.parent for path in paths}, {path.suffix for path in paths}
    if len(paths) > 1 and len(folders) == len(endings) == 1:
        folder, pattern = paths[0].parent, f"*{paths[0].suffix}"
        if set(folder.glob(pattern)) == set(paths):
            return [((folder / pattern).as_posix(), paths)]
    return [(path.as_posix(), [path]) for path in paths]


def _entry(files: Sequence[_File], control: Control) -> Iterator[str]:
    dialect = files[0].dialect
    yield from _dialect_keys(dialect)
    columns = assigned(dialect.header, dialect.units, control)
    named = {own_quantity(q, control): c for q, c in columns.items() if not is_canonical(c, q, control)}
    lost = [q for q in NEEDED if q not in columns]
    if named or lost:
        yield "columns:"
        yield from (f"  {q.name}: {written(column)}" for q, column in named.items())
        yield from (f"  {q.name}:   # fill in: one of {', '.join(dialect.header)}" for q in lost)
    in_names = {name: pattern for name in _absent(columns, control) if (pattern := _in_names(files, name))}
    units = [*_units(named, dialect), *(f"  {name}: {unit}" for name, (_, unit) in in_names.items())]
    if units:
        yield "units:"
        yield from units
    if in_names:
        yield f"pattern: '{'.*'.join(pattern for pattern, _ in in_names.values())}'    # from the files' names"
    yield from _events(files[0])
    if not lost and any(_turned(file, columns) for file in files):
        yield "sign: {force: -1}   # or {displacement: -1}: as they stand, the damper does work on the rig"


def _dialect_keys(dialect: Dialect) -> Iterator[str]:
    if dialect.encoding != "utf-8":
        yield f"encoding: {dialect.encoding}"
    if dialect.skip:
        yield f"skip: {dialect.skip}"
    if dialect.separator == " ":
        yield 'separator: " "'
    if dialect.decimal == "," and any("," in cell for cell in dialect.first):
        yield "decimal: ','"
    if dialect.units_row:
        yield "units_row: true"


def _units(named: dict[Quantity, str], dialect: Dialect) -> Iterator[str]:
    """The units that the header and the row of units do not say as they are read."""
    for quantity, column in named.items():
        index = dialect.header.index(column)
        below = dialect.units[index] if dialect.units else None
        unit = unit_of(column, below, quantity)
        dated = _date_format(dialect.first[index]) if quantity is TIME else None
        if dated is not None:
            yield f"  time: '{dated}'"
        elif unit is None:
            yield f"  {quantity.name}:   # fill in: {column} names no unit, e.g. {quantity.unit}"
        elif not _read_alike(column, below, unit):
            yield f"  {quantity.name}: {written(unit)}"


def _read_alike(column: str, below: str | None, unit: str) -> bool:
    """Whether the reader sees the same unit by itself: in the row of units, or in brackets at the header's end."""
    if below and below.strip("[]() "):
        return below.strip("[]() ") == unit
    return re.search(rf"[\[(]\s*{re.escape(unit)}\s*[\])]\s*$", column) is not None


def _absent(columns: dict[Quantity, str], control: Control) -> list[str]:
    """The labels that no column holds."""
    labels = ((VOLTAGE, control.name), (TEMPERATURE, TEMPERATURE.name))
    return [name for quantity, name in labels if quantity not in columns and name in _NAMES]


def _in_names(files: Sequence[_File], name: str) -> tuple[str, str] | None:
    """The pattern that finds a quantity in the name of every file, and its unit; None where one of them lacks it."""
    matches = [_NAMES[name].search(file.path.stem) for file in files]
    units = {match[2] for match in matches if match}
    if not all(matches) or len(units) != 1:
        return None
    (unit,) = units
    return f"(?P<{name}>[0-9.x]+){unit}(?![A-Za-z])", {"C": "degC"}.get(unit, unit)


def _date_format(cell: str) -> str | None:
    for form in FORMATS:
        try:
            datetime.strptime(cell, form)  # noqa: DTZ007  # only whether it can be read; no instant is kept
        except ValueError:
            continue
        return form
    return None


def _events(file: _File) -> Iterator[str]:
    """Where a logger that was paused says so in its last column: the event with which it went on."""
    head = file.dialect.header[-1]
    if file.form != TEXT or not _EVENTS.search(head):
        return
    wanted = Wanted(texts=frozenset((head,)))
    try:
        sheet = read_sheet(file.path, _as_sniffed(file, FileSplit(event=head, begins=" ")), wanted, "rig.files")
    except DataError:
        return
    later = [text for text in sheet.texts[sheet.header.index(head)][1:] if _GOES_ON.search(text)]
    if later:
        yield f"split: {{event: {written(head)}, begins: {written(later[0])}}}"


def _as_sniffed(file: _File, split: FileSplit | None = None) -> FilesEntry:
    dialect = file.dialect
    said: dict[str, Any] = {"skip": dialect.skip, "units_row": dialect.units_row}
    if file.form == TEXT:
        said |= {"separator": dialect.separator, "decimal": dialect.decimal, "encoding": dialect.encoding}
    return FilesEntry(path=str(file.path), split=split, **said)


def _turned(file: _File, columns: dict[Quantity, str]) -> bool:
    """Whether the work of a file is negative as its numbers stand, whatever their units."""
    heads = frozenset((columns[DISPLACEMENT], columns[FORCE]))
    try:
        needed = tuple(frozenset((head,)) for head in heads)
        sheet = read_sheet(file.path, _as_sniffed(file), Wanted(heads, numbers=heads, needed=needed), "rig.files")
    except DataError:
        return False
    numbers: list[Array] = [
        sheet.numbers.get(sheet.header.index(columns[quantity]), np.empty(0)) for quantity in (DISPLACEMENT, FORCE)
    ]
    x, force = numbers
    known = x.size == force.size > 2 and bool(np.isfinite(x).all() and np.isfinite(force).all())
    return known and work(x, force) < 0.0 and work(x, force - force.mean()) < 0.0
