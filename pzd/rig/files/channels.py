"""What an entry of the config says about each quantity: where it stands, its unit, its sign."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from pzd.quantities import CHANNELS, DISPLACEMENT, FORCE, PRESSURE, TEMPERATURE, TIME, VOLTAGE, Control, Quantity
from pzd.rig.config import FilesEntry
from pzd.rig.files.sheet import Sheet
from pzd.rig.files.units import UnitError, constant, in_header
from pzd.schema.errors import ConfigError, DataError, at
from pzd.schema.nearest import nearest

Value = TypeVar("Value")
Values = dict[Quantity, tuple[float, ...]]
"""Values that no column holds: one for the file, or one for each test in it."""

NEEDED = (TIME, DISPLACEMENT, FORCE)
"""Quantities that a file must have."""
LABELS = (VOLTAGE, TEMPERATURE, PRESSURE)
"""Quantities that a constant or the file's name may give."""
ALSO_READ = {TEMPERATURE: "temperature_C"}
"""Other headers that are read without being named."""


@dataclass(frozen=True)
class Source:
    """Where one quantity stands in a file."""

    quantity: Quantity
    """The canonical quantity; the control signal stands under `VOLTAGE`."""
    column: int
    unit: str
    sign: int


def own(quantity: Quantity, control: Control) -> Quantity:
    """The quantity as this rig calls it: the control signal under its own name and unit."""
    return control.quantity if quantity is VOLTAGE else quantity


def check_keys(entry: FilesEntry, place: str, control: Control) -> None:
    """Check that every key of an entry names a quantity, and that no two say the same.

    Raises
    ------
    ConfigError : with every wrong key
    """
    faults: list[str] = []
    for field, allowed in (("columns", CHANNELS), ("units", CHANNELS), ("sign", CHANNELS), ("constants", LABELS)):
        given: Mapping[str, object] = getattr(entry, field)
        faults += _wrong(f"{place}.{field}", given, allowed, control)
    groups = re.compile(entry.pattern).groupindex if entry.pattern else {}
    faults += _wrong(f"{place}.pattern", [g for g in groups if g != "setting"], LABELS, control)
    a_test = entry.split.constants if entry.split else {}
    faults += _wrong(f"{place}.split.constants", a_test, LABELS, control)
    said_by: dict[str, Iterable[str]] = {
        "columns": entry.columns,
        "constants": entry.constants,
        "split.constants": a_test,
        "pattern": groups,
    }
    for quantity in LABELS:
        ways = [field for field, keys in said_by.items() if _named(keys, quantity, control)]
        if len(ways) > 1:
            faults.append(f"{place}: {own(quantity, control).name}: said twice, under {' and '.join(ways)}")
    if "setting" in groups and entry.setting is not None:
        faults.append(f"{place}: setting: said twice, under setting and pattern")
    if faults:
        raise ConfigError(faults)


def of(given: Mapping[str, Value], quantity: Quantity, control: Control) -> Value | None:
    """What a mapping of the config says about a quantity, by its name or, for the control, by either name."""
    own_name = own(quantity, control).name
    return given.get(own_name, given.get(quantity.name))


def sources(sheet: Sheet, entry: FilesEntry, place: str, control: Control) -> tuple[Source, ...]:
    """The columns that a file has for each quantity.

    Raises
    ------
    DataError : when a column is missing or stands there twice
    ConfigError : when nothing says the unit of a column
    """
    found: list[Source] = []
    data_faults: list[str] = []
    config_faults: list[str] = []
    for quantity in CHANNELS:
        named = of(entry.columns, quantity, control)
        columns = _columns(sheet, named, quantity, control)
        if len(columns) > 1:
            heads = " and ".join(sheet.header[c] for c in columns)
            data_faults.append(f"{_top(sheet)}: {own(quantity, control).name}: duplicate column ({heads})")
        elif columns:
            unit = _unit(sheet, columns[0], entry, own(quantity, control), control)
            if unit is None:
                config_faults.append(_no_unit(sheet, columns[0], place, own(quantity, control)))
            else:
                found.append(Source(quantity, columns[0], unit, of(entry.sign, quantity, control) or 1))
        elif named is not None or quantity in NEEDED:
            data_faults.append(_missing(sheet, named, own(quantity, control), place))
    if config_faults:
        raise ConfigError(config_faults)
    if data_faults:
        raise DataError(data_faults)
    return tuple(found)


def said(entry: FilesEntry, place: str, control: Control, path: Path) -> tuple[Values, str | None]:
    """Values that constants and the file's name give (one, or one a test), and the setting.

    Raises
    ------
    ConfigError : when a value has no unit or a wrong one, or the name does not match the pattern
    """
    faults: list[str] = []
    values: Values = {}
    setting = entry.setting
    for quantity in LABELS:
        given = of(entry.constants, quantity, control)
        if given is not None:
            values[quantity] = (_constant(given, quantity, control, f"{place}.constants", faults),)
        many = of(entry.split.constants, quantity, control) if entry.split else None
        if many is not None:
            values[quantity] = tuple(_constant(t, quantity, control, f"{place}.split.constants", faults) for t in many)
    if entry.pattern is not None:
        match = re.search(entry.pattern, path.stem) or re.search(entry.pattern, path.name)
        if match is None:
            faults.append(f"{place}.pattern: the file's name does not match {entry.pattern!r} (got {path.name})")
        else:
            groups = match.groupdict()
            setting = groups.pop("setting", None) or setting
            values |= _from_name(groups, entry, place, control, path, faults)
    if faults:
        raise ConfigError(faults)
    return values, setting


def _from_name(
    groups: dict[str, str | None], entry: FilesEntry, place: str, control: Control, path: Path, faults: list[str]
) -> Values:
    values: Values = {}
    for quantity in LABELS:
        text = of(groups, quantity, control)
        unit = of(entry.units, quantity, control)
        if text is None:
            continue
        if unit is None:
            mine = own(quantity, control)
            faults.append(f"{place}.units: {mine.name}: the file's name has no unit; say {mine.name}: {mine.unit}")
            continue
        number = text.replace("x", ".").replace(",", ".")
        values[quantity] = (_constant(f"{number} {unit}", quantity, control, f"{place}.pattern: {path.name}", faults),)
    return values


def _named(keys: Iterable[str], quantity: Quantity, control: Control) -> bool:
    return own(quantity, control).name in keys or quantity.name in keys


def _constant(text: str, quantity: Quantity, control: Control, place: str, faults: list[str]) -> float:
    try:
        return constant(text, own(quantity, control))
    except UnitError as fault:
        faults.append(f"{place}: {fault} (got {text!r})")
        return 0.0


def _wrong(place: str, given: Iterable[str], allowed: tuple[Quantity, ...], control: Control) -> list[str]:
    names = list(dict.fromkeys([own(q, control).name for q in allowed] + [q.name for q in allowed]))
    faults = []
    for key in given:
        if key not in names:
            near = nearest(key, names)
            hint = f"did you mean {near}?" if near else f"one of {', '.join(names)} is needed"
            faults.append(f"{place}: {key}: {hint} (got {key!r})")
    if VOLTAGE.name in given and control.name in given and control.name != VOLTAGE.name:
        faults.append(f"{place}: {control.name}: the control signal is named twice (also as {VOLTAGE.name})")
    return faults


def _columns(sheet: Sheet, named: str | None, quantity: Quantity, control: Control) -> list[int]:
    heads = [named.strip()] if named is not None else [own(quantity, control).column, ALSO_READ.get(quantity)]
    return [index for index, head in enumerate(sheet.header) if head in heads]


def _unit(sheet: Sheet, column: int, entry: FilesEntry, quantity: Quantity, control: Control) -> str | None:
    """The unit that the config says, then the file's own row of units, then its header."""
    canonical = VOLTAGE if quantity == control.quantity else quantity
    given = of(entry.units, canonical, control)
    if given is not None:
        return given
    if sheet.units is not None and sheet.units[column]:
        return sheet.units[column].strip("[]() ")
    header = sheet.header[column]
    return quantity.unit if header in (quantity.column, ALSO_READ.get(quantity)) else in_header(header, quantity)


def _no_unit(sheet: Sheet, column: int, place: str, quantity: Quantity) -> str:
    return (
        f"{place}.units: {quantity.name}: the header {sheet.header[column]!r} of {sheet.path} names no unit; "
        f"say it, e.g. units: {{{quantity.name}: {quantity.unit}}}"
    )


def _missing(sheet: Sheet, named: str | None, quantity: Quantity, place: str) -> str:
    wanted = named or quantity.column
    near = nearest(wanted, sheet.header) or next((h for h in sheet.header if quantity.name in h.lower()), None)
    hint = f"; is it {near!r}? then say {place}.columns: {{{quantity.name}: {near}}}" if near else ""
    return f"{_top(sheet)}: missing column {wanted}{hint} (got {', '.join(sheet.header)})"


def _top(sheet: Sheet) -> str:
    return at(sheet.path, sheet.header_line)
