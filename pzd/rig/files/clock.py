"""Faults of a clock: standing still, two rates, a jump beyond the test, sample numbers or milliseconds as seconds.

A clock that is misread makes another damper: its damping coefficient is wrong by the same factor.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

import numpy as np

from pzd.artefacts import Finding
from pzd.quantities import DISPLACEMENT, TIME
from pzd.record import Array, clock_fault
from pzd.rig.config import FilesEntry
from pzd.rig.files.channels import RawRecord, day_and_month_exchanged, instants
from pzd.rig.files.formats import read_sheet
from pzd.rig.files.layout import Layout
from pzd.rig.files.sheet import Sheet, Wanted
from pzd.schema.errors import Advice, Advised, DataError, UserError
from pzd.schema.yamltree import written
from pzd.signals.measures import slope

STRETCH = 20
"""Steps of the clock in a block, whose median is one rate."""
OTHER_RATE = 1.5
"""Ratio above which two rates differ; lost samples and jitter stay below over a block."""
SLOWEST_STEP = 0.05
"""Step of the clock [s] from which it may be in milliseconds: stands take 20 samples a second and more,"""
CREEPING = 5e-3
"""where the motion is no quicker than this [m/s], so that a thousand times as quick it is a test still."""
OFTEN = 0.01
"""Share of its steps at which a clock that stands still has too few digits; a logger repeats a row now and then."""
FEWEST_TICKS = 2
"""Times that a clock with too few digits must go on to tell a rate: a whole tick lies between them."""
LONGEST_PAUSE = 600.0
"""Pause [s] that no test has, where it is longer than all the rest of the record as well."""
MOST_LOST = 1_000_000
"""Samples that would have to be thought into a pause; likewise."""
_COUNTING = re.compile(
    r"^(?:samples?|scans?|index|idx|nr|no|num|number|count(?:er)?|rows?|lines?|points?|n|i|#|messpunkte?|zeilen?)(?![a-z])",
    re.IGNORECASE,
)
"""Headers of columns that count samples."""


# --- Refusals ---


def clock_faults(test: RawRecord, layout: Layout) -> list[str]:
    """Describe what is wrong with the clock of a test that goes on without standing still."""
    return _jump(test, layout) or _two_rates(test) or _sample_numbers(test, layout) or _milliseconds(test, layout)


def standstills(test: RawRecord, layout: Layout) -> list[str]:
    """Describe where the clock stands still or goes back; NaN is reported as a bad cell."""
    time = test.channels[TIME]
    fault = clock_fault(time)
    if not fault:
        return []
    told = f"{test.place(fault[0])}: {fault[1]}"
    steps = np.diff(time)
    if steps.max() < 0.0:
        return [f"{told}; the rows run backwards: turn them round"]
    if steps.max() == 0.0:
        return [told]
    if steps.min() < 0.0:
        return [_goes_back(test, layout, told, steps)]
    if np.mean(steps == 0.0) < OFTEN:
        return [f"{told}; take the rows that repeat a time out"]
    return [_too_few_digits(told, time)]


def _too_few_digits(told: str, time: Array) -> str:
    """Say that a clock stands still between its ticks, and the rate that whole ticks tell."""
    goes_on = np.flatnonzero(np.diff(time) > 0.0) + 1  # the first stamp and the last may not be whole ones
    if goes_on.size < FEWEST_TICKS:
        when = "for N samples a second, which this clock does not tell, and leave out the column of the time"
        return Advised(f"{told}; it has too few digits;", Advice("rate_Hz", "N", when=when))
    first, last = goes_on[0], goes_on[-1]
    rate = (last - first) / (time[last] - time[first])
    when = "or what is known of it, and leave out the column of the time"
    return Advised(f"{told}; it has too few digits;", Advice("rate_Hz", f"{rate:.5g}", when=when))


def _goes_back(test: RawRecord, layout: Layout, told: str, steps: Array) -> str:
    """Say what a clock does that goes back here and there: a counter begins again, or another test."""
    time = test.channels[TIME]
    if wraps_at := _wraps_at(time, steps):
        rate = Advice("rate_Hz", f"{1.0 / np.median(steps):.5g}", when="and leave out the column of the time")
        what = f"the clock begins again after {wraps_at} ticks, a counter of so many bits;"
        return Advised(f"{test.place(int(np.argmin(steps)) + 1)}: {what}", rate)
    goes_on = time[1:][steps < 0.0]
    far_back = np.all(goes_on < time[:-1][steps < 0.0] - 0.5 * np.ptp(time))
    begins = bool(far_back or np.all(np.abs(goes_on - time[0]) <= np.median(steps)))  # tests differ in length
    return _other_tests(test, layout, f"{told}; another test begins there", steps) if begins else told


def _other_tests(test: RawRecord, layout: Layout, told: str, steps: Array) -> str:
    """Say how to cut a file at the rows at which its clock begins again: by a column that numbers the tests, if any."""
    read = {head for spec in layout.channels for head in spec.headers}
    heads = [head for head in dict.fromkeys(test.sheet.header) if head.strip() and head not in read]
    falls = np.flatnonzero(steps < 0.0) + 1
    part = range(test.first + 1, test.first + test.channels[TIME].size)
    column, tells_some = numbering_column(test.sheet.path, layout.entry, heads, {part[n - 1] for n in falls}, part)
    own = "write each into a file of its own"
    if column is not None:
        return Advised(f"{told};", Advice("split", f"{{column: {written(column)}}}", when=f"or {own}"))
    if tells_some is not None:
        return f"{told}; column {tells_some!r} tells only some of them apart: {own}"
    if layout.entry.split is not None:
        return f"{told}: {own}"
    gap = _two_digits(10.0 * float(steps.max()))
    when = f"which cuts where the clock goes back as well, or {own}"
    return Advised(f"{told};", Advice("split", f"{{gap_s: {gap}}}", when=when))


def numbering_column(
    path: Path, entry: FilesEntry, heads: Sequence[str], falls: Collection[int], part: range
) -> tuple[str | None, str | None]:
    """Find the column that numbers the tests of a file, whose clock begins again with each.

    Parameters
    ----------
    path : the file
    entry : how it is read
    heads : of the columns that hold nothing else
    falls : rows at which the clock begins again
    part : rows of the file that are looked at, but for the first of them

    Returns
    -------
    the column whose label changes at these rows and nowhere else, None without; and one whose label changes at some of
    them alone
    """
    begins, some = {*falls}, None
    for head in heads:  # one at a time, for the sake of the memory
        try:
            sheet = read_sheet(path, entry, Wanted(texts=frozenset((head,))), "rig.files")
        except UserError:
            continue
        cells = sheet.texts.get(sheet.header.index(head), []) if head in sheet.header else []
        if len(cells) < part.stop:
            continue
        changes = {row for row in part if cells[row] != cells[row - 1]}
        if changes == begins:
            return head, some
        if changes and changes < begins:
            some = head
    return None, some


def _wraps_at(time: Array, steps: Array) -> int | None:
    """Return the number of ticks after which a counter begins again; None where no counter of whole bytes does.

    All falls are as deep, with the usual step 2^8, 2^16, 2^24 or 2^32 of a decimal tick. What was begun at the same
    number as it begins again may as well be another test of a round number of samples.
    """
    falls, usual = -steps[steps < 0.0], float(np.median(steps[steps > 0.0]))
    if np.ptp(falls) > usual or abs(time[1:][steps < 0.0][0] - time[0]) <= usual:
        return None
    decimal, powers = 10.0 ** np.arange(7)[:, None], 2 ** np.array([8, 16, 24, 32])
    near = np.abs((float(np.median(falls)) + usual) * decimal - powers) < 0.1 * usual * decimal
    return int(powers[np.argmax(near.any(axis=0))]) if near.any() else None


def _jump(test: RawRecord, layout: Layout) -> list[str]:
    """Describe a pause longer than all the rest of the record: dates exchanged, a clock that was set, two tests."""
    time = test.channels[TIME]
    steps = np.diff(time)
    row = int(np.argmax(steps))
    longest, usual = float(steps[row]), float(np.median(steps))
    if longest <= float(time[-1] - time[0]) - longest or longest < min(LONGEST_PAUSE, MOST_LOST * usual):
        return []
    place = test.place(row + 1)
    what = (
        f"{place}: the clock jumps by {longest:.6g} s here, in a record of {time[-1] - time[0] - longest:.4g} s beside"
    )
    swapped = _days_first(test.sheet, layout, longest)
    if swapped is not None:
        return [f"{what}; day and month are exchanged: say units: {{time: {written(swapped)}}}"]
    return [
        Advised(
            f"{what}; write a clock that goes on, or where another test begins",
            Advice("split", f"{{gap_s: {_two_digits(0.5 * longest)}}}"),
        )
    ]


def _days_first(sheet: Sheet, layout: Layout, longest: float) -> str | None:
    """Return the format with day and month exchanged, where by it the longest pause is a tenth at most."""
    spec = next((spec for spec in layout.channels if spec.quantity is TIME and spec.dated), None)
    column = next((i for i, head in enumerate(sheet.header) if spec and head in spec.headers), None)
    if spec is None or spec.unit is None or column is None:
        return None
    swapped = day_and_month_exchanged(spec.unit)
    try:
        seconds = instants(sheet, column, swapped)
    except DataError:
        return None
    steps = np.diff(seconds)
    return swapped if steps.min() > 0.0 and steps.max() < 0.1 * longest else None


def _two_rates(test: RawRecord) -> list[str]:
    """Describe where the clock goes on at another rate: neither rate is the record's."""
    time = test.channels[TIME]
    steps = np.diff(time)
    if steps.size < 2 * STRETCH:
        return []
    blocks = np.median(steps[: steps.size // STRETCH * STRETCH].reshape(-1, STRETCH), axis=1)
    for row in np.flatnonzero(np.abs(np.log(blocks[1:] / blocks[:-1])) > np.log(OTHER_RATE)):
        before, after = blocks[max(row - 1, 0) : row + 1], blocks[row + 1 : row + 4]
        old, new = float(np.median(before)), float(np.median(after))
        if after.size < 2 or max(old, new) < OTHER_RATE * min(old, new) or np.ptp(after[1:]) > 0.1 * new:
            continue
        near = slice(row * STRETCH, (row + 2) * STRETCH)
        turn = int(np.argmax(np.abs(np.log(steps[near] / old)) > 0.5 * np.log(OTHER_RATE))) + near.start
        rates = f"the clock goes on at {1.0 / new:.4g} Hz here, at {1.0 / old:.4g} Hz before"
        told = f"{test.place(int(turn) + 1)}: {rates}; a record has one rate"
        others = float(np.max(np.delete(steps, turn)))
        if steps[turn] > 2.0 * others:  # by a pause where one is there
            gap = _two_digits(np.sqrt(steps[turn] * others))
            return [Advised(f"{told};", Advice("split", f"{{gap_s: {gap}}}", when="to cut the file at this pause"))]
        return [f"{told}: write the rows from here on into a file of their own"]
    return []


def _two_digits(seconds: float) -> str:
    """Write seconds with two digits and without an exponent, as far as they can do without."""
    return f"{float(f'{seconds:.2g}'):g}"


_UNITS_OF_TIME = Advice("units", "ms", TIME.name), Advice("units", "s", TIME.name, "if they are seconds")


def _sample_numbers(test: RawRecord, layout: Layout) -> list[str]:
    """Describe a clock that counts samples: its header says so, or it counts 1, 2, 3 and the config gives no unit."""
    spec = next((spec for spec in layout.channels if spec.quantity is TIME), None)
    if spec is None or spec.dated or not _counts(test.channels[TIME]):
        return []
    head = next(head for head in test.sheet.header if head in spec.headers)
    when = "for N samples a second" + (" in the place of columns and units of time" if spec.named else "")
    rate = Advice("rate_Hz", "N", when=when)
    if _COUNTING.match(head):
        return [Advised(f"{test.place(0)}: time: column {head!r} counts samples, no seconds;", rate)]
    if spec.unit is not None:
        return []
    ask = "the clock counts whole seconds, one a row; are these numbers of samples, or milliseconds?"
    return [Advised(f"{test.place(0)}: {ask}", rate, *_UNITS_OF_TIME)]


def _counts(time: Array) -> bool:
    """Whether a clock (n,) counts its rows: 0, 1, 2 or 1, 2, 3 and so on."""
    return bool(np.all(np.diff(time) == 1.0) and time[0] == np.rint(time[0]))


def _milliseconds(test: RawRecord, layout: Layout) -> list[str]:
    """Describe a clock in steps of seconds beside a creeping motion, unless the config gives its unit or its rate."""
    time, x = test.channels[TIME], test.channels[DISPLACEMENT]
    given = layout.entry.rate_Hz is not None
    given = given or any(spec.quantity is TIME and spec.unit is not None for spec in layout.channels)
    step, speed = float(np.median(np.diff(time))), float(np.abs(slope(time, x)).max())
    if given or step < SLOWEST_STEP or speed > CREEPING:
        return []
    what = f"the clock goes in steps of {step:.4g} s while the motion reaches {1e3 * speed:.3g} mm/s"
    return [Advised(f"{test.place(0)}: {what}; are these milliseconds?", *_UNITS_OF_TIME)]


# --- Findings ---


def clock_remarks(test: RawRecord, layout: Layout) -> Iterator[Finding]:
    """Find a clock that counts whole seconds, one a row, which the config calls seconds."""
    if layout.entry.rate_Hz is None and test.channels[TIME].size > 2 and _counts(test.channels[TIME]):
        yield Finding(
            check="clock",
            where="time, one whole second a row",
            size=1.0,
            unit="s",
            follows="numbers of samples look like this: the damping coefficient would be wrong by the sampling rate",
        )
