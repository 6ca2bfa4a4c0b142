"""Refusal of tests that cannot be used, with file, line and remedy; everything milder is a finding of the preflight."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.quantities import DISPLACEMENT, FORCE, TIME, VELOCITY
from pzd.record import Array
from pzd.rig.files.channels import COMPRESSION, DamperAlone, RawRecord
from pzd.rig.files.clock import clock_faults, standstills
from pzd.rig.files.layout import Layout
from pzd.schema.errors import DataError
from pzd.signals.measures import REVERSAL_SHARE, chance_work, despiked, reversals, slope, work

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
LEAST_REVERSALS = 2
"""A motion of fewer reversals is no test of a damper."""
_SHOWN_BY_FEW = (
    "one way alone shows the force over that travel, and no friction, damping or spring apart from the others",
    "one load and unload shows what it dissipates, and neither friction apart from damping nor whether it repeats",
)
"""What a motion of no and of one reversal shows, and what it does not."""


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
        return [*test.faults, *(standstills(test) if readable else [])]
    time, x, force = test.channels[TIME], test.channels[DISPLACEMENT], test.channels[FORCE]
    if time.size < 2:
        return [f"{test.place(0)}: only one data row"]
    backwards = standstills(test)
    still = [
        f"{test.place(0)}: {quantity.name} is constant over the whole test (got {values[0]:.6g} {quantity.unit})"
        for quantity, values in ((DISPLACEMENT, x), (FORCE, force))
        if np.ptp(values) <= 1e-12 * np.abs(values).max()
    ]
    if backwards or still:
        return backwards + still
    return clock_faults(test, layout) + _too_large(test) + _too_few(test, x)


def _too_large(test: RawRecord) -> list[str]:
    time, x = test.channels[TIME], test.channels[DISPLACEMENT]
    found: list[str] = []
    if np.ptp(x) > LONGEST_STROKE:
        row = int(np.argmax(np.abs(x - x[0])))
        found.append(
            f"{test.place(row)}: a stroke of {np.ptp(x):.4g} m, above {LONGEST_STROKE:g} m; are these millimetres? "
            "say units: {displacement: mm}"
        )
    speeds = [(slope(time, x), "displacement over time gives")]
    if VELOCITY in test.channels:
        speeds.append((despiked(test.channels[VELOCITY]), "velocity reads"))
    for speed, what in speeds:
        row = int(np.argmax(np.abs(speed)))
        if abs(speed[row]) > HIGHEST_SPEED:
            found.append(
                f"{test.place(row)}: {what} {abs(speed[row]):.4g} m/s, above {HIGHEST_SPEED:g} m/s; check the units"
            )
    return found


def _too_few(test: RawRecord, x: Array) -> list[str]:
    count = len(reversals(x))
    if count >= LEAST_REVERSALS:
        return []
    wanted = f"the displacement needs {LEAST_REVERSALS} reversals larger than {REVERSAL_SHARE:.0%} of its range"
    return [f"{test.place(0)}: {wanted}; {_SHOWN_BY_FEW[count]}; drive a cycle and a half at least (got {count})"]
