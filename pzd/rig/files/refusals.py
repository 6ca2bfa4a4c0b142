"""What a test must satisfy to be used at all; a test that does not is refused.

Everything milder is a finding of the preflight.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.quantities import DISPLACEMENT, FORCE, TIME, VELOCITY
from pzd.record import Array, clock_fault
from pzd.rig.files.channels import COMPRESSION, Freed, Test
from pzd.rig.files.layout import Layout
from pzd.schema.errors import DataError
from pzd.signals.measures import REVERSAL_SHARE, chance_work, reversals, work

# ----------------------------------------------------------------------------------------------------
# The work that a test does on the damper: over a whole test it is positive, or a sign is wrong.


CLEAR_OFFSET = 0.1
"""Mean force, as a share of half the force's range, from which its sign says which way the force is counted."""


def works_on_the_rig(freed: Freed) -> bool:
    """Whether the damper does work on the rig over a test.

    Not where a steady force over a net displacement does it, nor where it is so little that a damper which hardly slips
    may do it by its noise.
    """
    x, force = freed.displacement, freed.force
    chance = chance_work(x, force)
    return work(x, force) < -chance and work(x, force - force.mean()) < -chance


def sign_fault(test: Test, freed: Freed, layout: Layout, others: Sequence[tuple[Test, Freed]]) -> str:
    """What to do about a test over which the damper does work on the rig, and which channel is turned over.

    Parameters
    ----------
    test : the test, for its place
    freed : displacement and force of the damper, a known fixture taken out
    layout : what the config says about each quantity
    others : the tests of the rig whose work is positive
    """
    done = work(freed.displacement, freed.force)
    what = f"{test.place(0)}: the damper does work on the rig over the whole test, {done:.4g} J"
    channel, why = _by_header(test, layout) or _by_others(test, freed, others) or _by_gas(freed) or (None, "")
    sign = -next(spec.sign for spec in layout.channels if spec.quantity.name == (channel or FORCE.name))
    if channel is None:
        return f"{what}: force or displacement has the wrong sign; say sign: {{force: {sign}}}"
    return f"{what}: {channel} has the wrong sign, since {why}; say sign: {{{channel}: {sign}}}"


def _by_header(test: Test, layout: Layout) -> tuple[str, str] | None:
    for spec in layout.channels:
        if spec.quantity in (DISPLACEMENT, FORCE) and spec.sign == 1:
            heads = [head for head in test.sheet.header if head in spec.headers and COMPRESSION.search(head)]
            if heads:
                return spec.quantity.name, f"its header {heads[0]!r} counts compression positive"
    return None


def _by_others(test: Test, freed: Freed, others: Sequence[tuple[Test, Freed]]) -> tuple[str, str] | None:
    offsets = [_offset(other) for mate, other in others if mate.setting == test.setting]
    clear = [offset for offset in offsets if offset is not None]
    mine = _offset(freed)
    if mine is None or not clear or abs(np.mean(np.sign(clear))) < 1.0:
        return None
    theirs = float(np.median(clear))
    channel = FORCE.name if mine * theirs < 0.0 else DISPLACEMENT.name
    return channel, f"the mean force is {mine:+.4g} N here and {theirs:+.4g} N in the files whose work is right"


def _by_gas(freed: Freed) -> tuple[str, str] | None:
    """A gas force pushes the rod out, so it is negative at every position and less so the further the rod is out."""
    offset = _offset(freed)
    if offset is None:
        return None
    channel = FORCE.name if offset > 0.0 else DISPLACEMENT.name
    return channel, f"the mean force of {offset:+.4g} N, if it is the gas force and no tare, is negative in extension"


def _offset(freed: Freed) -> float | None:
    """The mean force where it is clearly off zero."""
    low, high = np.percentile(freed.force, (1.0, 99.0))
    middle = 0.5 * float(low + high)
    return middle if abs(middle) > CLEAR_OFFSET * 0.5 * float(high - low) else None


# ----------------------------------------------------------------------------------------------------


LONGEST_STROKE = 1.0
"""Largest stroke, end to end [m]; more is most often millimetres read as metres."""
HIGHEST_SPEED = 10.0
"""Largest speed [m/s]."""
STRETCH = 20
"""Steps of the clock whose median is one rate."""
OTHER_RATE = 1.5
"""Ratio of two rates from which they are two; lost samples and jitter stay below over a stretch."""
SLOWEST_STEP = 0.05
"""Step of the clock [s] from which it may be in milliseconds: stands take 20 samples a second and more,"""
CREEPING = 5e-3
"""where the motion is no quicker than this [m/s], so that a thousand times as quick it is a test still."""
OFTEN = 0.01
"""Share of its steps at which a clock that stands still has too few digits; a logger repeats a row now and then."""
LEAST_REVERSALS = 2
"""Fewer turns of the motion are no test of a damper."""


def refuse(tests: Sequence[Test], layout: Layout) -> None:
    """Refuse a file one of whose tests cannot be used, whatever its fixture.

    Parameters
    ----------
    tests : the tests of the file in SI, as recorded
    layout : what the config says about each quantity

    Raises
    ------
    DataError : with what is wrong with the first such test, each with file and line
    """
    for test in tests:
        found = _faults(test, layout)
        if found:
            raise DataError(found)


def _faults(test: Test, layout: Layout) -> list[str]:
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


def _standstills(test: Test) -> list[str]:
    """Where the clock stands still or goes back, in a line; empty where it goes on. NaN is another's fault."""
    time = test.channels[TIME]
    fault = clock_fault(time)
    return [f"{test.place(fault[0])}: {fault[1]}{_rounded(time)}"] if fault else []


def _rounded(time: Array) -> str:
    """What to do where a clock (n,) stands still often, goes on, and never goes back: it has too few digits."""
    steps = np.diff(time)
    if steps.min() < 0.0 or steps.max() == 0.0 or np.mean(steps == 0.0) < OFTEN:
        return ""
    rate = (time.size - 1) / (time[-1] - time[0])
    return f"; it has too few digits: leave its column out and say rate_Hz, about {rate:.5g} here"


def _two_rates(test: Test) -> list[str]:
    """A clock that goes on at another rate: neither rate is the record's."""
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


def _milliseconds(test: Test, layout: Layout) -> list[str]:
    """A clock in steps of seconds beside a motion that creeps, unless the config itself says its unit."""
    time, x = test.channels[TIME], test.channels[DISPLACEMENT]
    said = any(spec.quantity is TIME and spec.unit is not None for spec in layout.channels)
    step, speed = float(np.median(np.diff(time))), float(np.abs(_slope(time, x)).max())
    if said or step < SLOWEST_STEP or speed > CREEPING:
        return []
    what = f"the clock goes in steps of {step:.4g} s while the motion reaches {1e3 * speed:.3g} mm/s"
    remedy = "are these milliseconds? say units: {time: ms}, or units: {time: s} if they are seconds"
    return [f"{test.place(0)}: {what}; {remedy}"]


def _too_large(test: Test) -> list[str]:
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
    """Speed over four samples, blind to spikes of one or two."""
    if time.size < 6:
        return np.gradient(x, time)
    clean = _despiked(x)
    step = float(np.median(np.diff(time)))
    span = np.maximum(time[4:] - time[:-4], 4.0 * step)
    return np.pad((clean[4:] - clean[:-4]) / span, 2, mode="edge")


def _despiked(x: Array) -> Array:
    """Running median of five samples."""
    if x.size < 5:
        return x
    middle = np.median(np.lib.stride_tricks.sliding_window_view(x, 5), axis=1)
    return np.concatenate((middle[:1], middle[:1], middle, middle[-1:], middle[-1:]))


def _too_few(test: Test, x: Array) -> list[str]:
    count = len(reversals(x))
    if count >= LEAST_REVERSALS:
        return []
    wanted = f"{LEAST_REVERSALS} reversals larger than {REVERSAL_SHARE:.0%} of its range"
    return [f"{test.place(0)}: the displacement needs {wanted} (got {count})"]
