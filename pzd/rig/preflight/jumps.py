"""Whether a channel was held and jumped on, or samples are missing though the clock goes on."""

from __future__ import annotations

import numpy as np

from pzd.artefacts import Finding
from pzd.record import Array, Rows
from pzd.rig.preflight import Measured

LEAST_HELD = 5
"""Equal samples from which a channel was held: a busy logger repeats its last value, or writes -9999."""
LONG_HELD = 20
"""Equal samples from which a run is odd where others are a fifth as long at most; digits at a peak repeat less."""
QUIET = 0.1
"""Share of the samples that repeat the last one, held runs aside, from which a channel is too quiet to tell."""
JUMP = 5.0
"""A jump is so many times as large as the steepest usual step from one sample to the next,"""
SHARE = 0.02
"""and this share of the channel's usual range,"""
ALONE = 3.0
"""and of the displacement so many times as large as the steps before and after: nothing moves so for one sample."""
LOST = 1.5
"""Steps of the clock, in median ones, from which samples are lost."""
IN_MOTION = 0.2
"""A force is held where it jumps at this share of the top speed or more: at rest friction may hold it, and let go."""
FAR_OFF = 20.0
"""Held so many robust standard deviations from the median a value stands for none, whatever the speed."""


def check(test: Measured) -> list[Finding]:
    """Displacement and force that are held, and steps of the displacement in a single sample."""
    record, v = test.record, test.clean.velocity
    found: list[Finding] = []
    steps_of_clock = np.diff(record.time)
    lost = LOST * float(np.median(steps_of_clock))
    for name, unit, values in (("force", "N", record.force), ("displacement", "m", record.displacement)):
        least = _least(values)
        if name == "force":
            ends = np.union1d(_jumping_on(values, least), _oddly_long(values))
            moving = np.abs(v) > IN_MOTION * float(np.percentile(np.abs(v), 99.0))
            middle = float(np.median(values))
            spread = 1.4826 * float(np.median(np.abs(values - middle)))
            ends = ends[moving[ends] | (np.abs(values[ends] - middle) > FAR_OFF * spread)]
        else:
            # A motion may dwell, before the test or in it: only a jump tells that it went on unseen.
            ends = np.union1d(_jumping_on(values, least), _alone(values, least))
        # Across a gap of the clock a jump is what the lost samples did, which another check says.
        ends = ends[steps_of_clock[ends] < lost]
        if ends.size:
            steps = np.diff(values)[ends]
            worst = int(ends[np.argmax(np.abs(steps))])
            found.append(
                Finding(
                    check="jumps",
                    where=f"{name}, held or jumping {ends.size} times, the largest until {record.time[worst]:.6g} s",
                    size=float(np.diff(values)[worst]),
                    unit=unit,
                    follows="the logger held this channel or lost samples; cut the record there, or measure it again",
                )
            )
    return found


def _least(values: Array) -> float:
    """The smallest step from one sample to the next that is a jump."""
    low, high = np.percentile(values, (2.0, 98.0))
    return max(JUMP * float(np.percentile(np.abs(np.diff(values)), 99.0)), SHARE * float(high - low), 1e-300)


def _runs(values: Array) -> tuple[Rows, Rows]:
    """Last rows and lengths of the runs of equal samples, the last one left out."""
    change = np.flatnonzero(np.diff(values) != 0.0)
    return change, np.diff(change, prepend=-1)


def _jumping_on(values: Array, least: float) -> Rows:
    """Last rows of runs of equal samples from which the channel jumps on."""
    ends, lengths = _runs(values)
    jumps: Rows = ends[(lengths >= LEAST_HELD) & (np.abs(values[ends + 1] - values[ends]) > least)]
    return jumps


def _oddly_long(values: Array) -> Rows:
    """Last rows of runs much longer than any other; not at the extremes, where a channel is cut off."""
    ends, lengths = _runs(values)
    usual = float(np.percentile(lengths, 99.0))
    extreme = (values[ends] == values.max()) | (values[ends] == values.min())
    odd = (lengths >= LONG_HELD) & (lengths >= JUMP * usual) & ~extreme
    quiet = float(np.sum(lengths[~odd] - 1)) > QUIET * values.size
    none: Rows = ends[:0]
    return none if quiet else ends[odd]


def _alone(values: Array, least: float) -> Rows:
    """Rows from which the channel jumps in one sample, and goes on as it went before."""
    steps = np.abs(np.diff(values))
    rows = np.flatnonzero(steps[1:-1] > np.maximum(least, ALONE * np.maximum(steps[:-2], steps[2:]))) + 1
    alone: Rows = rows
    return alone
