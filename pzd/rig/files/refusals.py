"""Refusal of tests that cannot be used, with file, line and remedy; everything milder is a finding of the preflight."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.quantities import DISPLACEMENT, FORCE, TIME, VELOCITY
from pzd.record import Array, clock_fault
from pzd.rig.files.channels import COMPRESSION, DamperAlone, RawRecord
from pzd.rig.files.layout import Layout
from pzd.schema.errors import DataError
from pzd.signals.measures import REVERSAL_SHARE, chance_work, reversals, work

# --- Work over a whole test: negative where a sign is wrong ---

CLEAR_OFFSET = 0.1
"""Mean force, as a share of half the force's range, above which its sign tells which way the force is counted."""


def works_on_the_rig(alone: DamperAlone) -> bool:
    """Whether the damper does work on the rig over a test.

    A steady force over a net displacement does not count, nor does work that noise alone may do on a damper which
    hardly slips.
    """
    x, force = alone.displacement, alone.force
    chance = chance_work(x, force)
    return work(x, force) < -chance and work(x, force - force.mean()) < -chance


def sign_fault(
    test: RawRecord, alone: DamperAlone, layout: Layout, others: Sequence[tuple[RawRecord, DamperAlone]]
) -> str:
    """Describe a test over which the damper does work on the rig, and guess which channel has the wrong sign.

    Parameters
    ----------
    test : the test, for its place
    alone : displacement and force of the damper, a known fixture taken out
    layout : specification of each quantity
    others : the tests of the rig whose work is positive
    """
    done = work(alone.displacement, alone.force)
    what = f"{test.place(0)}: the damper does work on the rig over the whole test, {done:.4g} J"
    channel, why = _by_header(test, layout) or _by_others(test, alone, others) or _by_gas(alone) or (None, "")
    sign = -next(spec.sign for spec in layout.channels if spec.quantity.name == (channel or FORCE.name))
    if channel is None:
        return f"{what}: force or displacement has the wrong sign; say sign: {{force: {sign}}}"
    return f"{what}: {channel} has the wrong sign, since {why}; say sign: {{{channel}: {sign}}}"


def _by_header(test: RawRecord, layout: Layout) -> tuple[str, str] | None:
    for spec in layout.channels:
        if spec.quantity in (DISPLACEMENT, FORCE) and spec.sign == 1:
            heads = [head for head in test.sheet.header if head in spec.headers and COMPRESSION.search(head)]
            if heads:
                return spec.quantity.name, f"its header {heads[0]!r} counts compression positive"
    return None


def _by_others(
    test: RawRecord, alone: DamperAlone, others: Sequence[tuple[RawRecord, DamperAlone]]
) -> tuple[str, str] | None:
    offsets = [_offset(other) for mate, other in others if mate.setting == test.setting]
    clear = [offset for offset in offsets if offset is not None]
    mine = _offset(alone)
    if mine is None or not clear or abs(np.mean(np.sign(clear))) < 1.0:
        return None
    theirs = float(np.median(clear))
    channel = FORCE.name if mine * theirs < 0.0 else DISPLACEMENT.name
    return channel, f"the mean force is {mine:+.4g} N here and {theirs:+.4g} N in the files whose work is right"


def _by_gas(alone: DamperAlone) -> tuple[str, str] | None:
    """Judge by a gas force, which pushes the rod out: negative everywhere, less so the further the rod is out."""
    offset = _offset(alone)
    if offset is None:
        return None
    channel = FORCE.name if offset > 0.0 else DISPLACEMENT.name
    return channel, f"the mean force of {offset:+.4g} N, if it is the gas force and no tare, is negative in extension"


def _offset(alone: DamperAlone) -> float | None:
    """Return the middle of the force range where it is clearly off zero."""
    low, high = np.percentile(alone.force, (1.0, 99.0))
    middle = 0.5 * float(low + high)
    return middle if abs(middle) > CLEAR_OFFSET * 0.5 * float(high - low) else None


# --- Limits of a usable test ---

LONGEST_STROKE = 1.0
"""Largest stroke, end to end [m]; more is most often millimetres read as metres."""
HIGHEST_SPEED = 10.0
"""Largest speed [m/s]."""
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
LEAST_REVERSALS = 2
"""A motion of fewer reversals is no test of a damper."""


def refuse(tests: Sequence[RawRecord], layout: Layout) -> None:
    """Refuse a file one of whose tests cannot be used, whatever its fixture.

    Parameters
    ----------
    tests : the tests of the file in SI, as recorded
    layout : specification of each quantity

    Raises
    ------
    DataError : with the faults of the first such test, each with file and line
    """
    for test in tests:
        found = _faults(test, layout)
        if found:
            raise DataError(found)


def _faults(test: RawRecord, layout: Layout) -> list[str]:
    if test.faults:
        readable = test.whole and TIME in test.channels
        return [*test.faults, *(_standstills(test) if readable else [])]
    time, x, force = test.channels[TIME], test.channels[DISPLACEMENT], test.channels[FORCE]
    if time.size < 2:
        return [f"{test.place(0)}: only one data row"]
    backwards = _standstills(test)
    still = [
        f"{test.place(0)}: {quantity.name} is constant over the whole test (got {values[0]:.6g} {quantity.unit})"
        for quantity, values in ((DISPLACEMENT, x), (FORCE, force))
        if np.ptp(values) <= 1e-12 * np.abs(values).max()
    ]
    if backwards or still:
        return backwards + still
    return _too_large(test) + _too_few(test, x) + _two_rates(test) + _milliseconds(test, layout)


def _standstills(test: RawRecord) -> list[str]:
    """Describe where the clock stands still or goes back; NaN is reported as a bad cell."""
    time = test.channels[TIME]
    fault = clock_fault(time)
    return [f"{test.place(fault[0])}: {fault[1]}{_rounded(time)}"] if fault else []


def _rounded(time: Array) -> str:
    """Return the remedy where a clock (n,) stands still often and never goes back: it has too few digits."""
    steps = np.diff(time)
    if steps.min() < 0.0 or steps.max() == 0.0 or np.mean(steps == 0.0) < OFTEN:
        return ""
    rate = (time.size - 1) / (time[-1] - time[0])
    return f"; it has too few digits: leave its column out and say rate_Hz, about {rate:.5g} here"


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
        remedy = "cut the file here, e.g. with split: {gap_s: ...} at a pause, or resample it"
        return [f"{test.place(int(turn) + 1)}: {rates}; a record has one rate: {remedy}"]
    return []


def _milliseconds(test: RawRecord, layout: Layout) -> list[str]:
    """Describe a clock in steps of seconds beside a creeping motion, unless the config gives its unit."""
    time, x = test.channels[TIME], test.channels[DISPLACEMENT]
    unit_given = any(spec.quantity is TIME and spec.unit is not None for spec in layout.channels)
    step, speed = float(np.median(np.diff(time))), float(np.abs(_slope(time, x)).max())
    if unit_given or step < SLOWEST_STEP or speed > CREEPING:
        return []
    what = f"the clock goes in steps of {step:.4g} s while the motion reaches {1e3 * speed:.3g} mm/s"
    remedy = "are these milliseconds? say units: {time: ms}, or units: {time: s} if they are seconds"
    return [f"{test.place(0)}: {what}; {remedy}"]


def _too_large(test: RawRecord) -> list[str]:
    time, x = test.channels[TIME], test.channels[DISPLACEMENT]
    found: list[str] = []
    if np.ptp(x) > LONGEST_STROKE:
        row = int(np.argmax(np.abs(x - x[0])))
        found.append(
            f"{test.place(row)}: a stroke of {np.ptp(x):.4g} m, above {LONGEST_STROKE:g} m; are these millimetres?"
        )
    slope = _slope(time, x)
    speeds = [(slope, "displacement over time gives")]
    if VELOCITY in test.channels:
        speeds.append((_despiked(test.channels[VELOCITY]), "velocity reads"))
    for speed, what in speeds:
        row = int(np.argmax(np.abs(speed)))
        if abs(speed[row]) > HIGHEST_SPEED:
            found.append(
                f"{test.place(row)}: {what} {abs(speed[row]):.4g} m/s, above {HIGHEST_SPEED:g} m/s; check the units"
            )
    return found


def _slope(time: Array, x: Array) -> Array:
    """Compute the speed over four samples, insensitive to spikes of one or two."""
    if time.size < 6:
        return np.gradient(x, time)
    clean = _despiked(x)
    step = float(np.median(np.diff(time)))
    span = np.maximum(time[4:] - time[:-4], 4.0 * step)
    return np.pad((clean[4:] - clean[:-4]) / span, 2, mode="edge")


def _despiked(x: Array) -> Array:
    """Take the running median of five samples."""
    if x.size < 5:
        return x
    middle = np.median(np.lib.stride_tricks.sliding_window_view(x, 5), axis=1)
    return np.concatenate((middle[:1], middle[:1], middle, middle[-1:], middle[-1:]))


def _too_few(test: RawRecord, x: Array) -> list[str]:
    count = len(reversals(x))
    if count >= LEAST_REVERSALS:
        return []
    wanted = f"{LEAST_REVERSALS} reversals larger than {REVERSAL_SHARE:.0%} of its range"
    return [f"{test.place(0)}: the displacement needs {wanted} (got {count})"]
