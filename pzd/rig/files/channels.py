"""The columns of a sheet as channels in SI: which column is which quantity, its unit, its sign."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pzd.artefacts import Finding
from pzd.quantities import ACCELERATION, DISPLACEMENT, FORCE, PRESSURE, TEMPERATURE, TIME, VELOCITY, VOLTAGE, Quantity
from pzd.record import Array
from pzd.rig.files.layout import LABELS, NEEDED, ChannelSpec, Layout
from pzd.rig.files.sheet import ReadingStep, Sheet
from pzd.rig.files.units import UnitError, in_header, to_canonical
from pzd.schema.errors import ConfigError, DataError
from pzd.schema.nearest import nearest

COMPRESSION = re.compile(r"compr|druckkraft|einfed|einschub", re.IGNORECASE)
"""Words of a header that counts compression positive."""
OPTIONAL = (VELOCITY, ACCELERATION, VOLTAGE, TEMPERATURE, PRESSURE)
"""Quantities whose column may be wholly empty, which counts as absent."""


HALF_DAY = 43200.0
"""Twelve hours [s]."""
_DATES = ("%d", "%j", "%x", "%c", "%D", "%F")
"""Codes of a format that tells one day from the next."""
ROUNDING = 1e-9
"""A control signal, temperature or pressure that varies by less, relative to itself or to one unit, is constant."""


@dataclass(frozen=True, eq=False)
class Channels:
    """The channels of one file, in SI and degC; where cells are at fault, of them the clock alone, as recorded."""

    values: dict[Quantity, Array]
    """Canonical quantity -> (rows,); the control signal under `VOLTAGE`."""
    faults: tuple[str, ...] = ()
    """Cells that are bad or empty, each with its line."""
    remarks: tuple[Finding, ...] = ()
    """What the file itself says otherwise than the config."""
    steps: tuple[ReadingStep, ...] = ()
    """What was renamed, converted and turned."""


@dataclass(frozen=True)
class _Source:
    """Where one quantity stands in a sheet."""

    spec: ChannelSpec
    column: int
    unit: str

    @property
    def dated(self) -> bool:
        """Whether the cells are dates and times."""
        return self.spec.dated or (self.spec.quantity is TIME and "%S" in self.unit)


def channels(sheet: Sheet, layout: Layout) -> Channels:
    """The channels that a sheet holds.

    Parameters
    ----------
    sheet : the file as its reader gives it
    layout : what the config says about each quantity

    Raises
    ------
    DataError : when a column is missing or occurs twice, or a cell is no date
    ConfigError : when nothing says the unit of a column, or the unit is none of the quantity
    """
    found = _sources(sheet, layout)
    bad = [fault for source in found for fault in sheet.faults.get(source.column, [])]
    if bad:
        return Channels(_clock(sheet, layout, found), tuple(bad))
    values = {source.spec.quantity: _instants(sheet, source) for source in found if source.dated}
    values |= _counted(sheet, layout)
    faults: list[str] = []
    for source in found:
        if source.dated:
            continue
        cells = sheet.numbers[source.column]
        empty = np.flatnonzero(np.isnan(cells))
        if empty.size == cells.size and source.spec.quantity in OPTIONAL:
            continue
        if empty.size:
            more = f" ({empty.size} such cells)" if empty.size > 1 else ""
            faults.append(f"{sheet.place(int(empty[0]))}: {sheet.header[source.column]}: empty cell{more}")
            continue
        try:
            channel = source.spec.sign * to_canonical(cells, source.unit, source.spec.own)
        except UnitError as fault:
            raise ConfigError(f"{layout.place}.units: {fault} (in {sheet.path})") from None
        values[source.spec.quantity] = _steady(channel) if source.spec.quantity in LABELS else channel
    if faults:
        return Channels(_clock(sheet, layout, found), tuple(faults))
    steps = (*_steps(sheet, found, values), *_counting(layout))
    return Channels(values, remarks=_remarks(sheet, found), steps=steps)


def _steps(sheet: Sheet, found: list[_Source], values: dict[Quantity, Array]) -> Iterator[ReadingStep]:
    """What was done to each column; nothing for one that stands there as it is handed on."""
    for source in found:
        spec, own, head = source.spec, source.spec.own, sheet.header[source.column]
        if spec.quantity not in values:
            yield ReadingStep("left out", own.name, f"column {head!r}", "every cell is empty")
            continue
        if head != own.column:
            yield ReadingStep("rename", own.name, f"column {head!r}", own.column)
        if source.dated:
            yield ReadingStep("unit", own.name, f"dates and times like {source.unit}", "s since the first")
        elif source.unit != own.unit:
            zero, one = to_canonical(np.array([0.0, 1.0]), source.unit, own)
            offset = f" {zero:+.10g}" if zero else ""
            if offset or one != 1.0:
                yield ReadingStep("unit", own.name, source.unit, f"{own.unit}: times {one - zero:.10g}{offset}")
        if spec.sign < 0:
            yield ReadingStep("sign", own.name, "as recorded", "times -1")


def _remarks(sheet: Sheet, found: list[_Source]) -> tuple[Finding, ...]:
    """Headers that name another unit or another sign than the one the channel was read with."""
    remarks: list[Finding] = []
    for source in found:
        spec, header = source.spec, sheet.header[source.column]
        for told, ratio in _other_units(source, sheet):
            said = "the config says" if spec.unit is not None else "the file says beside it"
            remarks.append(
                Finding(
                    check="units",
                    where=f"{spec.own.name}, whose header is {header!r}{told}; {said} {source.unit}",
                    size=ratio,
                    unit="-",
                    follows=f"{source.unit} was taken; by the other the channel would be this many times as large",
                )
            )
        if spec.quantity in (DISPLACEMENT, FORCE) and not spec.sign_said and COMPRESSION.search(header):
            remarks.append(
                Finding(
                    check="sign",
                    where=f"{spec.own.name}, whose header is {header!r}",
                    size=float(spec.sign),
                    unit="-",
                    follows=f"extension is positive: say sign: {{{spec.own.name}: -1}}, or 1 if it is so already",
                )
            )
    return tuple(remarks)


def _other_units(source: _Source, sheet: Sheet) -> Iterator[tuple[str, float]]:
    """How many times as large a channel would be by another unit that the file names, in its header or beside it."""
    spec, header = source.spec, sheet.header[source.column]
    if source.dated or spec.quantity is TEMPERATURE:
        return
    inside = spec.own.unit if header in spec.canonical_headers else in_header(header, spec.own)
    beside = sheet.units[source.column].strip("[]() ") if sheet.units else ""
    for told, shown in ((inside, ""), (beside, f" and its unit {beside!r}")):
        try:
            theirs, ours = (
                float(to_canonical(np.ones(1), unit, spec.own)[0]) for unit in (told or source.unit, source.unit)
            )
        except UnitError:
            continue
        if abs(theirs / ours - 1.0) > 1e-9:
            yield shown, theirs / ours


def _steady(channel: Array) -> Array:
    """A channel that varies by no more than rounding as the constant that it is."""
    middle = float(np.median(channel))
    constant = np.ptp(channel) <= ROUNDING * max(1.0, abs(middle))
    return np.full_like(channel, middle) if constant else channel


def _sources(sheet: Sheet, layout: Layout) -> list[_Source]:
    found: list[_Source] = []
    data_faults: list[str] = []
    config_faults: list[str] = []
    for spec in layout.channels:
        columns = [index for index, head in enumerate(sheet.header) if head in spec.headers]
        if len(columns) > 1:
            heads = " and ".join(sheet.header[c] for c in columns)
            data_faults.append(f"{sheet.top}: {spec.own.name}: duplicate column ({heads})")
        elif columns:
            unit = _unit(sheet, columns[0], spec)
            if unit is None:
                config_faults.append(_no_unit(sheet, columns[0], layout.place, spec.own))
            else:
                found.append(_Source(spec, columns[0], unit))
        elif spec.named or spec.quantity in NEEDED:
            data_faults.append(_missing(sheet, spec, layout.place))
    if config_faults:
        raise ConfigError(config_faults)
    if data_faults:
        raise DataError(data_faults)
    return found


def _unit(sheet: Sheet, column: int, spec: ChannelSpec) -> str | None:
    """The unit that the config says, then the file's own row of units, then its header."""
    if spec.unit is not None:
        return spec.unit
    if sheet.units is not None and sheet.units[column]:
        return sheet.units[column].strip("[]() ")
    header = sheet.header[column]
    return spec.own.unit if header in spec.canonical_headers else in_header(header, spec.own)


def _no_unit(sheet: Sheet, column: int, place: str, quantity: Quantity) -> str:
    return (
        f"{place}.units: {quantity.name}: the header {sheet.header[column]!r} of {sheet.path} names no unit; "
        f"say it, e.g. units: {{{quantity.name}: {quantity.unit}}}"
    )


def _missing(sheet: Sheet, spec: ChannelSpec, place: str) -> str:
    name, wanted = spec.own.name, spec.named or spec.own.column
    near = nearest(wanted, sheet.header) or next((h for h in sheet.header if name in h.lower()), None)
    hint = f"; is it {near!r}? then say {place}.columns: {{{name}: {near}}}" if near else ""
    if wanted in sheet.elsewhere:
        hint = (
            f"; it stands in table {sheet.elsewhere[wanted]!r}, which has another clock or length: export them as one"
        )
    return f"{sheet.top}: missing column {wanted}{hint} (got {', '.join(sheet.header)})"


def _counted(sheet: Sheet, layout: Layout) -> dict[Quantity, Array]:
    """The clock of files without a column of it, from 0 in every recording; nothing where a column holds it."""
    if layout.entry.rate_Hz is None:
        return {}
    rows = np.arange(sheet.rows, dtype=np.float64)
    begins = np.array(sheet.starts)[np.searchsorted(sheet.starts, rows, side="right") - 1]
    return {TIME: (rows - begins) / layout.entry.rate_Hz}


def _counting(layout: Layout) -> Iterator[ReadingStep]:
    """That samples were counted for the time."""
    if layout.entry.rate_Hz is not None:
        yield ReadingStep("clock", TIME.name, "no column", f"samples counted at {layout.entry.rate_Hz:.10g} Hz")


def _clock(sheet: Sheet, layout: Layout, found: list[_Source]) -> dict[Quantity, Array]:
    """The clock as it stands in the file; nothing where it holds dates or bad cells."""
    if layout.entry.rate_Hz is not None:
        return _counted(sheet, layout)
    (clock,) = (source for source in found if source.spec.quantity is TIME)
    return {} if clock.dated or clock.column in sheet.faults else {TIME: sheet.numbers[clock.column]}


def _instants(sheet: Sheet, source: _Source) -> Array:
    """Dates and times as seconds since the first."""
    import pandas as pd

    cells = sheet.texts[source.column]
    instants = pd.to_datetime(pd.Series(cells), format=source.unit, errors="coerce")
    bad = np.flatnonzero(instants.isna().to_numpy())
    if bad.size:
        row = int(bad[0])
        more = f" ({bad.size} such cells)" if bad.size > 1 else ""
        raise DataError(
            f"{sheet.place(row)}: {sheet.header[source.column]}: "
            f"no date and time like {source.unit}{more} (got {cells[row]!r})"
        )
    seconds = np.asarray((instants - instants[0]).dt.total_seconds(), dtype=np.float64)
    if any(code in source.unit for code in _DATES):
        return seconds
    # A clock without a date begins anew at midnight, one of twelve hours without am and pm at noon too.
    turn = HALF_DAY if "%I" in source.unit and "%p" not in source.unit else 2.0 * HALF_DAY
    return seconds + turn * np.concatenate(([0.0], np.cumsum(np.diff(seconds) < -0.5 * turn)))
