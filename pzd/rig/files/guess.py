"""Guess of a config from rig files; what only a person knows stays empty."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from functools import cached_property
from itertools import chain, islice
from pathlib import Path

import numpy as np

from pzd.quantities import (
    ACCELERATION,
    CHANNELS,
    DISPLACEMENT,
    FORCE,
    TEMPERATURE,
    TIME,
    VELOCITY,
    VOLTAGE,
    Control,
    Quantity,
)
from pzd.rig.config import FilesEntry, FileSplit, Limits, NamedLayout
from pzd.rig.files.channels import COMPRESSION
from pzd.rig.files.clock import numbering_column
from pzd.rig.files.dialect import BLANKS, ROW_NAMES
from pzd.rig.files.formats import TEXT, lines_above, read_sheet
from pzd.rig.files.layout import NEEDED, all_layouts, named_layout, number_in_name, own_quantity
from pzd.rig.files.reading import read
from pzd.rig.files.sheet import Wanted
from pzd.rig.files.sniffing import (
    CONTROLS,
    DIRECTIONS,
    STATES,
    Dialect,
    assigned,
    claims,
    control_of,
    described,
    doubt_in_names,
    is_canonical,
    is_in_unit,
    one_pattern,
    quantity_of,
    said_above,
    setting_in_names,
    setting_of,
    settings_apart,
    unit_of,
    value_in_names,
)
from pzd.rig.files.units import RECORDED, columns_under, factor_in, in_header, meant_by
from pzd.schema.errors import DataError, UserError, at
from pzd.schema.yamltree import written
from pzd.signals.measures import work

# --- Layout that fits a file: its columns are there, and its tests are accepted ---

_HERE = Path()
"""The current folder, from which rig files are named; layouts of the user may lie in it."""


def best_layout(path: Path, header: Sequence[str], asked: str | None = None) -> tuple[str, NamedLayout] | None:
    """Find the layout that fits a file; of several, the one that names most of its columns.

    Parameters
    ----------
    path : the file, as seen from the current folder, in which layouts of the user may lie
    header : its headers, as far as they could be seen
    asked : the layout to read it by; by default any

    Returns
    -------
    name and content of the layout, None where none fits

    Raises
    ------
    UserError : when the file cannot be read by the layout that was asked for
    """
    if asked is not None:
        layout = named_layout(asked, _HERE, "--layout")
        _try_reading(path, asked, layout)
        return asked, layout
    likely = {name: layout for name, layout in all_layouts(_HERE).items() if _likely(layout, path, header)}
    for name in sorted(likely, key=lambda name: len(likely[name].columns), reverse=True):
        try:
            _try_reading(path, name, likely[name])
        except UserError:
            continue
        return name, likely[name]
    return None


def _likely(layout: NamedLayout, path: Path, header: Sequence[str]) -> bool:
    """Whether a layout names the columns of a recording, all of them are there, and the file's name matches."""
    columns = layout.columns
    recording = all(quantity.name in columns for quantity in NEEDED)
    named = layout.name is None or re.search(layout.name, path.stem) is not None
    return recording and named and {head for head in columns.values() if head} <= set(header)


def _try_reading(path: Path, name: str, layout: NamedLayout) -> None:
    """Read a file by a layout, for its refusals alone."""
    # A refusal names the file as it was given, as seen from where the command stands.
    read((FilesEntry(path=str(path), layout=name),), Limits(), layout.control.signal(), _HERE)


# --- Entries of `rig.files`, by the layout that fits or guessed from headers and names ---

_DATES = ("%Y-%m-%d", "%Y/%m/%d", "%d.%m.%Y", "%m/%d/%Y", "%d/%m/%Y")
_TIMES = ("%H:%M:%S.%f", "%H:%M:%S,%f", "%H:%M:%S", "%I:%M:%S.%f %p", "%I:%M:%S %p")
FORMATS = (
    *(f"{date}{between}{time}" for date in _DATES for between in "T " for time in (*_TIMES, "%H:%M:%S.%f%z")),
    *_TIMES,
)
"""Formats of date and time that are tried on the first row."""
_RATE = re.compile(r"(?:sampl|abtast|\brate\b)[^\n\d]*(\d+(?:[.,]\d+)?)\s*(k)?Hz", re.IGNORECASE)
"""Sampling rate in the lines above the header; a frequency without such a word may be that of the test."""
_EVENTS = re.compile(r"event|marker|marke|ereignis", re.IGNORECASE)
_GOES_ON = re.compile(r"resume|restart|start|begin|weiter", re.IGNORECASE)
"""Words in an event that begins another recording."""


@dataclass(frozen=True)
class GuessedEntry:
    """An entry of `rig.files` as lines of YAML."""

    lines: tuple[str, ...]
    controlled: bool
    """Whether it reads a control signal."""
    settings: tuple[str | None, ...]
    """Position of the clickers in the name of each file."""


@dataclass(frozen=True)
class SniffedFile:
    """A rig file, its dialect, and the headers of its quantities."""

    path: Path
    dialect: Dialect
    columns: tuple[tuple[Quantity, str], ...]
    form: str
    """Name of its format."""

    def unit_below(self, head: str, quantity: Quantity) -> str | None:
        """Return what the row of units says of the column of a quantity; None where there is none."""
        units = self.dialect.units
        return units[columns_under(head, self.dialect.header, units, quantity)[0]] if units else None

    @cached_property
    def above(self) -> tuple[str, ...]:
        """The lines above the header of every table of a file of text or loose cells."""
        skip = self.dialect.skip
        if not skip:
            return ()
        if self.form == TEXT:
            with self.path.open(encoding=self.dialect.encoding, errors="replace") as file:
                return ("".join(islice(file, skip)),)
        entry = _as_sniffed(self)
        sheet = read_sheet(self.path, entry, Wanted(numbers=frozenset(self.dialect.header)), "rig.files")
        return lines_above(self.path, entry, sheet, "rig.files")

    @property
    def layout(self) -> tuple[object, ...]:
        """Key that is equal for files that one entry can read."""
        d = self.dialect
        kind = [_date_format(cell) for cell in d.first]
        return (
            self.form,
            d.header,
            d.units,
            d.separator,
            d.decimal,
            d.skip,
            d.encoding,
            d.headless or d.apart or bool(d.without_fields),
            tuple(kind),
            None if TIME in dict(self.columns) else _rate(self),
        )


def by_layout(name: str, layout: NamedLayout, paths: Sequence[Path], among: Sequence[Path]) -> Iterator[GuessedEntry]:
    """Make the entries of files that a layout fits; `among` are all files."""
    quantities = {*layout.columns, *layout.constants, *(re.compile(layout.pattern or "").groupindex)}
    quantities |= set(layout.split.constants) if layout.split else set()
    controlled = not quantities.isdisjoint((VOLTAGE.name, layout.control.signal().name))
    for path, members, setting, in_names in _by_setting(paths, among):
        lines = [f"    - path: {written(path)}", f"      layout: {name}    # {layout.about}"]
        pattern = layout.pattern or in_names
        lines += [f"      {setting.key}"] if setting and pattern is None else []
        if pattern != layout.pattern:
            lines.append(f"      {_pattern_key(pattern)}")
        settings = tuple(setting.name if setting else setting_of(pattern, file) for file in members)
        yield GuessedEntry(tuple(lines), controlled, settings)


def by_headers(found: Sequence[SniffedFile], control: Control, among: Sequence[Path]) -> Iterator[GuessedEntry]:
    """Make the entries of files from their headers; `among` are all files."""
    groups: dict[tuple[object, ...], list[SniffedFile]] = {}
    for file in found:
        groups.setdefault(file.layout, []).append(file)
    for group in groups.values():
        levels = {
            name: _levels_of_folders([file.path for file in group], name) for name in (control.name, TEMPERATURE.name)
        }
        above = [text for file in group for text in file.above]
        for path, members, setting, in_names in _by_setting([file.path for file in group], among):
            mine = [file for file in group if file.path in members]
            d = mine[0].dialect
            columns = dict(mine[0].columns) if d.headless else _told(d, control)
            pattern, units = _from_names(mine, columns, control, in_names)
            unknown = [q for q in (VOLTAGE, TEMPERATURE) if not {q, own_quantity(q, control).name} & {*columns, *units}]
            preamble, said = said_above(above, unknown, control)
            lines = [f"    - path: {written(path)}"]
            lines += [f"      {line}" for line in (_ranges(mine[0]) if mine[0].dialect.headless else ())]
            lines += [f"      {line}" for line in _keys(mine, control, columns, pattern, units | said)]
            lines += [f"      {setting.key}"] if setting else []
            if preamble:
                lines.append(f"      preamble: {written(preamble)}    # in the lines above the header")
            asked = doubt_in_names([file.path.stem for file in mine]) is not None
            controlled = VOLTAGE in columns or control.name in units | said or asked
            unsaid = [] if controlled else [control.name]
            unsaid += [] if TEMPERATURE in columns or TEMPERATURE.name in units | said else [TEMPERATURE.name]
            of_folder = {name: level for name in unsaid if (level := levels[name].get(mine[0].path.parent))}
            if of_folder:
                constants = ", ".join(f"{name}: {level}" for name, level in of_folder.items())
                lines.append(f"      constants: {{{constants}}}    # from the folder's name")
                controlled = controlled or control.name in of_folder
            settings = tuple(setting.name if setting else setting_of(pattern, file.path) for file in mine)
            yield GuessedEntry(tuple(lines), controlled, settings)


def _levels_of_folders(paths: Sequence[Path], name: str) -> dict[Path, str]:
    """Return by folder the value of a quantity in its name; nothing with one folder, or where a name has none."""
    folders = sorted({path.parent for path in paths})
    names = _names_of_folders(folders)
    found = value_in_names(names, name) if len(folders) > 1 else None
    if found is None or found[1] is None:
        return {}
    values = ((folder, re.search(found[0], text)) for folder, text in zip(folders, names, strict=True))
    return {folder: f"{number_in_name(match[1])} {found[1]}".strip() for folder, match in values if match}


def _told(dialect: Dialect, control: Control) -> dict[Quantity, str]:
    """Return the header of every quantity but a displacement or force of which several columns may be the one."""
    found = claims(dialect.header, dialect.units, control)
    return {q: heads[0] for q, heads in found.items() if len(heads) == 1 or q not in (DISPLACEMENT, FORCE)}


def _from_names(
    files: Sequence[SniffedFile], columns: dict[Quantity, str], control: Control, setting: str | None
) -> tuple[str | None, dict[str, str | None]]:
    """Return the pattern for what no column holds but the files' names do, and the unit of each quantity in it.

    `setting` is the part of it that finds the setting.
    """
    names = [file.path.stem for file in files]
    labels = {VOLTAGE: control.name, TEMPERATURE: TEMPERATURE.name}
    wanted = [name for quantity, name in labels.items() if quantity not in columns]
    values = {name: value for name in wanted if (value := value_in_names(names, name))}
    pattern = one_pattern([pattern for pattern, _ in values.values()] + ([setting] if setting else []), names)
    return pattern, {name: unit for name, (_, unit) in values.items()} if pattern else {}


def _keys(
    files: Sequence[SniffedFile],
    control: Control,
    columns: dict[Quantity, str],
    pattern: str | None,
    in_names: Mapping[str, str | None],
) -> Iterator[str]:
    """Write the keys of an entry; `in_names` holds the units of the quantities in the pattern, None where unknown."""
    dialect = files[0].dialect
    several = {} if dialect.headless else claims(dialect.header, dialect.units, control)
    yield from _dialect_keys(dialect)
    named = {own_quantity(q, control): c for q, c in columns.items() if not is_canonical(c, q, control)}
    missing = [q for q in NEEDED if q not in columns]
    if TIME in missing and (rate := _sampling_rate(files[0], columns)):
        missing.remove(TIME)
        yield rate
    offered = _offered(files[0], columns, missing, several)
    if named or missing:
        yield "columns:"
        yield from (f"  {q.name}: {written(column)}" for q, column in named.items())
        yield from _asked_columns(offered)
    units = [*_units(named, dialect), *(f"  {name}: {written(unit)}" for name, unit in in_names.items() if unit)]
    units += [
        f"  {name}:   # fill in: the unit of {name} in the files' names"
        for name, unit in in_names.items()
        if unit is None
    ]
    stems = [file.path.stem for file in files]
    doubt = None if control.name in in_names or VOLTAGE in columns else doubt_in_names(stems)
    units += [f"  {doubt[0]}: {doubt[1]}"] if doubt else []
    units += list(_asked_units(files[0], columns, [q for q in missing if q not in several]))
    if units:
        yield "units:"
        yield from units
    if doubt:
        yield _asked_pattern(*doubt, pattern, stems)
    elif pattern:
        yield _pattern_key(pattern)
    taken = {*chain(*offered.values())}
    if (event := _event(files[0])) is not None:
        yield event
        taken.add(dialect.header[-1])
    elif (column := _numbering(files[0], columns, taken)) is not None:
        yield f"split: {{column: {written(column)}}}    # the clock begins again where its label changes"
        taken.add(column)
    if not dialect.headless and (unread := _not_read(files[0], columns, taken, control)):
        yield unread
    if not missing:
        yield from _signs(files, columns)


def _signs(files: Sequence[SniffedFile], columns: dict[Quantity, str]) -> Iterator[str]:
    """Write the sign where the work tells that it is wrong, or else that headers name compression."""
    compressed = {q: columns[q] for q in (DISPLACEMENT, FORCE) if COMPRESSION.search(columns[q])}
    if any(_turned(file, columns) for file in files) and not _recorded(files[0], columns):
        yield "sign: {force: -1}   # or {displacement: -1}: as they stand, the damper does work on the rig"
    elif compressed:
        by = " and ".join(" ".join(head.split()) for head in compressed.values())
        turned = ", ".join(f"{quantity.name}: -1" for quantity in compressed)
        yield f"# compression, by {by}: where it is positive, say sign: {{{turned}}}"


def _sampling_rate(file: SniffedFile, columns: dict[Quantity, str]) -> str | None:
    """Write the sampling rate of a file in which no column may hold the time; it is empty where no line tells it."""
    if rate := _rate(file):
        return f"rate_Hz: {rate:.10g}    # from the lines above the header: no column holds the time"
    if any(not _counts_rows(file, head) for head in _candidates(file, columns, TIME)):
        return None
    return "rate_Hz:   # fill in: samples a second, e.g. 1000; no column holds the time"


def _counts_rows(file: SniffedFile, head: str) -> bool:
    """Whether a column numbers the rows."""
    try:
        sheet = read_sheet(file.path, _as_sniffed(file), Wanted(numbers=frozenset((head,))), "rig.files")
    except DataError:
        return False
    numbers = sheet.numbers.get(sheet.header.index(head), np.empty(0)) if head in sheet.header else np.empty(0)
    return numbers.size > 1 and bool(np.all(np.diff(numbers) == 1.0))


def _offered(
    file: SniffedFile,
    columns: dict[Quantity, str],
    missing: Sequence[Quantity],
    several: Mapping[Quantity, Sequence[str]],
) -> dict[Quantity, list[str]]:
    """Return by quantity that only a person can find the headers that may be it."""
    return {quantity: [*several.get(quantity, _candidates(file, columns, quantity))] for quantity in missing}


def _asked_columns(offered: Mapping[Quantity, list[str]]) -> Iterator[str]:
    """Write the empty places of columns that only a person knows, each with those that may stand there."""
    shown: list[list[str]] = []
    for quantity, free in offered.items():
        counted = "; or say rate_Hz: N instead, where no column holds it" if quantity is TIME else ""
        if free in shown:
            yield f"  {quantity.name}:   # fill in: one of the others of these{counted}"
        else:
            yield f"  {quantity.name}:   # fill in: one of {', '.join(free) or 'none that is seen'}{counted}"
        shown.append(free)


def _not_read(file: SniffedFile, columns: Mapping[Quantity, str], asked: Collection[str], control: Control) -> str:
    """Write which columns stay unread, and what each may be; empty where all of them are read or asked for."""
    named = [head for head in file.dialect.header if head.strip() and head != ROW_NAMES]
    left = dict.fromkeys(head for head in named if head not in columns.values() and head not in asked)
    told = [" ".join(head.split()) + _what_it_may_be(file, head, columns, control) for head in left]
    return f"# not read: {', '.join(told)}" if told else ""


def _what_it_may_be(file: SniffedFile, head: str, columns: Mapping[Quantity, str], control: Control) -> str:
    """Say in brackets which quantity a column that is not read may be; empty where nothing tells."""
    named = quantity_of(head, file.unit_below(head, own_quantity(VOLTAGE, control)), control)
    by_unit = (each for each in CHANNELS if each is not VOLTAGE and is_in_unit(head, file.unit_below(head, each), each))
    quantity = named or next(by_unit, None)
    if quantity is not None:
        name = own_quantity(quantity, control).name
        return f" (another {name})" if quantity in columns else f" (may be the {name})"
    signals = (own_quantity(VOLTAGE, each) for each in CONTROLS)
    signal = any(is_in_unit(head, file.unit_below(head, each), each) for each in signals)
    return " (may be a control signal)" if signal else ""


def _asked_units(file: SniffedFile, columns: dict[Quantity, str], missing: Sequence[Quantity]) -> Iterator[str]:
    """Write the empty places of units of columns that are asked for, where their headers name none."""
    for quantity in missing:
        heads = [(head, file.unit_below(head, quantity)) for head in _candidates(file, columns, quantity)]
        first = dict(zip(file.dialect.header, file.dialect.first, strict=False))
        forms = {_date_format(first.get(head, "")) for head, _ in heads}
        if quantity is TIME and len(forms) == 1 and None not in forms:
            yield f"  time: '{forms.pop()}'"
        elif heads and any(unit_of(head, below, quantity) is None for head, below in heads):
            yield f"  {quantity.name}:   # fill in: the unit of that column, e.g. {_OFTEN[quantity]}"


_OFTEN = {TIME: "s", DISPLACEMENT: "mm", FORCE: "N"}
"""Units of rigs, mostly."""


def _candidates(file: SniffedFile, columns: dict[Quantity, str], quantity: Quantity) -> list[str]:
    """Return the headers that may hold a quantity: in a unit of it, in none, or in one of the recorder."""
    filled = [head for head in file.dialect.header if head.strip()]
    may = [head for head in filled if _may_hold(head, file.unit_below(head, quantity), quantity)]
    free = [head for head in may if head not in columns.values()]
    # Else one of a quantity that a file may go without: a load cell in volts looks like a control signal.
    motion = (*NEEDED, VELOCITY, ACCELERATION)
    return free or [head for head in may if head not in [columns.get(each) for each in motion]]


def _may_hold(head: str, below: str | None, quantity: Quantity) -> bool:
    unit = below.strip("[]() ") if below and below.strip("[]() ") else in_header(head, quantity)
    return not unit or unit in RECORDED or unit_of(head, below, quantity) is not None


def _rate(file: SniffedFile) -> float | None:
    """Return the sampling rate [Hz] in the lines above the header of a text file, None without one."""
    found = next(filter(None, map(_RATE.search, file.above)), None) if file.form == TEXT else None
    return float(found[1].replace(",", ".")) * (1e3 if found[2] else 1.0) if found else None


def _patterns(paths: Sequence[Path]) -> list[tuple[str, Sequence[Path]]]:
    """Return a path pattern for the files of each folder where one matches exactly these, else every file by itself."""
    found: list[tuple[str, Sequence[Path]]] = []
    for folder in dict.fromkeys(path.parent for path in paths):
        mine = [path for path in paths if path.parent == folder]
        pattern = f"*{mine[0].suffix}"
        if len(mine) > 1 and set(folder.glob(pattern)) == set(mine):
            found.append(((folder / pattern).as_posix(), mine))
        else:
            found += [(path.as_posix(), [path]) for path in mine]
    return found


@dataclass(frozen=True)
class _Setting:
    """The setting of some files, and what names it."""

    name: str
    whence: str

    @property
    def key(self) -> str:
        """Return it as a line of the config."""
        return f"setting: {written(self.name)}    # from {self.whence}"


def _by_setting(
    paths: Sequence[Path], among: Sequence[Path]
) -> Iterator[tuple[str, Sequence[Path], _Setting | None, str | None]]:
    """Yield a path pattern, its files, and their setting or else the pattern that finds it in their names."""
    names, stems = [path.stem for path in among], [path.stem for path in paths]
    of_folders, in_files = _settings_of_folders(among), setting_in_names(stems, names)
    apart: Sequence[str | None] = settings_apart(stems, names) or [None] * len(paths)
    if of_folders and in_files:  # of before/click5 both
        apart = [setting_of(in_files, path) for path in paths]
    both = ((of_folders.get(path.parent), its) for path, its in zip(paths, apart, strict=True))
    settings = [" ".join(filter(None, pair)) for pair in both]
    whence = _OF_FOLDER if of_folders else "the files' names"
    for setting in dict.fromkeys(settings):
        mine = [path for path, its in zip(paths, settings, strict=True) if its == setting]
        for path, members in _patterns(mine):
            pattern = None if setting else setting_in_names([m.stem for m in members], names)
            yield path, members, _Setting(setting, whence) if setting else None, pattern


_OF_FOLDER = "the folder's name: remove it, and `setting` above, where all are one damper in one state"


def _settings_of_folders(among: Sequence[Path]) -> dict[Path, str]:
    """Return by folder its name, where folders name a damper or a state each, or hold tests of the same names.

    A control signal or temperature in the name is no part of it, and all of it in names that tell nothing else.
    """
    folders = sorted({path.parent for path in among})
    whole = names = _names_of_folders(folders)
    for quantity in (*(control.name for control in CONTROLS), TEMPERATURE.name):
        if found := value_in_names(names, quantity):
            names = [re.sub(found[0], "", name).strip(" _-") for name in names]
    settings = set(names)
    if len(settings) < 2 or (names != whole and len(settings) == len(folders)):
        return {}
    of = dict(zip(folders, names, strict=True))
    tests = {setting: {path.stem for path in among if of[path.parent] == setting} for setting in settings}
    again = all(any(mine & tests[other] for other in settings - {setting}) for setting, mine in tests.items())
    named = all(STATES.search(name) for name in names) or setting_in_names(names, names) is not None
    return of if again or named else {}


def _names_of_folders(folders: Sequence[Path]) -> list[str]:
    """Return the parts of the paths in which folders differ: of new/csv and aged/csv the first."""
    paths, longest = [folder.parts for folder in folders], max(len(folder.parts) for folder in folders)
    differ = [i for i in range(longest) if len({path[i : i + 1] for path in paths}) > 1]
    told = (" ".join(path[i] for i in differ if i < len(path)) for path in paths)
    return [name or folder.name for name, folder in zip(told, folders, strict=True)]


def _pattern_key(pattern: str | None) -> str:
    return f"pattern: '{pattern}'    # from the files' names"


def _asked_pattern(name: str, unit: str, number: str, others: str | None, stems: Sequence[str]) -> str:
    """Write the empty place of a pattern where a number in the names may be two: 0_5A; beside what else they hold."""
    mark = "_" if "_" in number else "-"
    patterns = (f"(?P<{name}>{digits}){unit}(?![A-Za-z])" for digits in (f"[0-9]+{mark}[0-9]+", "[0-9]+"))
    one, other = (f"'{one_pattern([each, others], stems) or each if others else each}'" for each in patterns)
    whole, last = number.replace(mark, ".").rstrip(unit), number.partition(mark)[2].rstrip(unit)
    return f"pattern: ''   # fill in: is {number} in the names {whole} {unit}, {one}, or {last} {unit}, {other}?"


def _dialect_keys(dialect: Dialect) -> Iterator[str]:
    if dialect.encoding != "utf-8":
        yield f"encoding: {dialect.encoding}"
    if dialect.skip:
        yield f"skip: {dialect.skip}"
    if dialect.separator in (" ", dialect.decimal):
        yield f'separator: "{dialect.separator}"'
    if dialect.apart:
        why = (
            "blanks stand in the headers of the file" if dialect.separator == BLANKS else "from further up in the file"
        )
        yield f"header: [{', '.join(map(written, dialect.header))}]    # {why}"
    if dialect.without_fields:
        missing = ", ".join(filter(None, dialect.without_fields)) or "an empty name"
        why = f"without {missing}, for no row has so many fields; check that no name holds the separator"
        yield f"header: [{', '.join(map(written, dialect.header))}]    # {why}"
    if dialect.headless:
        yield f"header: [{', '.join(dialect.header)}]    # the file has none: these names are made up"
    if dialect.decimal == ",":
        yield "decimal: ','"
    if dialect.units_row:
        yield "units_row: true"


def _units(named: dict[Quantity, str], dialect: Dialect) -> Iterator[str]:
    """Write the units that the reader would not see by itself, and leave empty those that are unknown."""
    for quantity, column in named.items():
        index = columns_under(column, dialect.header, dialect.units, quantity)[0]
        below = dialect.units[index] if dialect.units else None
        unit = unit_of(column, below, quantity)
        dated = _date_format(dialect.first[index]) if quantity is TIME else None
        if dated is not None:
            yield f"  time: '{dated}'"
        elif unit is None:
            yield f"  {quantity.name}:   # fill in: {column} {_lacking(column, below, quantity)}"
        elif not _read_alike(column, below, unit):
            yield f"  {quantity.name}: {written(unit)}"


def _recorded(file: SniffedFile, columns: dict[Quantity, str]) -> bool:
    """Whether force or displacement is in units of the recorder, so that its sign comes with the calibration."""
    heads = [(columns[quantity], quantity) for quantity in (DISPLACEMENT, FORCE)]
    units = (
        below.strip("[]() ")
        if (below := file.unit_below(head, quantity)) and below.strip("[]() ")
        else in_header(head, quantity)
        for head, quantity in heads
    )
    return any(unit in RECORDED for unit in units)


def _lacking(column: str, below: str | None, quantity: Quantity) -> str:
    """Say what a column lacks to be read."""
    recorded = below.strip("[]() ") if below and below.strip("[]() ") else in_header(column, quantity)
    if recorded in RECORDED:
        return (
            f"is in {recorded}: what one of these stands for, e.g. 200 {quantity.unit}; with its zero "
            f"-200 {quantity.unit}/{recorded} about 2.5 {recorded}, or about the mean of the first 10"
        )
    if recorded and (advice := meant_by(recorded, quantity)):
        return f"is in {recorded}: {advice}"
    if factor_in(column):
        return f"names a factor: what one recorded unit stands for, e.g. {quantity.unit}"
    return f"names no unit, e.g. {quantity.unit}"


def _read_alike(column: str, below: str | None, unit: str) -> bool:
    """Whether the reader sees the unit by itself: in the row of units, or in brackets at the header's end."""
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


def _numbering(file: SniffedFile, columns: Mapping[Quantity, str], taken: Collection[str]) -> str | None:
    """Return the header of the column that numbers the tests of a file, whose clock begins again with each."""
    head = columns.get(TIME, "")
    free = [each for each in file.dialect.header if each.strip() and each not in {*columns.values(), *taken}]
    entry = _as_sniffed(file)
    try:
        sheet = read_sheet(file.path, entry, Wanted(numbers=frozenset((head,))), "rig.files")
    except DataError:
        return None
    time = sheet.numbers.get(sheet.header.index(head), np.empty(0)) if head in sheet.header else np.empty(0)
    falls = np.flatnonzero(np.diff(time) < 0.0) + 1
    return numbering_column(file.path, entry, free, falls.tolist(), range(1, time.size))[0] if falls.size else None


def _event(file: SniffedFile) -> str | None:
    """Write how to cut a file of a logger that was paused, by the event in its last column with which it went on."""
    head = file.dialect.header[-1]
    if file.form != TEXT or not _EVENTS.search(head):
        return None
    wanted = Wanted(texts=frozenset((head,)))
    try:
        sheet = read_sheet(file.path, _as_sniffed(file, FileSplit(event=head, begins=" ")), wanted, "rig.files")
    except DataError:
        return None
    later = [text for text in sheet.texts[sheet.header.index(head)][1:] if _GOES_ON.search(text)]
    return f"split: {{event: {written(head)}, begins: {written(later[0])}}}" if later else None


def _as_sniffed(file: SniffedFile, split: FileSplit | None = None) -> FilesEntry:
    return file.dialect.entry(file.path, file.form, split)


def _turned(file: SniffedFile, columns: dict[Quantity, str]) -> bool:
    """Whether the work of a file is negative, whatever its units."""
    heads = frozenset((columns[DISPLACEMENT], columns[FORCE]))
    try:
        needed = tuple(frozenset((head,)) for head in heads)
        sheet = read_sheet(file.path, _as_sniffed(file), Wanted(heads, numbers=heads, needed=needed), "rig.files")
    except DataError:
        return False
    if not heads <= set(sheet.header):
        return False
    both = (DISPLACEMENT, FORCE)
    places = (columns_under(columns[each], sheet.header, sheet.units, each)[0] for each in both)
    x, force = (sheet.numbers.get(place, np.empty(0)) for place in places)
    if not (x.size == force.size > 2 and np.isfinite(x).all() and np.isfinite(force).all()):
        return False
    x, force = (values / (float(np.abs(values).max()) or 1.0) for values in (x, force))  # in whatever units they are
    return work(x, force) < 0.0 and work(x, force - force.mean()) < 0.0


# --- The whole config ---

_SHOWN = 6
"""Headers that a refusal shows: the quantities of a rig, mostly."""
_REBOUND = (
    "# Is extension (rebound) positive in the files? Where compression is, say sign: {displacement: -1, force: -1}."
)
"""Nothing in a recording tells: a damper turned round gives the same loops."""
_WITHOUT_CAR = (
    "# No control signal was found. A report on the damper alone, without a car that rides on it, needs this line too:",
    "# car: false",
)

_PASSIVE = (
    "identify: {law: auto}    # bleed, knee and blow-off of a passive damper, where they predict better than T0 and C"
)
"""One T0 and C are no law of a road or race damper: what it has beside them would be told as missing."""


def guessed(files: Sequence[Path], layout: str | None = None) -> list[str]:
    """Guess a config for rig files, with empty places where only a person knows the answer.

    Parameters
    ----------
    files : the rig files
    layout : the layout to read them by; by default one that fits, else none

    Returns
    -------
    lines of YAML; each empty place has a comment on what to fill in

    Raises
    ------
    DataError : when a file is no table of a rig's channels, a line a file
    UserError : when a file cannot be read, or not by the layout that was asked for
    """
    fitting, found = _by_fit(files, layout)
    control = next((one.control.signal() for one, _ in fitting.values()), None) or _control(found)
    entries = [entry for name, (fits, paths) in fitting.items() for entry in by_layout(name, fits, paths, files)]
    entries += by_headers(found, control, files)
    lines = [] if not found else ["# Guessed from the headers: check every line. Paths are relative to this file."]
    if fitting:
        lines.append("# By the layout that fits: check its values for your rig. Paths are relative to this file.")
    lines.append(_REBOUND)
    if not any(entry.controlled for entry in entries):
        lines += [*_maybe_control(found), *_WITHOUT_CAR, _PASSIVE]
    if control != Control():
        lines.append(f"control: {{name: {control.name}, unit: {written(control.unit)}}}")
    settings = {setting for entry in entries for setting in entry.settings}
    names = sorted(setting for setting in settings if setting is not None)
    if len(settings) > 1:
        one_of = f"diagnose and all behind it are about one of {', '.join(names)}"
        lines.append(f"setting: {written(names[0])}    # {one_of}")
    return [*lines, "rig:", "  files:", *(line for entry in entries for line in entry.lines)]


def _by_fit(
    files: Sequence[Path], layout: str | None
) -> tuple[dict[str, tuple[NamedLayout, list[Path]]], list[SniffedFile]]:
    """Return the layouts that fit, each with its files, and the files that none fits."""
    fitting: dict[str, tuple[NamedLayout, list[Path]]] = {}
    found: list[SniffedFile] = []
    faults: list[str] = []
    for path in files:
        try:
            dialect, form = described(path)
            fits = best_layout(path, dialect.header, layout)
            if fits is None:
                found.append(_file(path, dialect, form))
            else:
                fitting.setdefault(fits[0], (fits[1], []))[1].append(path)
        except DataError as error:
            faults += error.messages if layout else [f"{error.messages[0]}; init reads tables of named columns"]
    if faults:
        raise DataError(faults)
    return fitting, found


def _maybe_control(files: Sequence[SniffedFile]) -> list[str]:
    """Say which columns in volts or amperes were left out: tests at several of their values would pass for one."""
    left = {
        head: control
        for file in files
        for head in file.dialect.header
        for control in CONTROLS
        if quantity_of(head, below := file.unit_below(head, own_quantity(VOLTAGE, control)), control) is None
        and unit_of(head, below, own_quantity(VOLTAGE, control)) is not None
    }
    return [
        f"# Is {head!r} the control signal? Then say columns: {{{control.name}: {written(head)}}}"
        + (
            "."
            if control == Control()
            else f", and at the top control: {{name: {control.name}, unit: {written(control.unit)}}}."
        )
        for head, control in left.items()
    ]


def _control(files: Sequence[SniffedFile]) -> Control:
    signals = [control_of(file.dialect.header, file.dialect.units) for file in files]
    control = next((signal for signal in signals if signal != Control()), Control())
    controlled = any(VOLTAGE in dict(file.columns) for file in files)
    if control != Control() or controlled:
        return control
    above = [text for file in files for text in file.above]
    others = (other for other in CONTROLS if other != Control())
    told = (each for each in others if _in_names(each, files) or said_above(above, [VOLTAGE], each)[1])
    return next(told, control)


def _in_names(control: Control, files: Sequence[SniffedFile]) -> bool:
    """Whether a control signal stands in the name of every file, or of its folder."""
    paths = [file.path for file in files]
    stems = [path.stem for path in paths]
    doubt = doubt_in_names(stems)
    named = value_in_names(stems, control.name) is not None or (doubt is not None and doubt[0] == control.name)
    return named or bool(_levels_of_folders(paths, control.name))


def _file(path: Path, dialect: Dialect, form: str) -> SniffedFile:
    columns = assigned(dialect.header, dialect.units, control_of(dialect.header, dialect.units))
    file = SniffedFile(path, dialect, tuple(columns.items()), form)
    if dialect.headless:
        return replace(file, columns=tuple(_by_values(file).items()))
    line = dialect.header_line if form == TEXT else None
    keyed = [cell for head in dialect.header for cell in head.split() if _KEYED.fullmatch(cell)]
    if len(keyed) > 1:
        raise DataError(
            f"{at(path, line)}: a name stands beside each number (got {keyed[0]}); write the names once, in a line "
            "above the rows"
        )
    here = ", ".join(head for head in dialect.header if head.strip())
    what = _no_test_of_a_damper(file, columns)
    if what is not None:
        raise DataError(f"{at(path, line)}: {what} (got {here})")
    if not columns:
        shown = ", ".join(dialect.header[:_SHOWN]) + (", ..." if len(dialect.header) > _SHOWN else "")
        raise DataError(f"{at(path, line)}: no header names time, displacement or force (got {shown})")
    lacking = [q for q in (DISPLACEMENT, FORCE) if q not in columns]
    if any(not _candidates(file, columns, q) for q in lacking):
        what = f"without {' and '.join(q.name for q in lacking)} no damper: this file has {here}"
        telemetry = TIME in columns and FORCE in lacking and not _candidates(file, columns, FORCE)
        hint = ", as telemetry of a car has" if telemetry else ""
        if lacking == [DISPLACEMENT] and VELOCITY in columns:
            hint = "; write the integral of the velocity beside it, each cycle about its middle, in a column of its own"
        raise DataError(f"{at(path, line)}: {what}{hint}")
    return file


_KEYED = re.compile(r"[A-Za-z_]\w*\s*[:=]\s*[-+]?[\d.]+([eE][-+]?\d+)?")
"""A cell as the plotter of Arduino takes them: `pos:1.25`."""

# --- What a file is that holds no test of a damper ---

_FREQUENCY = re.compile(r"freq|^f ?[\[(]|hertz|terz|third|octave|\bHz\b", re.IGNORECASE)
"""Headers of a column of frequencies."""


def _no_test_of_a_damper(file: SniffedFile, columns: dict[Quantity, str]) -> str | None:
    """Say what a file is that holds no recording of force and displacement, and what reads it; None where it may."""
    heads = [head for head in file.dialect.header if head.strip()]
    if TIME not in columns and _FREQUENCY.search(heads[0]) and columns.get(FORCE, heads[0]) == heads[0]:
        return "levels over frequency, as of third octaves, and no recording over time: a test of a damper is needed"
    both_ways = all(any(pattern.search(head) for head in heads) for pattern in DIRECTIONS.values())
    forces = 2 if both_ways and FORCE not in columns else int(FORCE in columns)
    timeless = VELOCITY in columns and not {TIME, DISPLACEMENT} & set(columns)
    if timeless and forces and len(heads) <= len({*columns} - {FORCE}) + forces + 1:
        curve = "a curve of force over velocity, and no recording over time: in place of a rig take it by damper: "
        path = file.path.as_posix()
        if both_ways:
            return f"{curve}{{curve: {path}}}"
        return f"{curve}{{curve: {path}, sign: 1}}, or sign: -1 where positive velocities compress"
    accelerations = [
        head
        for head in heads
        if unit_of(_accelerated(head), file.unit_below(head, ACCELERATION), ACCELERATION) is not None
    ]
    if accelerations and FORCE not in columns and DISPLACEMENT not in columns:
        return "accelerations of a ride, and no test of a damper: pzd rate rates them"
    return None


def _accelerated(head: str) -> str:
    """Return a header with g as the acceleration of gravity, which elsewhere is a gram."""
    return re.sub(r"[\[(]\s*g\s*[\])]\s*$", "[standard_gravity]", head)


def _by_values(file: SniffedFile) -> dict[Quantity, str]:
    """Tell the clock of a table without headers: the one column that rises evenly."""
    sheet = read_sheet(file.path, _as_sniffed(file), Wanted(numbers=frozenset(file.dialect.header)), "rig.files")
    rising = [
        sheet.header[column]
        for column, values in sheet.numbers.items()
        if values.size > 2 and np.all(np.diff(values) > 0.0) and np.ptp(np.diff(values)) < 0.5 * np.diff(values).mean()
    ]
    return {TIME: rising[0]} if rising else {}


def _ranges(file: SniffedFile) -> Iterator[str]:
    """Write the range of every column of a table without headers, so that one sees which is which."""
    sheet = read_sheet(file.path, _as_sniffed(file), Wanted(numbers=frozenset(file.dialect.header)), "rig.files")
    for column, values in sheet.numbers.items():
        if not np.isfinite(values).any():
            continue
        turns = int(np.count_nonzero(np.diff(np.sign(np.diff(values))) != 0))
        course = "rises evenly" if turns == 0 and values[-1] > values[0] else f"turns {turns} times"
        yield f"# {sheet.header[column]}: {np.nanmin(values):.4g} to {np.nanmax(values):.4g}, {course}"
