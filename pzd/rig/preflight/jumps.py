"""Whether a channel was held and jumped on, or samples are missing though the clock goes on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pzd.artefacts import Finding
from pzd.record import Array
from pzd.rig.preflight import Measured

LEAST_HELD = 5
"""Equal samples from which a channel was held: a busy logger repeats its last value, or writes -9999."""
LONG_HELD = 20
"""Equal samples from which a run is odd where others are a fifth as long at most; digits at a peak repeat less."""
JUMP = 5.0
"""A jump is so many times as large as the steepest usual step from one sample to the next,"""
SHARE = 0.02
"""and this share of the channel's usual range,"""
ALONE = 3.0
"""and of the displacement so many times as large as the steps before and after: nothing moves so for one sample."""
IN_MOTION = 0.2
"""A force is held where it jumps at this share of the top speed or more: at rest friction may hold it, and let go."""
FAR_OFF = 20.0
"""Held so many robust standard deviations from the median a value stands for none, whatever the speed."""


def check(test: Measured) -> list[Finding]:
    """Displacement and force that are held, and steps of the displacement in a single sample."""
    record, v = test.record, test.clean.velocity
    found: list[Finding] = []
    for name, unit, values in (("force", "N", record.force), ("displacement", "m", record.displacement)):
        ends = _held_until(values)
        if name == "force":
            moving = np.abs(v) > IN_MOTION * float(np.percentile(np.abs(v), 99.0))
            middle = float(np.median(values))
            spread = 1.4826 * float(np.median(np.abs(values - middle)))
            ends = ends[moving[ends] | (np.abs(values[ends] - middle) > FAR_OFF * spread)]
        else:
            ends = np.union1d(ends, _alone(values))
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
    low, high = np.percentile(values, (2.0, 98.0))
    return max(JUMP * float(np.percentile(np.abs(np.diff(values)), 99.0)), SHARE * float(high - low), 1e-300)


def _held_until(values: Array) -> NDArray[np.int64]:
    """Last rows of runs of equal samples from which the channel jumps on, or that are much longer than any other.

    Runs at the extremes are another check's: there the channel was cut off.
    """
    change = np.flatnonzero(np.diff(values) != 0.0)
    lengths = np.diff(change, prepend=-1)
    jumps = (lengths >= LEAST_HELD) & (np.abs(values[change + 1] - values[change]) > _least(values))
    usual = float(np.percentile(lengths, 99.0))
    extreme = (values[change] == values.max()) | (values[change] == values.min())
    odd = (lengths >= LONG_HELD) & (lengths >= JUMP * usual) & ~extreme
    return change[jumps | odd]


def _alone(values: Array) -> NDArray[np.int64]:
    """Rows from which the channel jumps in one sample, and goes on as it went before."""
    steps = np.abs(np.diff(values))
    rows = np.flatnonzero(steps[1:-1] > np.maximum(_least(values), ALONE * np.maximum(steps[:-2], steps[2:]))) + 1
    return rows.astype(np.int64)
