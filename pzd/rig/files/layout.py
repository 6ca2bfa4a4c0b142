"""Layout of a rig file: header, unit and sign of each quantity, or its value, by the config or a layout with a name.

Known before any file is opened: it names the columns to read, and `channels` takes them from there.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from pzd.quantities import CHANNELS, DISPLACEMENT, FORCE, PRESSURE, TEMPERATURE, TIME, VOLTAGE, Control, Quantity
from pzd.rig.config import FilesEntry, NamedLayout
from pzd.rig.files.sheet import LIKE_A_CLOCK, Wanted
from pzd.rig.files.units import UnitError, constant
from pzd.schema.errors import ConfigError
from pzd.schema.model import nearest
from pzd.schema.yamlfile import read_yaml

Value = TypeVar("Value")
Values = dict[Quantity, tuple[float, ...]]
"""Values of quantities without a column: one for the file, or one for each test in it."""

NEEDED = (TIME, DISPLACEMENT, FORCE)
"""Quantities that a file must have."""
LABELS = (VOLTAGE, TEMPERATURE, PRESSURE)
"""Quantities that a constant or the name of the file may give."""
_BEFORE_MINUS = re.compile(r"(?:^|[^A-Za-z0-9])(?:T|temp|temperature?|U|V|volt|voltage|I|current)?$", re.IGNORECASE)
"""What stands before a minus; after any other word a dash joins."""
_NAMES_UNIT = re.compile(r"\d\s*[A-Za-z%\u00b0\u00b5]+$")
"""A number with its unit, which goes before that of the config: 500mA."""
ALSO_READ = {TEMPERATURE: "temperature_C"}
"""Second headers that are read without being named."""


@dataclass(frozen=True)
class ChannelSpec:
    """Specification of one quantity in the config."""

    quantity: Quantity
    """Canonical quantity; `VOLTAGE` for the control signal."""
    own: Quantity
    """Quantity as this rig calls it: the control signal under its own name and unit."""
    named: str | None
    """Header in the config; empty where no column is to be read."""
    unit: str | None
    """Unit in the config; for time also a format of date and time."""
    sign: int
    canonical_headers: tuple[str, ...]
    """Headers that are read without being named; their unit is known."""
    headers: tuple[str, ...]
    """Headers of this quantity in a file."""
    sign_given: bool
    """Whether the config gives a sign, be it 1."""
    dated: bool
    """Whether the unit in the config is a format of dates and times."""


@dataclass(frozen=True)
class Layout:
    """Entry of the config as one specification for each quantity."""

    entry: FilesEntry
    place: str
    """Place of the entry in the config."""
    control: Control
    channels: tuple[ChannelSpec, ...]
    """One for each canonical quantity, in the order of `CHANNELS`."""

    def wanted(self) -> Wanted:
        """Return the columns to read."""
        split = self.entry.split
        texts = {header for spec in self.channels if spec.dated for header in spec.headers}
        texts |= {header for header in (split.column, split.event) if header} if split else set()
        known = {header for spec in self.channels for header in spec.canonical_headers}
        return Wanted(
            known=frozenset(known | set(self.entry.columns.values())),
            numbers=frozenset(h for spec in self.channels if not spec.dated for h in spec.headers),
            texts=frozenset(texts),
            beside=None if self.entry.rate_Hz is None else LIKE_A_CLOCK,
            needed=tuple(frozenset(spec.headers) for spec in self.channels if spec.quantity in NEEDED),
            held=frozenset(header for spec in self._labels() for header in spec.headers),
            quantities={header: spec.own.name for spec in self.channels for header in spec.headers},
        )

    def values(self, path: Path) -> tuple[Values, str | None]:
        """Return the values in constants and the file's name (one, or one for each test), and the setting.

        Raises
        ------
        ConfigError : when a value has no unit or a wrong one, or the name does not match the pattern
        """
        faults: list[str] = []
        values: Values = {}
        entry, place, setting = self.entry, self.place, self.entry.setting
        for spec in self._labels():
            given = _lookup(entry.constants, spec.own, spec.quantity)
            if given is not None:
                values[spec.quantity] = (_constant(given, spec, f"{place}.constants", faults),)
            many = _lookup(entry.split.constants, spec.own, spec.quantity) if entry.split else None
            if many is not None:
                at_place = f"{place}.split.constants"
                values[spec.quantity] = tuple(_constant(text, spec, at_place, faults) for text in many)
        if entry.pattern is not None:
            match = re.search(entry.pattern, path.stem) or re.search(entry.pattern, path.name)
            if match is None:
                faults.append(f"{place}.pattern: the file's name does not match {entry.pattern!r} (got {path.name})")
            else:
                faults += self._misfit(path.stem if re.search(entry.pattern, path.stem) else path.name, path)
                groups = match.groupdict()
                setting = groups.pop("setting", None) or setting
                values |= self._from_groups(groups, "pattern", path, faults)
        if faults:
            raise ConfigError(faults)
        return values, setting

    def values_above(self, texts: Sequence[str], path: Path) -> tuple[Values, str | None]:
        """Return the values in the lines above the header of each table of a file, and the setting there.

        Parameters
        ----------
        texts : the lines above the header of each table that was read
        path : the file

        Raises
        ------
        ConfigError : when the lines do not match the preamble, or in several places
        """
        faults: list[str] = []
        of_tables: list[Values] = []
        settings: list[str | None] = []
        for text in texts:
            found = list(re.finditer(self.entry.preamble or "", text, re.MULTILINE))
            told = list(dict.fromkeys(" and ".join(filter(None, match.groups())) for match in found))
            if len(told) != 1:
                faults.append(f"{self.place}.preamble: {_preamble_misfit(told, text)} (got {path.name})")
                continue
            groups = found[0].groupdict()
            settings.append(groups.pop("setting", None))
            of_tables.append(self._from_groups(groups, "preamble", path, faults))
        if len({*settings}) > 1:
            faults.append(
                f"{self.place}.preamble: a file is of one setting; write each into a file of its own "
                f"(got {', '.join(map(str, settings))} in {path.name})"
            )
        if faults:
            raise ConfigError(list(dict.fromkeys(faults)))
        quantities = list(dict.fromkeys(quantity for values in of_tables for quantity in values))
        return {q: tuple(number for values in of_tables for number in values[q]) for q in quantities}, settings[0]

    def _labels(self) -> list[ChannelSpec]:
        return [spec for spec in self.channels if spec.quantity in LABELS]

    def _misfit(self, name: str, path: Path) -> list[str]:
        """Describe a pattern that fits the file's name in several places, or leaves out a minus."""
        found = list(re.finditer(self.entry.pattern or "", name))
        values = list(dict.fromkeys(", ".join(filter(None, match.groups())) for match in found))
        if len(values) > 1:
            places = f"{len(values)} places ({' and '.join(values)})"
            remedy = f"add what stands around the right one (got {path.name})"
            return [f"{self.place}.pattern: the file's name fits in {places}; {remedy}"]
        spans = {group: found[0].span(group) for group in found[0].re.groupindex if group != "setting"}
        faults = []
        for group, (first, last) in spans.items():
            whole = _whole_number(name, first, last)
            if whole != name[first:last]:
                take = f"let the group take all of it, e.g. (?P<{group}>-?[0-9.,xp]+)"
                faults.append(
                    f"{self.place}.pattern: {group}: only {name[first:last]} of the number {whole} is taken; {take} "
                    f"(got {path.name})"
                )
            elif minus_before(name, first) and f"-(?P<{group}>" not in (self.entry.pattern or ""):
                faults.append(
                    f"{self.place}.pattern: {group}: the minus in front of a number is left out; write -? in the "
                    f"group, or -(?P<{group}>...) if it is a dash (got {path.name})"
                )
        return faults

    def _from_groups(self, groups: dict[str, str | None], key: str, path: Path, faults: list[str]) -> Values:
        """Return the values that the groups of `pattern` or `preamble` found."""
        values: Values = {}
        for spec in self._labels():
            text, own = _lookup(groups, spec.own, spec.quantity), spec.own
            if text is None:
                continue
            number, unit = number_in_name(text), "" if _NAMES_UNIT.search(text) else spec.unit
            if unit is None:
                what = "the file's name has" if key == "pattern" else "the lines above the header have"
                faults.append(f"{self.place}.units: {own.name}: {what} no unit; say {own.name}: {own.unit}")
                continue
            at_place = f"{self.place}.{key}: {path.name}"
            values[spec.quantity] = (_constant(f"{number} {unit}".rstrip(), spec, at_place, faults),)
        return values


def _preamble_misfit(told: Sequence[str], text: str) -> str:
    """Say in how many places the lines above a header match, or none of them, and what to do."""
    if told:
        places = f"{len(told)} places ({' and '.join(told)})"
        return f"the lines above the header match it in {places}; add what stands before the right one"
    first = next((line.strip() for line in text.split("\n") if any(c.isdigit() for c in line)), None)
    if first is None:
        return "no line above the header holds a number; where one does, say skip: N for so many lines"
    return f"none of the lines above the header matches it; write it after one of them, as {first!r}"


def _whole_number(name: str, first: int, last: int) -> str:
    """Return the number in a name of which a stretch is part, digits behind a decimal sign included."""
    if first < 0 or not name[first:last].strip("-"):
        return name[max(first, 0) : max(last, 0)]
    before = re.search(r"(?:\d+[.,xp]|\d+)?$", name[:first]) if name[first].isdigit() else None
    after = re.match(r"\d*(?:[.,xp]\d+)?", name[last:]) if name[last - 1].isdigit() else None
    return (before[0] if before else "") + name[first:last] + (after[0] if after else "")


def number_in_name(text: str) -> str:
    """Return a number as it stands in a name with a decimal point: 0x5, 0p5, 0_5 or 0,5 is 0.5."""
    return re.sub(r"(?<=\d)[xp,_-](?=\d)", ".", text)


def minus_before(name: str, first: int) -> bool:
    """Whether a minus stands before a number: after a symbol, as in T-20C, or after what is no word, as in a_-20C."""
    return first > 0 and name[first - 1] == "-" and bool(_BEFORE_MINUS.search(name[: first - 1]))


def layouts(entries: Sequence[FilesEntry], control: Control, folder: Path) -> tuple[Layout, ...]:
    """Make the layout of every entry of `rig.files`, each checked: its keys name quantities, no two give the same.

    Parameters
    ----------
    entries : `rig.files` of the config
    control : the control signal
    folder : the config's folder, where named layouts may lie

    Raises
    ------
    ConfigError : with every wrong key of an entry
    """
    return tuple(_layout(entry, f"rig.files.{number}", control, folder) for number, entry in enumerate(entries))


def own_quantity(quantity: Quantity, control: Control) -> Quantity:
    """Return the quantity as this rig calls it: the control signal under its own name and unit."""
    return control.quantity if quantity is VOLTAGE else quantity


def _layout(entry: FilesEntry, place: str, control: Control, folder: Path) -> Layout:
    if entry.layout is not None:
        named = named_layout(entry.layout, folder, f"{place}.layout")
        theirs = named.control.signal()
        if theirs not in (Control(), control):
            raise ConfigError(
                f"{place}.layout: files of this layout record a {theirs.name}; say at the top of the config "
                f"control: {{name: {theirs.name}, unit: {theirs.unit}}} (got {entry.layout!r})"
            )
        entry = with_layout(entry, named)
    in_columns = (quantity for quantity in CHANNELS if quantity is not TIME or entry.rate_Hz is None)
    layout = Layout(entry, place, control, tuple(_spec(quantity, entry, control) for quantity in in_columns))
    faults = _faults(layout)
    if faults:
        raise ConfigError(faults)
    return layout


def _spec(quantity: Quantity, entry: FilesEntry, control: Control) -> ChannelSpec:
    own = own_quantity(quantity, control)
    named, unit = _lookup(entry.columns, own, quantity), _lookup(entry.units, own, quantity)
    also = ALSO_READ.get(quantity)
    canonical = (own.column,) if also is None else (own.column, also)
    headers = canonical if named is None else (named.strip(),) if named.strip() else ()
    dated = quantity is TIME and unit is not None and "%" in unit
    sign = _lookup(entry.sign, own, quantity)
    return ChannelSpec(quantity, own, named, unit, sign or 1, canonical, headers, sign is not None, dated)


def _faults(layout: Layout) -> list[str]:
    entry, place, control = layout.entry, layout.place, layout.control
    faults: list[str] = []
    for field, allowed in (("columns", CHANNELS), ("units", CHANNELS), ("sign", CHANNELS), ("constants", LABELS)):
        given: Mapping[str, object] = getattr(entry, field)
        faults += _wrong(f"{place}.{field}", given, allowed, control)
    by_text = {key: re.compile(getattr(entry, key) or "").groupindex for key in ("pattern", "preamble")}
    for key, groups in by_text.items():
        faults += _wrong(f"{place}.{key}", [g for g in groups if g != "setting"], LABELS, control)
    a_test = entry.split.constants if entry.split else {}
    faults += _wrong(f"{place}.split.constants", a_test, LABELS, control)
    given_by: dict[str, Iterable[str]] = {
        "columns": entry.columns,
        "constants": entry.constants,
        "split.constants": a_test,
        **by_text,
    }
    for spec in layout.channels:
        ways = [field for field, keys in given_by.items() if spec.own.name in keys or spec.quantity.name in keys]
        ways = [field for field in ways if field != "columns" or spec.headers]
        if spec.quantity in LABELS and len(ways) > 1:
            faults.append(f"{place}: {spec.own.name}: said twice, under {' and '.join(ways)}")
    if entry.rate_Hz is not None and entry.columns.get(TIME.name, " "):
        twice = [field for field in ("columns", "units", "sign") if TIME.name in getattr(entry, field)]
        faults += [f"{place}: time: said twice, under rate_Hz and {field}" for field in twice]
    named = ["setting"] if entry.setting is not None else []
    named += [key for key, groups in by_text.items() if "setting" in groups]
    if len(named) > 1:
        faults.append(f"{place}: setting: said twice, under {' and '.join(named)}")
    return faults


def _lookup(given: Mapping[str, Value], own: Quantity, quantity: Quantity) -> Value | None:
    """Look up a quantity in a mapping of the config, the control signal by either of its names."""
    return given.get(own.name, given.get(quantity.name))


def _constant(text: str, spec: ChannelSpec, place: str, faults: list[str]) -> float:
    try:
        return constant(text, spec.own)
    except UnitError as fault:
        faults.append(f"{place}: {fault} (got {text!r})")
        return 0.0


def _wrong(place: str, given: Iterable[str], allowed: tuple[Quantity, ...], control: Control) -> list[str]:
    names = list(dict.fromkeys([own_quantity(q, control).name for q in allowed] + [q.name for q in allowed]))
    faults = []
    for key in given:
        if key not in names:
            near = nearest(key, names)
            hint = f"did you mean {near}?" if near else f"one of {', '.join(names)} is needed"
            faults.append(f"{place}: {key}: {hint} (got {key!r})")
    if VOLTAGE.name in given and control.name in given and control.name != VOLTAGE.name:
        faults.append(f"{place}: {control.name}: the control signal is named twice (also as {VOLTAGE.name})")
    return faults


# --- Layouts by name ---

SHIPPED = Path(__file__).with_name("layouts")
"""Folder of the layouts that come with pzd, one YAML file each."""
_OWN = ("path", "layout", "source")
"""Keys of an entry that no layout gives."""
_ABOUT = re.compile(rb"^about:", re.MULTILINE)
"""Key of every layout, by which it differs from other YAML files beside it."""


def all_layouts(folder: Path) -> dict[str, NamedLayout]:
    """Read every layout: those that come with pzd, and over them the YAML files of a folder that are layouts.

    Parameters
    ----------
    folder : of layouts of the user

    Raises
    ------
    ConfigError : when one of them is wrong
    """
    files = [path for place in (SHIPPED, folder) for path in sorted(place.glob("*.yaml"))]
    return {path.stem: read_layout(path) for path in files if _ABOUT.search(path.read_bytes())}


def named_layout(name: str, folder: Path, place: str) -> NamedLayout:
    """Read the layout of a name.

    Parameters
    ----------
    name : of the layout
    folder : the config's folder
    place : of the name in the config

    Raises
    ------
    ConfigError : when there is none, or its file is wrong
    """
    path = layout_file(name, folder)
    if path is None:
        shipped = [file.stem for file in sorted(SHIPPED.glob("*.yaml"))]
        near = nearest(name, shipped)
        hint = f"did you mean {near}?" if near else f"there are {', '.join(shipped)}"
        raise ConfigError(f"{place}: no such layout, here or as {name}.yaml beside the config; {hint} (got {name!r})")
    return read_layout(path)


def layout_file(name: str, folder: Path) -> Path | None:
    """Find the file of a layout: beside the config, else the one that comes with pzd; None where there is none."""
    places = (folder / f"{name}.yaml", SHIPPED / f"{name}.yaml")
    return next((path for path in places if path.is_file()), None)


def read_layout(path: Path) -> NamedLayout:
    """Read the layout that a file describes.

    Raises
    ------
    ConfigError : when it is wrong, with every place
    """
    return read_yaml(path).validated(NamedLayout, Control())


def with_layout(entry: FilesEntry, layout: NamedLayout) -> FilesEntry:
    """Complete an entry by its layout; the keys of the entry take precedence."""
    completed: dict[str, object] = {}
    for name, field in FilesEntry.model_fields.items():
        ours, theirs = getattr(entry, name), getattr(layout, name)
        if name in _OWN:
            continue
        if isinstance(theirs, dict):  # quantities, each by itself
            completed[name] = {**theirs, **ours}
        elif ours == field.default:
            completed[name] = theirs
    return entry.model_copy(update=completed)
