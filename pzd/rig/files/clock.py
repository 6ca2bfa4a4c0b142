"""A regular clock whose stamps a file gives with few digits: the samples are where the clock was, not where it says.

At 512 Hz and stamps of 1 ms the steps are 1 and 2 ms; a speed derived over them would be wrong by as much.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pzd.quantities import TIME
from pzd.record import Array
from pzd.rig.files.sheet import ReadingStep
from pzd.rig.files.splitting import Test

FEWEST = 50
"""Fewer samples do not tell a rounded clock from one that wavers."""
FEWEST_OF_EACH = 10
"""Rounding makes two steps of one, multiples of the resolution that are neighbours, each so often at least.

Reason: a sample that was lost is a step of two as well, and evenly spaced only by chance from some of them on."""
ROUNDED_BY = 0.75
"""Of the resolution, how far a stamp may lie from the line through all.

Reason: rounding moves it by half the resolution to either side, and the line itself is found from rounded stamps."""
SAME_STEP = 1e-3
"""Steps that differ by less than this share of the usual one are the same, written with many digits."""


def on_regular_clock(test: Test) -> Test:
    """The test with the stamps of its clock unrounded; as it is where its clock shows no rounding.

    Parameters
    ----------
    test : its time rising
    """
    time = test.channels[TIME]
    unrounded = _unrounded(time)
    if unrounded is None:
        return test
    regular, resolution = unrounded
    rate = (time.size - 1) / (regular[-1] - regular[0])
    step = ReadingStep("clock", TIME.name, f"stamps rounded to {resolution:.3g} s", f"a regular clock of {rate:.6g} Hz")
    return replace(test, channels={**test.channels, TIME: regular}, steps=(*test.steps, step))


def _unrounded(time: Array) -> tuple[Array, float] | None:
    """(n,) instants of a regular clock [s] and the resolution [s] to which it is rounded; None without any.

    Equation: t_i = t_0 + i/f, least squares over all stamps
    """
    if time.size < FEWEST:
        return None
    steps = np.sort(np.diff(time))
    usual = float(steps[steps.size // 2])
    groups = np.split(steps, np.flatnonzero(np.diff(steps) > SAME_STEP * usual) + 1)
    shorter, longer = groups[0], groups[-1]
    if len(groups) != 2 or min(shorter.size, longer.size) < FEWEST_OF_EACH:
        return None
    resolution = float(longer.mean() - shorter.mean())
    order = np.arange(time.size)
    slope, begin = np.polyfit(order, time, 1)
    regular: Array = begin + slope * order
    if np.max(np.abs(time - regular)) > ROUNDED_BY * resolution:
        return None
    return regular, resolution
