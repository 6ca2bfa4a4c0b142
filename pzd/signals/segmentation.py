"""Segmentation of a record into tests: segments of equal cycles, between which amplitude or frequency steps."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from weakref import WeakKeyDictionary

import numpy as np

from pzd.record import Array, Record, sliced
from pzd.signals.measures import found_once

LEAST_CYCLES = 3
"""Fewest equal cycles of a segment: two may be equal by chance in a beat."""
SEGMENT_SCATTER = 0.04
"""Largest relative scatter of amplitude and period in a segment: half a beat or a sweep scatters by more."""
LEAST_STEP = 0.1
"""Least relative change of amplitude or frequency between two tests."""
LONGEST_TRANSITION = 2
"""Most cycles between two tests; a longer transition is a ramp."""
HYSTERESIS = 0.05
"""A cycle begins where the motion rises through its median by this share of the range: noise crosses it repeatedly."""


@dataclass(frozen=True)
class Segment:
    """Consecutive cycles of one amplitude and period."""

    first: int
    """Number of the first cycle in the record."""
    last: int
    """Number of the last cycle."""
    start: float
    """Time at which the first cycle begins [s]."""
    end: float
    """Time at which the last cycle ends [s]."""
    amplitude: float
    """Median amplitude [m]."""
    period: float
    """Median period [s]."""

    def change(self, other: Segment) -> float:
        """Return the relative change of amplitude or of period, the larger of both."""
        pairs = (self.amplitude, other.amplitude), (self.period, other.period)
        return max(max(pair) / min(pair) for pair in pairs) - 1.0


@found_once
def steps_between_tests(time: Array, displacement: Array) -> tuple[tuple[Segment, Segment], ...]:
    """Find the steps from one test to the next without a pause, and return the segments on either side of each.

    A beat, a sweep and a growing amplitude change from cycle to cycle and have no segments; a ramp takes more cycles
    than a step.

    Parameters
    ----------
    time : (n,) strictly increasing [s]
    displacement : (n,) [m]
    """
    return tuple(
        (before, after)
        for before, after in pairwise(_segments(time, displacement))
        if before.change(after) >= LEAST_STEP and after.first - before.last - 1 <= LONGEST_TRANSITION
    )


_tests_by_record: WeakKeyDictionary[Record, tuple[Record, ...]] = WeakKeyDictionary()
"""Tests of records that hold several. Of a record with one test an empty tuple: a value must not keep its key alive."""


def separate_tests(record: Record) -> tuple[Record, ...]:
    """Split a record into the tests that it holds, each under its name; a single test is the record itself.

    The first test begins and the last ends with the record; the transition between two belongs to neither. Every call
    returns the same objects, so that what is cached by record (`pzd.signals.cycles.cycles_of`) is computed once.
    """
    if record not in _tests_by_record:
        _tests_by_record[record] = _split_into_tests(record)
    return _tests_by_record[record] or (record,)


def _split_into_tests(record: Record) -> tuple[Record, ...]:
    """Return the tests of a record that holds several, else an empty tuple."""
    steps = steps_between_tests(record.time, record.displacement)
    found = sorted({segment for pair in steps for segment in pair}, key=lambda s: s.first)
    if not found:
        return ()
    starts = [-np.inf, *(s.start for s in found[1:])]
    ends = [*(s.end for s in found[:-1]), np.inf]
    return tuple(
        sliced(record, (record.time >= start) & (record.time < end)) for start, end in zip(starts, ends, strict=True)
    )


def _segments(time: Array, displacement: Array) -> list[Segment]:
    """Find the segments of equal cycles, each as long as possible, in their order."""
    starts, amplitudes, periods = _crossing_cycles(time, displacement)
    found: list[Segment] = []
    first = 0
    while first <= amplitudes.size - LEAST_CYCLES:
        last = first
        while last + 1 < amplitudes.size and all(_equal(v[first : last + 2]) for v in (amplitudes, periods)):
            last += 1
        if last - first + 1 >= LEAST_CYCLES:
            rows = slice(first, last + 1)
            amplitude, period = float(np.median(amplitudes[rows])), float(np.median(periods[rows]))
            found.append(Segment(first, last, float(starts[first]), float(starts[last + 1]), amplitude, period))
            first = last + 1
        else:
            first += 1
    return found


def _crossing_cycles(time: Array, x: Array) -> tuple[Array, Array, Array]:
    """Return the starts of the cycles (n + 1,) [s], their amplitudes (n,) [m] and periods (n,) [s]."""
    middle, least = float(np.median(x)), HYSTERESIS * float(np.ptp(x))
    state = np.where(x > middle + 0.5 * least, 1, np.where(x < middle - 0.5 * least, -1, 0))
    known = np.flatnonzero(state)
    rises = known[1:][(state[known[1:]] == 1) & (state[known[:-1]] == -1)]
    if rises.size < 2:
        return np.empty(0), np.empty(0), np.empty(0)
    pieces = [x[first:last] for first, last in pairwise(rises)]
    return time[rises], np.array([0.5 * float(np.ptp(piece)) for piece in pieces]), np.diff(time[rises])


def _equal(values: Array) -> bool:
    """Tell whether positive values scatter by no more than the admissible share of their median."""
    scatter = float(np.ptp(values))
    # The minimum is no more than the median and cheaper: it decides nearly always.
    return scatter <= SEGMENT_SCATTER * float(values.min()) or scatter <= SEGMENT_SCATTER * float(np.median(values))
