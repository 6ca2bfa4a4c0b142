"""Channels of a file in SI: column, unit and sign of every quantity, tests cut apart, a known fixture taken out.

sheet -> channels -> tests as recorded -> damper alone
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pzd.artefacts import Finding
from pzd.quantities import ACCELERATION, DISPLACEMENT, FORCE, PRESSURE, TEMPERATURE, TIME, VELOCITY, VOLTAGE, Quantity
from pzd.record import Array
from pzd.rig.config import FileSplit, Fixture
from pzd.rig.files.layout import LABELS, NEEDED, ChannelSpec, Layout, Values
from pzd.rig.files.sheet import IN_STEP, NO_SAMPLE, ReadingStep, Sheet
from pzd.rig.files.units import UnitError, columns_under, factor_in, in_header, to_canonical
from pzd.schema.errors import ConfigError, DataError
from pzd.schema.model import nearest
from pzd.schema.yamltree import written
from pzd.signals.cycles import cycles
from pzd.signals.kinematics import kinematics

COMPRESSION = re.compile(r"compr|^\W*comp(?![a-z])|druckkraft|einfed|einschub", re.IGNORECASE)
"""Words in the header of a channel that counts compression positive; behind a name comp is what was compensated."""
OPTIONAL = (VELOCITY, ACCELERATION, VOLTAGE, TEMPERATURE, PRESSURE)
"""Quantities whose column may be wholly empty, which counts as absent."""
_NUMBER = re.compile(r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?")
HALF_DAY = 43200.0
"""Twelve hours [s]."""
_DATES = ("%d", "%j", "%x", "%c", "%D", "%F")
"""Codes of a time format that hold the date."""
ROUNDING = 1e-9
"""A control signal, temperature or pressure that varies by less, relative to itself or to one unit, is constant:
conversion of units leaves some 1e-16, and no sensor resolves 1e-9."""

SPARSE = 0.5
"""Share of filled cells up to which a control signal, temperature or pressure is one that was written now and then, and
holds between; with fewer empty cells some are missing."""
LARGEST = 1e15
"""Magnitude in SI above which a cell is no measurement: its square would still be a number, but of nothing."""


@dataclass(frozen=True, eq=False)
class Channels:
    """Channels of one file, in SI and degC; where cells are faulty, the clock alone, as recorded."""

    by_quantity: dict[Quantity, Array]
    """Canonical quantity -> (rows,); the control signal under `VOLTAGE`."""
    faults: tuple[str, ...] = ()
    """Cells that are bad or empty, each with its line."""
    remarks: tuple[Finding, ...] = ()
    """Contradictions between the file and the config."""
    steps: tuple[ReadingStep, ...] = ()
    """Columns renamed, converted and multiplied by a sign."""


@dataclass(frozen=True)
class _Source:
    """Column and unit of one quantity in a sheet."""

    spec: ChannelSpec
    column: int
    unit: str

    @property
    def dated(self) -> bool:
        """Whether the cells are dates and times."""
        return self.spec.dated or (self.spec.quantity is TIME and "%S" in self.unit)


def channels(sheet: Sheet, layout: Layout) -> Channels:
    """Take the channels from a sheet.

    Parameters
    ----------
    sheet : the file as its reader gives it
    layout : specification of each quantity

    Raises
    ------
    DataError : when a column is missing or occurs twice, or a cell is no date
    ConfigError : when a column has no unit, or the unit is of another quantity
    """
    found = _sources(sheet, layout)
    bad = [fault for source in found for fault in sheet.faults.get(source.column, [])]
    if bad:
        return Channels(_clock(sheet, layout, found), tuple(bad))
    values = {source.spec.quantity: instants(sheet, source.column, source.unit) for source in found if source.dated}
    if layout.entry.rate_Hz is not None:
        values |= _clock(sheet, layout, found)
    faults: list[str] = []
    held: dict[Quantity, int] = {}
    for source in found:
        if source.dated:
            continue
        quantity, cells = source.spec.quantity, sheet.numbers[source.column]
        if quantity in OPTIONAL and np.isnan(cells).all():
            continue
        if quantity in LABELS and _is_sparse(cells, sheet.starts):
            held[quantity] = int(np.count_nonzero(np.isfinite(cells)))
            cells = _held(cells)
        channel = _channel(sheet, layout, source, cells, faults)
        if channel is not None:
            values[quantity] = _steady(channel) if quantity in LABELS else channel
    if faults:
        return Channels(_clock(sheet, layout, found), tuple(faults))
    remarks, steps = tuple(_remarks(sheet, found)), tuple(_steps(sheet, layout, found, values, held))
    return Channels(values, remarks=remarks, steps=steps)


def _channel(sheet: Sheet, layout: Layout, source: _Source, cells: Array, faults: list[str]) -> Array | None:
    """Convert the cells of a column to SI; None, and a fault more, where one is empty or absurd."""
    head, own = sheet.header[source.column], source.spec.own
    empty = np.flatnonzero(np.isnan(cells))
    if empty.size:
        more = f" ({empty.size} such cells)" if empty.size > 1 else ""
        what_to_do = NO_SAMPLE if layout.entry.rate_Hz is None else IN_STEP
        faults.append(f"{sheet.place(int(empty[0]))}: {head}: empty cell{more}; {what_to_do}")
        return None
    try:
        channel = source.spec.sign * to_canonical(cells, source.unit, own)
    except UnitError as fault:
        raise ConfigError(f"{layout.place}.units: {fault} (in {sheet.path})") from None
    absurd = np.flatnonzero(np.abs(channel) > LARGEST)
    if absurd.size:
        more = f", and {absurd.size - 1} more such cells" if absurd.size > 1 else ""
        place = sheet.place(int(absurd[0]))
        faults.append(f"{place}: {head}: no {own.name} is so large (got {cells[absurd[0]]:g}{more})")
        return None
    return channel


def _steps(
    sheet: Sheet, layout: Layout, found: list[_Source], values: dict[Quantity, Array], held: dict[Quantity, int]
) -> Iterator[ReadingStep]:
    """Report what was done to each column, and that samples were counted for the time."""
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
            yield from _conversion(source.unit, own)
        if spec.quantity in held:
            every = f"{held[spec.quantity]} of {sheet.rows} cells filled"
            yield ReadingStep("value", own.name, every, "held from each to the next")
        if spec.sign < 0:
            yield ReadingStep("sign", own.name, "as recorded", "times -1")
    if layout.entry.rate_Hz is not None:
        yield ReadingStep("clock", TIME.name, "no column", f"samples counted at {layout.entry.rate_Hz:.10g} Hz")


def _conversion(unit: str, own: Quantity) -> Iterator[ReadingStep]:
    """Report a conversion that changes the numbers, by its factor and offset."""
    if " about the mean " in unit:
        yield ReadingStep("unit", own.name, unit, own.unit)
        return
    start, end = to_canonical(np.array([0.0, 1.0]), unit, own)
    offset = f" {start:+.10g}" if start else ""
    if offset or end != 1.0:
        yield ReadingStep("unit", own.name, unit, f"{own.unit}: times {end - start:.10g}{offset}")


def _is_sparse(cells: Array, starts: tuple[int, ...]) -> bool:
    """Whether a column (rows,) is written now and then alone, from the first row of every recording on."""
    filled = np.isfinite(cells)
    return bool(filled[list(starts)].all() and np.count_nonzero(filled) <= SPARSE * cells.size)


def _held(cells: Array) -> Array:
    """Return a column (rows,) with every empty cell that of the last one filled."""
    return np.asarray(cells[np.maximum.accumulate(np.where(np.isfinite(cells), np.arange(cells.size), 0))])


def _remarks(sheet: Sheet, found: list[_Source]) -> Iterator[Finding]:
    """Find headers that name another unit or another sign than the one the channel was read with."""
    for source in found:
        spec, header = source.spec, sheet.header[source.column]
        for beside, ratio in _other_units(source, sheet):
            origin = "the config says" if spec.unit is not None else "the file says beside it"
            yield Finding(
                check="units",
                where=f"{spec.own.name}, whose header is {header!r}{beside}; {origin} {source.unit}",
                size=ratio,
                unit="-",
                follows=f"{source.unit} was taken; by the other the channel would be this many times as large",
            )
        if spec.quantity in (DISPLACEMENT, FORCE) and not spec.sign_given and COMPRESSION.search(header):
            yield Finding(
                check="sign",
                where=f"{spec.own.name}, whose header is {header!r}",
                size=float(spec.sign),
                unit="-",
                follows=f"extension is positive: say sign: {{{spec.own.name}: -1}}, or 1 if it is so already",
            )


def _other_units(source: _Source, sheet: Sheet) -> Iterator[tuple[str, float]]:
    """Find other units that the file names, in the header or beside it, and the factor they would make."""
    spec, header = source.spec, sheet.header[source.column]
    if source.dated or spec.quantity is TEMPERATURE:
        return
    inside = spec.own.unit if header in spec.canonical_headers else in_header(header, spec.own)
    beside = sheet.units[source.column].strip("[]() ") if sheet.units else ""
    for unit, shown in ((inside, ""), (beside, f" and its unit {beside!r}")):
        try:
            pair = (unit or source.unit, source.unit)
            theirs, ours = (np.diff(to_canonical(np.arange(2.0), one, spec.own)) for one in pair)
        except UnitError:
            continue
        ratio = float(theirs[0]) / float(ours[0])
        if abs(ratio - 1.0) > 1e-9:
            yield shown, ratio


def _steady(channel: Array) -> Array:
    """Return a channel that varies by rounding alone as the constant that it is."""
    middle = float(np.median(channel))
    constant = np.ptp(channel) <= ROUNDING * max(1.0, abs(middle))
    return np.full_like(channel, middle) if constant else channel


def _sources(sheet: Sheet, layout: Layout) -> list[_Source]:
    found: list[_Source] = []
    data_faults: list[str] = []
    config_faults: list[str] = []
    for spec in layout.channels:
        heads_there = [head for head in dict.fromkeys(sheet.header) if head in spec.headers]
        columns = [c for head in heads_there for c in columns_under(head, sheet.header, sheet.units, spec.own)]
        if len(columns) > 1:
            heads = " and ".join(sheet.header[c] for c in columns)
            data_faults.append(
                f"{sheet.top}: {spec.own.name}: duplicate column ({heads}); give one of them another name, or write "
                "tests that stand side by side into files of their own"
            )
        elif columns:
            unit = _unit(sheet, columns[0], spec)
            head = sheet.header[columns[0]]
            factor = None if spec.unit or head in spec.canonical_headers else factor_in(head)
            if factor is not None:
                config_faults.append(
                    f"{layout.place}.units: {spec.own.name}: the header {head!r} of {sheet.path} names a factor, "
                    f"{factor}; say what one recorded unit stands for, e.g. units: {{{spec.own.name}: 10 "
                    f"{spec.own.unit}}}, or 0.1 {spec.own.unit}, or {spec.own.unit} where the numbers are right"
                )
            elif unit is None:
                config_faults.append(
                    f"{layout.place}.units: {spec.own.name}: the header {head!r} of {sheet.path} "
                    f"names no unit; say it, e.g. units: {{{spec.own.name}: {spec.own.unit}}}"
                )
            else:
                found.append(_Source(spec, columns[0], unit))
        elif spec.named or spec.quantity in NEEDED:
            data_faults.append(_missing(sheet, spec, layout.place))
    if data_faults:
        _refuse_no_header(sheet, layout)
    if config_faults:
        raise ConfigError(config_faults)
    if data_faults:
        raise DataError(data_faults)
    return found


def _refuse_no_header(sheet: Sheet, layout: Layout) -> None:
    """Refuse a sheet whose first line names no columns: it is one column to the separator, or holds numbers.

    Raises
    ------
    DataError : with the key that reads it
    """
    got = f"(got {', '.join(sheet.header)})"
    if len(sheet.header) == 1 and len(sheet.header[0].split()) >= len(NEEDED):
        say = "the header is one column; if blanks stand between the fields, say separator: ' '"
        raise DataError(f"{sheet.top}: {say} {got}")
    if layout.entry.header is None and all(_NUMBER.fullmatch(head) for head in sheet.header if head):
        shown = [*(quantity.column for quantity in NEEDED), *(f"column{n}" for n in range(4, len(sheet.header) + 1))]
        say = f"name the columns in their order, e.g. header: [{', '.join(shown[: len(sheet.header)])}]"
        raise DataError(f"{sheet.top}: numbers stand where the headers should; {say} {got}")


def _unit(sheet: Sheet, column: int, spec: ChannelSpec) -> str | None:
    """Return the unit by the config, else by the file's own row of units, else by its header."""
    if spec.unit is not None:
        return spec.unit
    if sheet.units is not None and sheet.units[column]:
        return sheet.units[column].strip("[]() ")
    header = sheet.header[column]
    return spec.own.unit if header in spec.canonical_headers else in_header(header, spec.own)


def _missing(sheet: Sheet, spec: ChannelSpec, place: str) -> str:
    name, wanted = spec.own.name, spec.named or spec.own.column
    near = nearest(wanted, sheet.header) or next((h for h in sheet.header if name in h.lower()), None)
    if wanted.isdecimal() and 1 <= int(wanted) <= len(sheet.header):
        near = sheet.header[int(wanted) - 1]
    hint = f"; is it {near!r}? then say {place}.columns: {{{name}: {written(near)}}}" if near else ""
    if wanted in sheet.elsewhere:
        hint = (
            f"; it stands in table {sheet.elsewhere[wanted]!r}, which has another clock or length: export them as one"
        )
    elif not hint and spec.quantity is TIME:
        hint = "; where no column holds the time, say rate_Hz: N for N samples a second"
    elif not hint and spec.quantity is FORCE:
        hint = "; without force no damper: if another column holds it, say columns: {force: HEADER}"
    return f"{sheet.top}: missing column {wanted}{hint} (got {', '.join(sheet.header)})"


def _clock(sheet: Sheet, layout: Layout, found: list[_Source]) -> dict[Quantity, Array]:
    """Return the clock: counted from 0 in every recording, or its column unless that holds dates or bad cells."""
    if layout.entry.rate_Hz is not None:
        rows = np.arange(sheet.rows, dtype=np.float64)
        begins = np.array(sheet.starts)[np.searchsorted(sheet.starts, rows, side="right") - 1]
        return {TIME: (rows - begins) / layout.entry.rate_Hz}
    (clock,) = (source for source in found if source.spec.quantity is TIME)
    if clock.dated or clock.column in sheet.faults or (np.abs(sheet.numbers[clock.column]) > LARGEST).any():
        return {}
    return {TIME: sheet.numbers[clock.column]}


def day_and_month_exchanged(form: str) -> str:
    """Return a format of dates with day and month the other way round."""
    return re.sub("%[dm]", lambda code: {"%d": "%m", "%m": "%d"}[code[0]], form)


def instants(sheet: Sheet, column: int, form: str) -> Array:
    """Convert dates and times to seconds (rows,) since the first.

    Parameters
    ----------
    sheet : the file
    column : of the dates and times
    form : their format

    Raises
    ------
    DataError : when a cell has another format
    """
    import pandas as pd

    cells = sheet.texts[column]
    found = pd.to_datetime(pd.Series(cells), format=form, errors="coerce")
    bad = np.flatnonzero(found.isna().to_numpy())
    if bad.size:
        row = int(bad[0])
        swapped = day_and_month_exchanged(form)
        if swapped != form and not pd.to_datetime(pd.Series(cells), format=swapped, errors="coerce").isna().any():
            raise DataError(
                f"{sheet.place(row)}: {sheet.header[column]}: day and month are exchanged: say units: "
                f"{{time: {written(swapped)}}} (got {cells[row]!r})"
            )
        more = f" ({bad.size} such cells)" if bad.size > 1 else ""
        raise DataError(
            f"{sheet.place(row)}: {sheet.header[column]}: no date and time like {form}{more} (got {cells[row]!r})"
        )
    seconds = np.asarray((found - found[0]).dt.total_seconds(), dtype=np.float64)
    if any(code in form for code in _DATES):
        return seconds
    # A clock without a date begins anew at midnight, one of twelve hours without am and pm at noon too.
    turn = HALF_DAY if "%I" in form and "%p" not in form else 2.0 * HALF_DAY
    return seconds + turn * np.concatenate(([0.0], np.cumsum(np.diff(seconds) < -0.5 * turn)))


# --- Tests of a file ---


@dataclass(frozen=True, eq=False)
class RawRecord:
    """One test of one file as recorded, in SI and degC; every channel is (n,)."""

    number: int | None
    """Number of the test in the file, None where it holds one."""
    setting: str | None
    channels: dict[Quantity, Array]
    """By canonical quantity; the control signal under `VOLTAGE`."""
    sheet: Sheet
    first: int = 0
    """Row of the sheet at which the test begins."""
    remarks: tuple[Finding, ...] = ()
    """Contradictions between the file and the config."""
    faults: tuple[str, ...] = ()
    """Bad or empty cells; the test is then the whole file, uncut."""
    force_sign: int = 1
    """Factor between the force of the cell and the force here."""
    whole: bool = True
    """Whether the file is meant to be one test, in which the clock must go on."""
    steps: tuple[ReadingStep, ...] = ()
    """Steps from the file to this test."""

    def place(self, row: int) -> str:
        """Return file and line of one sample."""
        return self.sheet.place(self.first + row)


def split_into_tests(
    channels: Channels, sheet: Sheet, layout: Layout, values: Values, setting: str | None
) -> tuple[RawRecord, ...]:
    """Cut the channels of one file into tests, and add the values that no column holds.

    Raises
    ------
    ConfigError : when there are more or fewer values than tests, or the config gives a value that a column holds
    DataError : when the column that cuts the file is missing or doubled
    """
    split, place = layout.entry.split, layout.place
    twice = [
        f"{place}: {spec.own.name}: stands in column "
        f"{next(head for head in sheet.header if head in spec.headers)!r} of {sheet.path} and under "
        f"{_given_under(layout, spec)} as well; leave that out, or say columns: {{{spec.own.name}: ''}} to leave "
        "the column out"
        for spec in layout.channels
        if spec.quantity in channels.by_quantity and spec.quantity in values
    ]
    if twice:
        raise ConfigError(twice)
    alone = split is None and len(sheet.starts) == 1
    if channels.faults:
        return (RawRecord(None, setting, channels.by_quantity, sheet, faults=channels.faults, whole=alone),)
    starts = _starts(sheet, split, channels.by_quantity[TIME], place)
    bounds = list(zip(starts, [*starts[1:], sheet.rows], strict=True))
    faults = [
        f"{place}.split.constants: {spec.own.name}: {len(values[spec.quantity])} values for {len(bounds)} tests "
        f"in {sheet.path}"
        for spec in layout.channels
        if len(values.get(spec.quantity, (0.0,))) not in (1, len(bounds))
    ]
    if faults:
        raise ConfigError(faults)
    return tuple(
        RawRecord(
            index + 1 if len(bounds) > 1 else None,
            setting,
            _cut_out(channels.by_quantity, values, index, first, last),
            sheet,
            first,
            channels.remarks,
            force_sign=next(spec.sign for spec in layout.channels if spec.quantity is FORCE),
            whole=alone,
            steps=(
                *sheet.steps,
                *channels.steps,
                *_splitting_steps(sheet, layout, values, index, first, last, len(bounds)),
            ),
        )
        for index, (first, last) in enumerate(bounds)
    )


def _given_under(layout: Layout, spec: ChannelSpec) -> str:
    """Return the key of the config that gives the value of a quantity."""
    entry, names = layout.entry, {spec.own.name, spec.quantity.name}
    if names & set(entry.constants):
        return "constants"
    if entry.split and names & set(entry.split.constants):
        return "split.constants"
    return "preamble" if entry.preamble and names & {*re.compile(entry.preamble).groupindex} else "pattern"


def _starts(sheet: Sheet, split: FileSplit | None, time: Array, place: str) -> list[int]:
    """Return the first rows of the tests, by the config and where the file itself begins another table."""
    begins = np.zeros(sheet.rows, dtype=np.bool_)
    if split is not None and split.gap_s is not None:
        jump = np.diff(time)
        begins[1:] = (jump > split.gap_s) | (jump < 0.0)
    elif split is not None and not split.tables:
        header = split.column or split.event or ""
        if sheet.header.count(header) != 1:
            raise DataError(f"{sheet.top}: {place}.split: no single column {header!r}")
        cells = sheet.texts[sheet.header.index(header)]  # as an array, each would take as much as the longest
        if split.column is not None:
            begins[1:] = [after != before for before, after in pairwise(cells)]
        else:
            begins[1:] = [(split.begins or "") in cell for cell in cells[1:]]
    begins[list(sheet.starts)] = True
    return [int(row) for row in np.flatnonzero(begins)]


def _splitting_steps(
    sheet: Sheet, layout: Layout, values: Values, index: int, first: int, last: int, count: int
) -> Iterator[ReadingStep]:
    """Report the rows of this test, and the values that no column holds."""
    if count > 1:
        yield ReadingStep(
            "cut", None, f"test {index + 1} of {count}", f"{last - first} rows from {sheet.place_in_file(first)}"
        )
    for spec in layout.channels:
        if spec.quantity in values:
            given = values[spec.quantity]
            value = given[index if len(given) > 1 else 0]
            under = _given_under(layout, spec)
            yield ReadingStep("value", spec.own.name, f"no column; {under}", f"{value:.6g} {spec.own.unit}")


def _cut_out(
    channels: dict[Quantity, Array], values: Values, index: int, first: int, last: int
) -> dict[Quantity, Array]:
    piece = {quantity: column[first:last] for quantity, column in channels.items()}
    for quantity, given in values.items():
        piece[quantity] = np.full(last - first, given[index if len(given) > 1 else 0])
    return piece


# --- Known fixture ---


@dataclass(frozen=True, eq=False)
class DamperAlone:
    """Displacement and force of the damper alone, a known fixture taken out."""

    displacement: Array
    force: Array
    removed: str
    """What was taken out, in words; empty where nothing was."""
    displacement_measured: bool
    """Whether the displacement is that of the sensor, no frame taken out."""


def without_fixture(fixture: Fixture, time: Array, displacement: Array, force: Array, sign: int = 1) -> DamperAlone:
    """Take tare and moving mass out of the force, and the give of the frame out of the displacement.

    Equation: F = s (F_cell - F_tare) - m a, x = x_rig - F / k_frame
              Source: equilibrium of the mass, springs in series

    Parameters
    ----------
    fixture : as far as it is known
    time : (n,) [s]
    displacement : (n,) as the rig measures it [m]
    force : (n,) as the cell measures it, times its sign: s F_cell [N]
    sign : s, -1 where the cell counts compression positive

    Returns
    -------
    both without the fixture, and its effects in words

    Examples
    --------
    >>> import numpy as np
    >>> time = np.linspace(0.0, 1.0, 5)
    >>> alone = without_fixture(Fixture(tare_N=20.0), time, 0.01 * time, np.full(5, 120.0))
    >>> float(alone.force[0]), alone.removed
    (100.0, 'tare of 20 N')
    """
    removed: list[str] = []
    if fixture.tare_N:
        force = force - sign * fixture.tare_N
        removed.append(f"tare of {fixture.tare_N:g} N")
    if fixture.mass_kg:
        motion = kinematics(time, displacement, cycles(time, displacement))
        force = force - fixture.mass_kg * motion.acceleration
        removed.append(f"inertia of {fixture.mass_kg:g} kg")
    if fixture.stiffness_N_per_m:
        displacement = displacement - force / fixture.stiffness_N_per_m
        removed.append(f"give of the frame at {fixture.stiffness_N_per_m:g} N/m")
    return DamperAlone(displacement, force, ", ".join(removed), displacement_measured=not fixture.stiffness_N_per_m)
