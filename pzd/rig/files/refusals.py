"""Refusal of tests that cannot be used, with file, line and remedy; everything milder is a finding of the preflight."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from pzd.quantities import DISPLACEMENT, FORCE, TIME, VELOCITY
from pzd.record import Array
from pzd.rig.files.channels import COMPRESSION, DamperAlone, RawRecord
from pzd.rig.files.clock import clock_faults, standstills
from pzd.rig.files.layout import ChannelSpec, Layout
from pzd.schema.errors import Advice, Advised, DataError, counted
from pzd.schema.yamltree import written
from pzd.signals.measures import REVERSAL_SHARE, chance_work, despiked, reversals, rms, slope, work

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


def sign_faults(
    wrong: Sequence[tuple[RawRecord, DamperAlone]],
    layout_of: Mapping[Path, Layout],
    others: Sequence[tuple[RawRecord, DamperAlone]],
) -> list[str]:
    """Describe the tests over which the damper does work on the rig, and guess which channel has the wrong sign.

    Where the tests of one layout would be told differently, that is told of all of them which most ask for: a channel
    is turned over in all files of a rig or in none.

    Parameters
    ----------
    wrong : the tests whose work is negative, with displacement and force of the damper
    layout_of : file -> specification of each quantity
    others : the tests of the rig whose work is positive
    """
    faults: list[str] = []
    hints = [_hint(test, alone, layout_of[test.sheet.path], others) for test, alone in wrong]
    for (test, alone), hint in zip(wrong, hints, strict=True):
        layout = layout_of[test.sheet.path]
        mates = [one for (mate, _), one in zip(wrong, hints, strict=True) if layout_of[mate.sheet.path] is layout]
        usual = Counter(channel for channel, _ in mates).most_common(1)[0][0]
        channel, why = hint if hint[0] == usual else next(one for one in mates if one[0] == usual)
        done = work(alone.displacement, alone.force)
        what = f"{test.place(0)}: the damper does work on the rig over the whole test, {done:.4g} J"
        right = sum(layout_of[other.sheet.path] is layout for other, _ in others)
        if right:
            what += f", and in {counted(right, 'other test')} of this entry it does none: it needs an entry of its own"
        signs = {spec.quantity.name: -spec.sign for spec in layout.channels}
        turned = {name: Advice("sign", str(signs[name]), name) for name in (DISPLACEMENT.name, FORCE.name)}
        if _exchanged(alone):
            heads = [next(h for h in test.sheet.header if h in s.headers) for s in _both(layout)]
            faults.append(
                Advised(
                    f"{what}: displacement and force are exchanged, since the displacement is rough and the force "
                    "smooth;",
                    Advice(
                        "columns",
                        f"{{displacement: {written(heads[1])}, force: {written(heads[0])}}}, with their units",
                    ),
                )
            )
        elif channel is None:
            faults.append(
                Advised(
                    f"{what}: force or displacement has the wrong sign, or this is an active load and no damper;",
                    replace(turned[FORCE.name], when="where the displacement grows in rebound"),
                    replace(turned[DISPLACEMENT.name], when="where it grows in compression"),
                )
            )
        else:
            faults.append(Advised(f"{what}: {channel} has the wrong sign, since {why};", turned[channel]))
    return faults


def _hint(
    test: RawRecord, alone: DamperAlone, layout: Layout, others: Sequence[tuple[RawRecord, DamperAlone]]
) -> tuple[str | None, str]:
    """Return the channel that has the wrong sign and why; no channel where neither header nor other tests tell."""
    return _by_header(test, layout) or _by_others(test, alone, others) or (None, "")


def _both(layout: Layout) -> tuple[ChannelSpec, ChannelSpec]:
    """Return the specifications of displacement and force."""
    found = {spec.quantity: spec for spec in layout.channels}
    return found[DISPLACEMENT], found[FORCE]


EXCHANGED = 10.0
"""Times that a displacement is rougher than its force where the two are exchanged: else it is the smoother of the two,
the integral of a speed, and even noise of 1 in 1000 makes it no rougher than a smooth force."""


def _exchanged(alone: DamperAlone) -> bool:
    """Whether the displacement is the rougher of the two: it has the flanks and the noise of a force."""
    x, force = (float(rms(np.diff(v, 2)) / np.std(v)) for v in (alone.displacement, alone.force))
    return x > EXCHANGED * force


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
        return [*test.faults, *(standstills(test, layout) if readable else [])]
    time, x, force = test.channels[TIME], test.channels[DISPLACEMENT], test.channels[FORCE]
    if time.size < 2:
        return [f"{test.place(0)}: only one data row"]
    backwards = standstills(test, layout)
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
            Advised(
                f"{test.place(row)}: a stroke of {np.ptp(x):.4g} m, above {LONGEST_STROKE:g} m; are these millimetres?",
                Advice("units", "mm", DISPLACEMENT.name),
            )
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
