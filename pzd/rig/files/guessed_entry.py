"""Entries of `rig.files` that read rig files, by the layout that fits them or guessed from their headers and names."""

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
from pzd.rig.files.dialect import after_lines
from pzd.rig.files.file_names import one_pattern, setting_in_names, setting_of, value_in_names
from pzd.rig.files.formats import TEXT, read_sheet
from pzd.rig.files.headers import assigned, is_canonical, unit_of
from pzd.rig.files.layout import NEEDED, own_quantity
from pzd.rig.files.sheet import Wanted
from pzd.rig.files.sniffing import Dialect
from pzd.schema.errors import DataError
from pzd.schema.scalars import written
from pzd.signals.work import work

_DATES = ("%Y-%m-%d", "%Y/%m/%d", "%d.%m.%Y", "%m/%d/%Y", "%d/%m/%Y")
_TIMES = ("%H:%M:%S.%f", "%H:%M:%S", "%I:%M:%S.%f %p", "%I:%M:%S %p")
FORMATS = (
    *(f"{date}{between}{time}" for date in _DATES for between in "T " for time in (*_TIMES, "%H:%M:%S.%f%z")),
    *_TIMES,
)
"""Formats of date and time that are tried on the first row."""

_RATE = re.compile(r"(?:sampl|abtast|\brate\b)[^\n\d]*(\d+(?:[.,]\d+)?)\s*(k)?Hz", re.IGNORECASE)
"""A sampling rate in the lines above the header; a frequency alone may be that of the test."""
_EVENTS = re.compile(r"event|marker|marke|ereignis", re.IGNORECASE)
_GOES_ON = re.compile(r"resume|restart|start|begin|weiter", re.IGNORECASE)
"""Words of an event with which another recording begins."""


@dataclass(frozen=True)
class GuessedEntry:
    """An entry of `rig.files`."""

    lines: tuple[str, ...]
    controlled: bool
    """Whether a control signal is read."""
    settings: tuple[str | None, ...]
    """How the clickers of each file stood, by its name."""


@dataclass(frozen=True)
class Sniffed:
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


def by_layout(name: str, layout: NamedLayout, paths: Sequence[Path]) -> Iterator[GuessedEntry]:
    """The entries of files that a layout fits."""
    said = {*layout.columns, *layout.constants, *(re.compile(layout.pattern or "").groupindex)}
    said |= set(layout.split.constants) if layout.split else set()
    controlled = not said.isdisjoint((VOLTAGE.name, layout.control.signal().name))
    for path, members in _patterns(paths):
        lines = [f"    - path: {written(path)}", f"      layout: {name}    # {layout.about}"]
        pattern = layout.pattern or setting_in_names([file.stem for file in members])
        if pattern != layout.pattern:
            lines.append(f"      {_pattern_key(pattern)}")
        yield GuessedEntry(tuple(lines), controlled, tuple(setting_of(pattern, file) for file in members))


def by_headers(found: Sequence[Sniffed], control: Control) -> Iterator[GuessedEntry]:
    """The entries of files whose headers say what they hold."""
    groups: dict[tuple[object, ...], list[Sniffed]] = {}
    for file in found:
        groups.setdefault(file.layout, []).append(file)
    for group in groups.values():
        for path, members in _patterns([file.path for file in group]):
            mine = [file for file in group if file.path in members]
            columns = assigned(mine[0].dialect.header, mine[0].dialect.units, control)
            pattern, units = _from_names(mine, columns, control)
            lines = [f"    - path: {written(path)}"]
            lines += [f"      {line}" for line in _keys(mine, control, columns, pattern, units)]
            controlled = VOLTAGE in columns or control.name in units
            yield GuessedEntry(tuple(lines), controlled, tuple(setting_of(pattern, file.path) for file in mine))


def _from_names(
    files: Sequence[Sniffed], columns: dict[Quantity, str], control: Control
) -> tuple[str | None, dict[str, str]]:
    """The pattern that finds in the files' names what no column holds, and the unit of each quantity in it."""
    names = stems(files)
    labels = {VOLTAGE: control.name, TEMPERATURE: TEMPERATURE.name}
    values = {
        name: value
        for quantity, name in labels.items()
        if quantity not in columns and (value := value_in_names(names, name))
    }
    setting = setting_in_names(names)
    pattern = one_pattern([pattern for pattern, _ in values.values()] + ([setting] if setting else []), names)
    return pattern, {name: unit for name, (_, unit) in values.items()} if pattern else {}


def _keys(
    files: Sequence[Sniffed],
    control: Control,
    columns: dict[Quantity, str],
    pattern: str | None,
    in_names: dict[str, str],
) -> Iterator[str]:
    """The keys of an entry; `in_names` are the units of what the pattern finds."""
    dialect = files[0].dialect
    yield from _dialect_keys(dialect)
    named = {own_quantity(q, control): c for q, c in columns.items() if not is_canonical(c, q, control)}
    lost = [q for q in NEEDED if q not in columns]
    rates = {_rate(file) for file in files} if TIME in lost else set()
    if len(rates) == 1 and (rate := rates.pop()):
        lost.remove(TIME)
        yield f"rate_Hz: {rate:.10g}    # from the lines above the header: no column holds the time"
    if named or lost:
        yield "columns:"
        yield from (f"  {q.name}: {written(column)}" for q, column in named.items())
        left = ", ".join(header for header in dialect.header if header.strip() and header not in columns.values())
        counted = "; or say rate_Hz: N instead, where no column holds it"
        yield from (f"  {q.name}:   # fill in: one of {left}{counted if q is TIME else ''}" for q in lost)
    units = [*_units(named, dialect), *(f"  {name}: {unit}" for name, unit in in_names.items())]
    if units:
        yield "units:"
        yield from units
    if pattern:
        yield _pattern_key(pattern)
    yield from _events(files[0])
    if not lost and any(_turned(file, columns) for file in files):
        yield "sign: {force: -1}   # or {displacement: -1}: as they stand, the damper does work on the rig"


def _rate(file: Sniffed) -> float | None:
    """The sampling rate [Hz] that the lines above the header of a text file tell, None where they tell none."""
    if file.form != TEXT:
        return None
    text = file.path.read_bytes().decode(file.dialect.encoding, errors="replace")
    found = _RATE.search(text[: after_lines(text, file.dialect.skip)])
    return float(found[1].replace(",", ".")) * (1e3 if found[2] else 1.0) if found else None


def _patterns(paths: Sequence[Path]) -> list[tuple[str, Sequence[Path]]]:
    """One pattern for all the files where one matches exactly these, else every file by itself."""
    folders, endings = {path.parent for path in paths}, {path.suffix for path in paths}
    if len(paths) > 1 and len(folders) == len(endings) == 1:
        folder, pattern = paths[0].parent, f"*{paths[0].suffix}"
        if set(folder.glob(pattern)) == set(paths):
            return [((folder / pattern).as_posix(), paths)]
    return [(path.as_posix(), [path]) for path in paths]


def stems(files: Sequence[Sniffed]) -> list[str]:
    """The names of files without their endings."""
    return [file.path.stem for file in files]


def _pattern_key(pattern: str | None) -> str:
    return f"pattern: '{pattern}'    # from the files' names"


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


def _date_format(cell: str) -> str | None:
    for form in FORMATS:
        try:
            datetime.strptime(cell, form)  # noqa: DTZ007  # only whether it can be read; no instant is kept
        except ValueError:
            continue
        return form
    return None


def _events(file: Sniffed) -> Iterator[str]:
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


def _as_sniffed(file: Sniffed, split: FileSplit | None = None) -> FilesEntry:
    dialect = file.dialect
    said: dict[str, Any] = {"skip": dialect.skip, "units_row": dialect.units_row}
    if file.form == TEXT:
        said |= {"separator": dialect.separator, "decimal": dialect.decimal, "encoding": dialect.encoding}
    return FilesEntry(path=str(file.path), split=split, **said)


def _turned(file: Sniffed, columns: dict[Quantity, str]) -> bool:
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
