"""Several tests in one record: stretches of cycles alike, between which the amplitude or the frequency steps."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from weakref import WeakKeyDictionary

import numpy as np

from pzd.record import Array, Record, sliced

LEAST_CYCLES = 3
"""Cycles alike from which a stretch is a test of its own."""
ALIKE = 0.04
"""Amplitudes and periods of one stretch scatter by no more than this share, half a beat or a sweep by more."""
STEP = 0.1
"""Change of amplitude or frequency from one stretch to the next that is another test."""
BETWEEN = 2
"""Cycles that the change may take; what takes longer is a ramp."""
HYSTERESIS = 0.05
"""A cycle begins where the motion rises through its middle by more than this share of the range."""


@dataclass(frozen=True)
class Stretch:
    """Cycles that are alike."""

    first: int
    """Number of its first cycle in the record."""
    last: int
    start: float
    """When its first cycle begins [s]."""
    end: float
    """When its last cycle ends [s]."""
    amplitude: float
    """[m]"""
    period: float
    """[s]"""

    def change(self, other: Stretch) -> float:
        """By what share amplitude or period differ, the larger of both."""
        return max(_ratio(self.amplitude, other.amplitude), _ratio(self.period, other.period)) - 1.0


def steps(time: Array, displacement: Array) -> tuple[tuple[Stretch, Stretch], ...]:
    """Where a record goes from one test to another without a pause: the stretches on either side of each step.

    A beat, a sweep and a growing amplitude change from cycle to cycle and have no stretches; a ramp takes more
    cycles than a step.

    Parameters
    ----------
    time : (n,) strictly increasing [s]
    displacement : (n,) [m]
    """
    return tuple(
        (before, after)
        for before, after in pairwise(_stretches(time, displacement))
        if before.change(after) >= STEP and after.first - before.last - 1 <= BETWEEN
    )


_apart: WeakKeyDictionary[Record, tuple[Record, ...]] = WeakKeyDictionary()
"""The tests of records that hold several, and none of those that hold one: what is kept must not hold its record."""


def separate_tests(record: Record) -> tuple[Record, ...]:
    """The tests that one record holds, each under its name; the record itself where it holds one.

    The first begins and the last ends with the record; what lies between two stretches belongs to neither. They are
    the same records whoever asks, so that what is remembered of one is found once.
    """
    if record not in _apart:
        _apart[record] = _found_in(record)
    return _apart[record] or (record,)


def _found_in(record: Record) -> tuple[Record, ...]:
    """The tests of a record that holds several."""
    found = sorted({s for pair in steps(record.time, record.displacement) for s in pair}, key=lambda s: s.first)
    if not found:
        return ()
    starts = [-np.inf, *(s.start for s in found[1:])]
    ends = [*(s.end for s in found[:-1]), np.inf]
    return tuple(
        sliced(record, (record.time >= start) & (record.time < end)) for start, end in zip(starts, ends, strict=True)
    )


def _ratio(one: float, other: float) -> float:
    return max(one, other) / min(one, other)


def _cycles_of(time: Array, x: Array) -> tuple[Array, Array, Array]:
    """Where the cycles begin (n + 1,) [s], their amplitudes (n,) [m] and periods (n,) [s]."""
    middle, least = float(np.median(x)), HYSTERESIS * float(np.ptp(x))
    state = np.where(x > middle + 0.5 * least, 1, np.where(x < middle - 0.5 * least, -1, 0))
    known = np.flatnonzero(state)
    rises = known[1:][(state[known[1:]] == 1) & (state[known[:-1]] == -1)]
    if rises.size < 2:
        return np.empty(0), np.empty(0), np.empty(0)
    pieces = [x[first:last] for first, last in pairwise(rises)]
    return time[rises], np.array([0.5 * float(np.ptp(piece)) for piece in pieces]), np.diff(time[rises])


def _stretches(time: Array, displacement: Array) -> list[Stretch]:
    """The stretches of cycles alike, each as long as it can be, in their order."""
    starts, amplitudes, periods = _cycles_of(time, displacement)
    found: list[Stretch] = []
    first = 0
    while first <= amplitudes.size - LEAST_CYCLES:
        last = first
        while last + 1 < amplitudes.size and _alike(amplitudes[first : last + 2], periods[first : last + 2]):
            last += 1
        if last - first + 1 >= LEAST_CYCLES:
            rows = slice(first, last + 1)
            amplitude, period = float(np.median(amplitudes[rows])), float(np.median(periods[rows]))
            found.append(Stretch(first, last, float(starts[first]), float(starts[last + 1]), amplitude, period))
            first = last + 1
        else:
            first += 1
    return found


def _alike(amplitudes: Array, periods: Array) -> bool:
    return all(_within(values) for values in (amplitudes, periods))


def _within(values: Array) -> bool:
    """Whether positive values scatter by no more than the share of their median, which is no less than the least."""
    scatter = float(np.ptp(values))
    return scatter <= ALIKE * float(values.min()) or scatter <= ALIKE * float(np.median(values))
