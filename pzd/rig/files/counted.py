"""Comparison of `rate_Hz` with the column of time that a file has beside it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from pzd.artefacts import Finding
from pzd.quantities import TIME
from pzd.record import Array
from pzd.rig.files.layout import Layout
from pzd.rig.files.sheet import LIKE_A_CLOCK, Sheet
from pzd.rig.files.units import UnitError, in_header, to_canonical
from pzd.schema.errors import ConfigError
from pzd.schema.yamltree import written

SAME_RATE = 0.01
"""Rates that differ by less than this share are one: a clock is rounded, and stamped late now and then."""
_TIME_UNITS = (1.0, 1e-3, 1e-6, 60.0)
"""Seconds in what a clock without a unit may count."""


def beside_counted(sheet: Sheet, layout: Layout) -> tuple[Finding, ...]:
    """Compare `rate_Hz` with the column of time that the file has beside it.

    Parameters
    ----------
    sheet : the file
    layout : specification of each quantity

    Returns
    -------
    a finding where they differ and the config leaves the column out; else nothing

    Raises
    ------
    ConfigError : when they differ
    """
    rate = layout.entry.rate_Hz
    if rate is None:
        return ()
    read_as = {head for spec in layout.channels for head in spec.headers}
    clocks = [
        column
        for column in sheet.numbers.keys() - sheet.faults.keys()
        if sheet.header[column] not in read_as and LIKE_A_CLOCK.search(sheet.header[column])
    ]
    shown = {column: _other_rate(sheet, column, rate) for column in sorted(clocks)}
    column, other = next(((c, one) for c, one in shown.items() if one is not None), (0, None))
    if other is None or not all(shown.values()):
        return ()  # of several clocks one is enough to agree
    head = sheet.header[column]
    what = f"column {head!r} of {sheet.path} goes on at {other:.5g} Hz"
    if TIME.name not in layout.entry.columns:
        named = "" if head == TIME.column else f" and say columns: {{time: {written(head)}}}"
        raise ConfigError(
            f"{layout.place}.rate_Hz: {what}; leave rate_Hz out{named}, or say columns: {{time: ''}} where that column "
            f"is wrong (got {rate:g})"
        )
    return (
        Finding(
            check="clock",
            where=f"time, counted at {rate:g} Hz; {what.replace(str(sheet.path), sheet.path.name)}",
            size=other / rate,
            unit="-",
            follows="the config counts; by the column every speed would be this many times as large",
        ),
    )


def _other_rate(sheet: Sheet, column: int, rate: float) -> float | None:
    """Return the rate [Hz] of a column of time that is not the one given, in any recording of the file."""
    head, values = sheet.header[column], sheet.numbers[column]
    unit = (sheet.units[column].strip("[]() ") if sheet.units else "") or in_header(head, TIME)
    try:
        seconds = _TIME_UNITS if unit is None else (float(to_canonical(np.ones(1), unit, TIME)[0]),)
    except UnitError:
        seconds = _TIME_UNITS
    clocks = (values[first:last] for first, last in pairwise([*sheet.starts, sheet.rows]))
    others = (_rate_beside(clock, rate, seconds) for clock in clocks)
    return next((one for one in others if one is not None), None)


def _rate_beside(clock: Array, rate: float, seconds: tuple[float, ...]) -> float | None:
    """Return the rate [Hz] of a column of time (n,) that is not the one given; None where it is, or cannot be told.

    Parameters
    ----------
    clock : the column, as recorded
    rate : given [Hz]
    seconds : what one of the column may be [s]
    """
    if clock.size < 3 or not np.isfinite(clock).all() or bool(np.all(np.diff(clock) == 1.0)):
        return None
    steps = np.array([np.median(np.diff(clock)), (clock[-1] - clock[0]) / (clock.size - 1)])
    rates = [1.0 / (float(step) * one) for one in seconds for step in steps if step > 0.0]
    if not rates or any(abs(one / rate - 1.0) < SAME_RATE for one in rates):
        return None
    return rates[0]
