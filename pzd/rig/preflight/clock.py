"""Checks of the clock: an irregular clock, lost samples, and channels that were held while the clock went on."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pzd.artefacts import Finding
from pzd.record import MAD_TO_SIGMA, Array, Rows
from pzd.rig.preflight import PreflightRecord
from pzd.schema.errors import counted

GAP = 1.5
"""Steps of the clock, in median ones, above which samples are lost: half of one lost sample more."""

# --- Sampling ---

JITTER = 0.02
"""R.m.s. deviation of the steps, as a share of the median step, above which it is reported."""
FEW_SAMPLES = 40
"""Samples per cycle below which linear interpolation of the displacement biases the stiffness."""


def sampling(test: PreflightRecord) -> Iterator[Finding]:
    """Find lost samples, an unsteady clock, and too few samples per cycle."""
    time = test.record.time
    steps = np.diff(time)
    step = float(np.median(steps))
    gaps = np.flatnonzero(steps > GAP * step)
    if gaps.size:
        yield Finding(
            check="dropped samples",
            where=f"{counted(gaps.size, 'gap')}, the first after {time[gaps[0]]:.6g} s, "
            f"the longest {steps.max():.4g} s",
            size=float(np.sum(np.rint(steps[gaps] / step) - 1)),
            unit="samples",
            follows="displacement is taken as linear across each gap; a fit over a long gap is wrong there",
        )
    jitter = float(np.std(np.delete(steps, gaps)) / step)
    if jitter > JITTER:
        yield Finding(
            check="sampling",
            where="the whole record",
            size=jitter,
            unit="-",
            follows="the steps of the clock scatter by this share; the speed is read wrongly by as much",
        )
    if test.cycles is not None and test.cycles.period / step < FEW_SAMPLES:
        yield Finding(
            check="sampling",
            where=f"the cycles at {test.cycles.frequency:.4g} Hz",
            size=test.cycles.period / step,
            unit="samples a cycle",
            follows="the motion between samples is guessed: stiffness is biased by about 1 % and more",
        )


# --- Channels that are held and jump ---

LEAST_HELD = 5
"""Equal samples from which a channel was held: a busy logger repeats its last value, or writes -9999."""
LONG_HELD = 20
"""Equal samples from which a run is odd where others are a fifth as long at most; digits at a peak repeat less."""
QUIET = 0.1
"""Share of the samples that repeat the last one, held runs aside, from which a channel is too quiet to tell."""
JUMP = 5.0
"""A jump is at least this many times as large as the steepest usual step between samples,"""
JUMP_SHARE = 0.02
"""and this share of the channel's usual range,"""
ISOLATED = 3.0
"""and of the displacement this many times as large as the steps before and after: no motion lasts for one sample."""
IN_MOTION = 0.2
"""A force is held where it jumps at this share of the top speed or more: at rest friction may stick, and let go."""
FAR_OFF = 20.0
"""A value held this many robust standard deviations from the median is no measurement, whatever the speed."""


def jumps(test: PreflightRecord) -> Iterator[Finding]:
    """Find stretches where displacement or force was held, and jumps of the displacement within one sample."""
    record, v = test.record, test.clean.velocity
    steps_of_clock = np.diff(record.time)
    gap = GAP * float(np.median(steps_of_clock))
    for name, unit, values in (("force", "N", record.force), ("displacement", "m", record.displacement)):
        least = _least_jump(values)
        if name == "force":
            ends = np.union1d(_held_then_jumping(values, least), _oddly_long_runs(values))
            moving = np.abs(v) > IN_MOTION * float(np.percentile(np.abs(v), 99.0))
            middle = float(np.median(values))
            spread = MAD_TO_SIGMA * float(np.median(np.abs(values - middle)))
            ends = ends[moving[ends] | (np.abs(values[ends] - middle) > FAR_OFF * spread)]
        else:
            # A motion may dwell, before the test or in it: only a jump tells that it went on unseen.
            ends = np.union1d(_held_then_jumping(values, least), _isolated_jumps(values, least))
        # Across a gap of the clock a jump is what the lost samples did, which `sampling` reports.
        ends = ends[steps_of_clock[ends] < gap]
        if ends.size:
            steps = np.diff(values)
            worst = int(ends[np.argmax(np.abs(steps[ends]))])
            yield Finding(
                check="jumps",
                where=f"{name}, held or jumping {ends.size} times, the largest until {record.time[worst]:.6g} s",
                size=float(steps[worst]),
                unit=unit,
                follows="the logger held it or lost samples; take these rows out of the file or measure again",
            )


def _least_jump(values: Array) -> float:
    """Smallest step between samples that counts as a jump."""
    low, high = np.percentile(values, (2.0, 98.0))
    return max(JUMP * float(np.percentile(np.abs(np.diff(values)), 99.0)), JUMP_SHARE * float(high - low), 1e-300)


def _runs_of_equal_samples(values: Array) -> tuple[Rows, Rows]:
    """Last rows and lengths of the runs of equal samples, without the last run."""
    change = np.flatnonzero(np.diff(values) != 0.0)
    return change, np.diff(change, prepend=-1)


def _held_then_jumping(values: Array, least: float) -> Rows:
    """Last rows of runs of equal samples that end in a jump."""
    ends, lengths = _runs_of_equal_samples(values)
    return np.asarray(ends[(lengths >= LEAST_HELD) & (np.abs(values[ends + 1] - values[ends]) > least)])


def _oddly_long_runs(values: Array) -> Rows:
    """Last rows of runs much longer than any other; not at the extremes, where a channel saturates."""
    ends, lengths = _runs_of_equal_samples(values)
    usual = float(np.percentile(lengths, 99.0))
    extreme = (values[ends] == values.max()) | (values[ends] == values.min())
    odd = (lengths >= LONG_HELD) & (lengths >= JUMP * usual) & ~extreme
    quiet = float(np.sum(lengths[~odd] - 1)) > QUIET * values.size
    return np.asarray(ends[:0] if quiet else ends[odd])


def _isolated_jumps(values: Array, least: float) -> Rows:
    """Rows before a jump within one sample, the motion before and after it being slow."""
    steps = np.abs(np.diff(values))
    rows: Rows = np.flatnonzero(steps[1:-1] > np.maximum(least, ISOLATED * np.maximum(steps[:-2], steps[2:]))) + 1
    return rows


CHECKS = (sampling, jumps)
