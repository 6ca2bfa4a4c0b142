"""Checks of what sensors and amplifiers do to a channel: steps, held values, drop-outs, a gain or a zero that moves."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pzd.artefacts import Finding
from pzd.record import Array, Rows
from pzd.rig.preflight import PreflightRecord
from pzd.schema.errors import counted
from pzd.signals.measures import noise_beside_motion, resolution

# --- Steps of a converter ---

FEWEST_STEPS = 1000.0
"""Steps in the stroke below which they are reported: its rate, which C hangs on, is then zero between two of them for
longer than a sample in a slow test, and the reversal, which T0 and k hang on, is known to a step."""
ON_GRID = 1e-3
"""Share of a step by which values may lie off the grid, from rounding of the file's digits."""
LEAST_LEVELS = 4
"""Levels from which there is a grid to speak of."""
DWELL = 1.5
"""Samples a step, on average, from which steps show as such; quicker motion is blurred, and the steps are noise,"""
COARSE = 200.0
"""unless there are fewer than these in the stroke: the noise is then 0.15 % of it and more."""


def quantisation(test: PreflightRecord) -> Iterator[Finding]:
    """Find a displacement that stands still between coarse steps."""
    x = test.record.displacement
    step = coarse_step(x)
    if step is None:
        return
    yield Finding(
        check="quantisation",
        where=f"displacement, in {np.ptp(x) / step:.0f} steps over the stroke",
        size=step,
        unit="m",
        follows="between two steps the motion is guessed: where the rod turns is known to a step, and the speed by it; "
        "T0, C and k may be off by more than their intervals: record it with finer steps",
    )


def coarse_step(x: Array) -> float | None:
    """Return the step [m] of a displacement (n,) that stands still between coarse steps; None where it does not."""
    step = _grid(x)
    fewest = FEWEST_STEPS if _samples_a_step(x) >= DWELL else COARSE
    return None if step is None or float(np.ptp(x)) > fewest * step else step


def _grid(values: Array) -> float | None:
    """Return the step of the grid on which values (n,) lie; None where they lie on none."""
    levels = np.unique(values)
    gaps = np.diff(levels)
    spread = float(np.ptp(values))
    gaps = gaps[gaps > 1e-9 * spread]  # rounding of one level
    if gaps.size < LEAST_LEVELS:
        return None
    step = float(np.median(gaps[gaps < 1.5 * gaps.min()]))
    off = np.abs(gaps / step - np.rint(gaps / step))
    return step if float(np.median(off)) < ON_GRID and float(off.max()) < 0.1 else None


def _samples_a_step(values: Array) -> float:
    """Return the mean number of samples for which values (n,) stand still."""
    return values.size / (1.0 + float(np.count_nonzero(np.diff(values))))


# --- A channel that is slower than the clock ---

HELD_SHARE = 0.8
"""Share of the runs of equal samples that are of one length, give or take a sample, where a channel is updated at a
rate of its own; runs of a quantised motion are of any length."""
LEAST_RUNS = 20
"""Runs from which a rate of its own is told."""


def held_channel(test: PreflightRecord) -> Iterator[Finding]:
    """Find a force or displacement that is updated less often than the clock goes on."""
    record = test.record
    for name, values in (("force", record.force), ("displacement", record.displacement)):
        change = np.flatnonzero(np.diff(values) != 0.0)
        lengths = np.diff(change)
        if lengths.size < LEAST_RUNS:
            continue
        usual = float(np.median(lengths))
        if usual < 2.0 or np.mean(np.abs(lengths - usual) <= 1.0) < HELD_SHARE or _grid_explains(values, usual):
            continue
        every = usual / record.rate
        yield Finding(
            check="held",
            where=f"{name}, held for {usual:g} samples of {record.rate:.4g} Hz",
            size=1.0 / every,
            unit="Hz",
            follows=f"its own rate, {1e3 * every:.3g} ms from one value to the next and half of that late; friction, "
            "stiffness and noise are those of its steps: write every channel at the rate of the slowest",
        )


def _grid_explains(values: Array, usual: float) -> bool:
    """Whether a steady motion over the steps of a converter makes equal runs: most changes are of one step then."""
    step = _grid(values)
    moves = np.abs(np.diff(values))
    return step is not None and usual > 0.0 and bool(np.median(moves[moves > 0.0]) < 1.5 * step)


# --- Drop-outs: samples of one value that was not measured ---

LEAST_DROPS = 3
"""Places at which one value stands among others before it is a drop-out and no chance."""
LONGEST_DROP = 20
"""Samples of a drop-out at most; longer ones are held stretches, reported by `jumps`."""
AROUND = 25
"""Samples to either side that a drop-out is held against."""
OFF = 8.0
"""Robust standard deviations by which it lies off the line through its neighbours,"""
OFF_SHARE = 0.02
"""and this share of the channel's range,"""
STEPS_OFF = 1.5
"""and so many steps of what it is recorded in: between two of them a slow channel flickers."""


def dropouts(test: PreflightRecord) -> Iterator[Finding]:
    """Find samples of exactly one value that stand away from their neighbours again and again."""
    time = test.record.time
    for channel in test.channels():
        rows = _dropped(channel.values)
        if rows.size:
            value = float(channel.values[rows[0]])
            yield Finding(
                check="drop-outs",
                where=f"{channel.name}, {counted(rows.size, 'sample')} of {value:.6g} {channel.unit}, the first at "
                f"{time[rows[0]]:.6g} s",
                size=float(rows.size / time.size),
                unit="-",
                follows="this share of the samples was not measured, and is fitted as if it were: mend the contact, or "
                "take these rows out of the file",
            )


def _dropped(values: Array) -> Rows:
    """Return the samples of the value that stands away from its neighbours most often."""
    none: Rows = np.empty(0, dtype=np.intp)
    levels, counts = np.unique(values, return_counts=True)
    often = levels[(counts >= LEAST_DROPS) & (counts < 0.2 * values.size)]
    # Of a converter's levels each occurs often: those at zero and at the ends of the range are what is put in.
    often = often[(often == 0.0) | (often == levels[0]) | (often == levels[-1])]
    if not often.size:
        return none
    found = [none]
    for level in often:
        flicker = STEPS_OFF * resolution(values[values != level])
        rows = np.flatnonzero(values == level)
        runs = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
        kept = [run for run in runs if run.size <= LONGEST_DROP and _stands_away(values, run, flicker)]
        if len(kept) >= LEAST_DROPS:
            found.append(np.concatenate(kept))
    return max(found, key=lambda rows: rows.size)


def _stands_away(values: Array, run: Rows, least: float) -> bool:
    """Whether a run of samples lies off what the samples to either side make of a line, by so much at least."""
    first, last = int(run[0]), int(run[-1])
    rows = np.r_[max(first - AROUND, 0) : first, last + 1 : min(last + 1 + AROUND, values.size)]
    rows = rows[values[rows] != values[first]]
    if rows.size < 6 or first == 0 or last == values.size - 1:
        return False
    near = rows[np.argsort(np.abs(rows - 0.5 * (first + last)))[:6]]
    # A straight line through them, as a motion goes on beneath a drop-out.
    line = np.polyfit(near - first, values[near], 1)
    rough = float(np.abs(values[near] - np.polyval(line, near - first)).max())
    off = float(np.abs(values[run] - np.polyval(line, run - first)).min())
    if np.abs(values[near] - values[first]).min() <= least:  # noise of a coarse channel: the next level is about
        return False
    return off > max(least, 3.0 * rough, OFF * noise_beside_motion(values[rows]), OFF_SHARE * float(np.ptp(values)))


# --- Cycles that change: a gain that steps, a zero that drifts ---

CYCLES = 6
"""Cycles from which a change from one to the next is told from their scatter; the first may be a start from rest."""
LEAST_GAIN = 0.03
"""Least step of the gain that is reported; calibrations are good to 1 %."""
LEAST_FADE = 0.1
"""Least change of the force over a test that is reported: a damper that warms by a few kelvin stays below."""
LEAST_DRIFT = 0.02
"""Least drift of the zero over the record that is reported, as a share of half the range of the force."""
CLEAR = 6.0
"""Standard errors of a step or drift, from the scatter of the cycles about it."""
DRIFT_CYCLES = 4
"""Cycles from which a drift is told: two values of the line, and one of the scatter behind the first cycle."""
DRIFT_CHANCE = 0.01
"""Chance of a drift of so many standard errors where there is none, by Student's t: of five cycles ten, of four 64.

Reason: of six cycles it is the six of `CLEAR`."""
BETTER = 4.0
"""A step is one where a steady change leaves this many times as much of the squares."""


def _sizes_by_cycle(test: PreflightRecord) -> Array | None:
    """Return the logarithm of the force's r.m.s. in each cycle but the first; None where the cycles are no repeats."""
    run = test.cycles
    if run is None or run.count < CYCLES or not test.constant_control:
        return None
    folded = run.fold(test.record.time, test.record.force)[1:]
    moved = run.fold(test.record.time, test.clean.displacement)[1:]
    sizes, strokes = folded.std(axis=1), moved.std(axis=1)
    if sizes.min() <= 0.0 or np.ptp(strokes) > LEAST_GAIN * strokes.mean():
        return None
    return np.asarray(np.log(sizes))


def gain_step(test: PreflightRecord) -> Iterator[Finding]:
    """Find a force that from one cycle on is larger or smaller by a factor, the motion being the same.

    Equation: log of the force's r.m.s. of a cycle = a before and b after a cycle     Source: least squares
    """
    run, course = test.cycles, _sizes_by_cycle(test)
    if run is None or course is None:
        return
    # A change inside a cycle makes one of a size between, which belongs to neither level.
    left = [_squares(course[:n]) + _squares(course[n + 1 :]) for n in range(1, course.size - 1)]
    between = int(np.argmin(left)) + 1
    before, after = course[:between], course[between + 1 :]
    step = float(after.mean() - before.mean())
    scatter = np.sqrt(min(left) / (course.size - 3))
    error = scatter * np.sqrt(1.0 / before.size + 1.0 / after.size) + 1e-6
    order = np.delete(np.arange(course.size), between)
    others = np.delete(course, between)
    steady = float(np.sum((others - np.polyval(np.polyfit(order, others, 1), order)) ** 2))
    if abs(step) > np.log1p(LEAST_GAIN) and abs(step) > CLEAR * error and steady > BETTER * min(left):
        yield Finding(
            check="gain",
            where=f"force, from about {run.start + (between + 1.5) * run.period:.4g} s on, the motion being the same",
            size=float(np.exp(step)),
            unit="-",
            follows="times as large as before: an amplifier's range or a loose cell; neither part is known to be right",
        )


def fade(test: PreflightRecord) -> Iterator[Finding]:
    """Find a force that grows or falls from cycle to cycle by a factor, the motion being the same.

    Equation: log of the force's r.m.s. of a cycle = a + b n + c n^2                    Source: least squares
    """
    run, course = test.cycles, _sizes_by_cycle(test)
    if run is None or course is None or any(gain_step(test)):
        return
    order = np.arange(course.size, dtype=np.float64)
    bent = np.polyval(np.polyfit(order, course, 2), order)
    scatter = np.sqrt(float(np.sum((course - bent) ** 2)) / (course.size - 3))
    change = float(bent[-1] - bent[0])
    # At either end of a parabola the error is three times that of the mean.
    error = scatter * 3.0 * np.sqrt(2.0 / course.size) + 1e-6
    if abs(change) > np.log1p(LEAST_FADE) and abs(change) > CLEAR * error:
        yield Finding(
            check="fade",
            where=f"force, from the first to the last of {counted(run.count, 'cycle')}, the motion being the same",
            size=float(np.exp(change)) - 1.0,
            unit="-",
            follows="the damper changes in the test, as where oil warms or foams: T0, C and k are those of the mean",
        )


def drift(test: PreflightRecord) -> Iterator[Finding]:
    """Find a force whose mean over a cycle goes steadily up or down.

    Equation: mean of a cycle = a + b n                              Source: least squares
    """
    from scipy.special import stdtrit

    run = test.cycles
    if run is None or run.count < DRIFT_CYCLES or not test.constant_control:
        return
    folded = run.fold(test.record.time, test.record.force)[1:]
    means, order = folded.mean(axis=1), np.arange(run.count - 1, dtype=np.float64)
    (slope, _), residual, *_ = np.polyfit(order, means, 1, full=True)
    free = run.count - 3
    scatter = np.sqrt(float(residual[0]) / free) if residual.size else 0.0
    clear = max(CLEAR, float(stdtrit(free, 1.0 - 0.5 * DRIFT_CHANCE)))
    error = scatter / np.sqrt(np.sum((order - order.mean()) ** 2))
    change = float(slope) * run.count
    half = 0.5 * float(np.ptp(np.percentile(test.record.force, (1.0, 99.0))))
    if abs(change) > LEAST_DRIFT * half and abs(slope) > clear * error:
        yield Finding(
            check="drift",
            where=f"force, mean of a cycle, over {counted(run.count, 'cycle')}",
            size=change,
            unit="N",
            follows="the zero of the load cell moves, or the gas warms; each cycle is off by another force",
        )


def _squares(values: Array) -> float:
    return float(np.sum((values - values.mean()) ** 2)) if values.size else 0.0


CHECKS = (quantisation, held_channel, dropouts, gain_step, fade, drift)
