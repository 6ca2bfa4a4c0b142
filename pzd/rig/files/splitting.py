"""The channels of one file as its tests, cut where the config says."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pzd.artefacts import Finding
from pzd.quantities import FORCE, TIME, Quantity
from pzd.record import Array
from pzd.rig.config import FileSplit
from pzd.rig.files.channels import Channels
from pzd.rig.files.layout import ChannelSpec, Layout, Values
from pzd.rig.files.sheet import ReadingStep, Sheet
from pzd.schema.errors import ConfigError, DataError


@dataclass(frozen=True, eq=False)
class Test:
    """One test of one file, in SI and degC; every channel is (n,)."""

    __test__ = False

    number: int | None
    """Which test of the file, None where it holds one."""
    setting: str | None
    channels: dict[Quantity, Array]
    """By canonical quantity; the control signal under `VOLTAGE`."""
    sheet: Sheet
    first: int = 0
    """Row of the sheet at which the test begins."""
    remarks: tuple[Finding, ...] = ()
    """What the file itself says otherwise than the config."""
    faults: tuple[str, ...] = ()
    """Cells that are bad or empty; then the test is the whole file, uncut."""
    force_sign: int = 1
    """What the force of the cell was multiplied by."""
    whole: bool = True
    """Whether the file is meant to be one test, in which the clock must go on."""
    steps: tuple[ReadingStep, ...] = ()
    """What was done to the file on the way here."""

    def place(self, row: int) -> str:
        """File and line of one sample."""
        return self.sheet.place(self.first + row)


def split_into_tests(
    channels: Channels, sheet: Sheet, layout: Layout, values: Values, setting: str | None
) -> tuple[Test, ...]:
    """Every test of one file, with the values that no column holds.

    Raises
    ------
    ConfigError : when there are more or fewer values than tests, or a column holds what the config gives as well
    DataError : when the column that cuts the file is missing or doubled
    """
    split, place = layout.entry.split, layout.place
    twice = [
        f"{place}: {spec.own.name}: stands in column {_header(sheet, spec)} of {sheet.path} and under "
        f"{_given_under(layout, spec)} as well; leave that out, or say columns: {{{spec.own.name}: ''}} to leave "
        "the column out"
        for spec in layout.channels
        if spec.quantity in channels.values and spec.quantity in values
    ]
    if twice:
        raise ConfigError(twice)
    alone = split is None and len(sheet.starts) == 1
    if channels.faults:
        return (Test(None, setting, channels.values, sheet, faults=channels.faults, whole=alone),)
    starts = _starts(sheet, split, channels.values[TIME], place)
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
        Test(
            index + 1 if len(bounds) > 1 else None,
            setting,
            _piece(channels.values, values, index, first, last),
            sheet,
            first,
            channels.remarks,
            force_sign=next(spec.sign for spec in layout.channels if spec.quantity is FORCE),
            whole=alone,
            steps=(*sheet.steps, *channels.steps, *_steps(sheet, layout, values, index, first, last, len(bounds))),
        )
        for index, (first, last) in enumerate(bounds)
    )


def _header(sheet: Sheet, spec: ChannelSpec) -> str:
    return repr(next(head for head in sheet.header if head in spec.headers))


def _given_under(layout: Layout, spec: ChannelSpec) -> str:
    """The key of the config that gives the value of a quantity."""
    entry, names = layout.entry, {spec.own.name, spec.quantity.name}
    if names & set(entry.constants):
        return "constants"
    return "split.constants" if entry.split and names & set(entry.split.constants) else "pattern"


def _starts(sheet: Sheet, split: FileSplit | None, time: Array, place: str) -> list[int]:
    """First rows of the tests: where the config says, and where the file itself begins another table."""
    begins = np.zeros(sheet.rows, dtype=np.bool_)
    if split is not None and split.gap_s is not None:
        jump = np.diff(time)
        begins[1:] = (jump > split.gap_s) | (jump < 0.0)
    elif split is not None and not split.tables:
        header = split.column or split.event or ""
        if sheet.header.count(header) != 1:
            raise DataError(f"{sheet.top}: {place}.split: no single column {header!r}")
        cells = np.array(sheet.texts[sheet.header.index(header)])
        by_event = np.char.find(cells[1:], split.begins or "") >= 0
        begins[1:] = cells[1:] != cells[:-1] if split.column is not None else by_event
    begins[list(sheet.starts)] = True
    return [int(row) for row in np.flatnonzero(begins)]


def _steps(
    sheet: Sheet, layout: Layout, values: Values, index: int, first: int, last: int, count: int
) -> Iterator[ReadingStep]:
    """Which rows are this test, and the values that no column holds."""
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


def _piece(channels: dict[Quantity, Array], values: Values, index: int, first: int, last: int) -> dict[Quantity, Array]:
    piece = {quantity: column[first:last] for quantity, column in channels.items()}
    for quantity, given in values.items():
        piece[quantity] = np.full(last - first, given[index if len(given) > 1 else 0])
    return piece
