"""Whether one record holds several tests: the amplitude or the frequency steps between stretches that repeat."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pzd.artefacts import Finding
from pzd.record import Array
from pzd.rig.preflight import Measured

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
class _Stretch:
    """Cycles that are alike."""

    first: int
    last: int
    amplitude: float
    period: float


def check(test: Measured) -> list[Finding]:
    """A stepwise change of amplitude or frequency between stretches of three or more cycles alike."""
    starts, amplitudes, periods = _cycles_of(test.record.time, test.clean.displacement)
    stretches = _stretches(amplitudes, periods)
    found: list[Finding] = []
    for before, after in pairwise(stretches):
        change = max(_ratio(before.amplitude, after.amplitude), _ratio(before.period, after.period)) - 1.0
        if change < STEP or after.first - before.last - 1 > BETWEEN:
            continue
        at, old, new = starts[after.first], _told(before), _told(after)
        found.append(
            Finding(
                check="steps",
                where=f"displacement, {old} until {starts[before.last + 1]:.4g} s, {new} from {at:.4g} s",
                size=change,
                unit="-",
                follows="two tests in one record: label each in a column of its own, and say split: {column: ...}",
            )
        )
    return found


def _told(stretch: _Stretch) -> str:
    return f"{1e3 * stretch.amplitude:.3g} mm at {1.0 / stretch.period:.3g} Hz"


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


def _stretches(amplitudes: Array, periods: Array) -> list[_Stretch]:
    """The stretches of cycles alike, each as long as it can be, in their order."""
    found: list[_Stretch] = []
    first = 0
    while first <= amplitudes.size - LEAST_CYCLES:
        last = first
        while last + 1 < amplitudes.size and _alike(amplitudes[first : last + 2], periods[first : last + 2]):
            last += 1
        if last - first + 1 >= LEAST_CYCLES:
            rows = slice(first, last + 1)
            found.append(_Stretch(first, last, float(np.median(amplitudes[rows])), float(np.median(periods[rows]))))
            first = last + 1
        else:
            first += 1
    return found


def _alike(amplitudes: Array, periods: Array) -> bool:
    return all(float(np.ptp(values)) <= ALIKE * float(np.median(values)) for values in (amplitudes, periods))
