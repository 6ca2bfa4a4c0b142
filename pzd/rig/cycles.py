"""The cycles of a periodic test: its period, and the run of cycles that repeat.

A record may begin at rest, ramp in and out, drift, and end inside a cycle; the run found
here holds only whole cycles that repeat. A record without one (a road, a sweep) has None.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pzd.rig.period import Repeats, repeats

Array = NDArray[np.float64]

REFINED_POINTS = 100
"""Samples in a cycle that the refinement of the period looks at, more being no better."""
REFINEMENTS = 6
"""Rounds of the refinement of the period; each squares the error."""


@dataclass(frozen=True)
class Cycles:
    """A run of whole cycles that repeat."""

    period: float
    """Length of one cycle [s]."""
    start: float
    """Time at which the first repeating cycle begins, a sample of the record [s]."""
    count: int
    """Number of whole cycles in the run, at least two."""

    @property
    def frequency(self) -> float:
        """Cycles per second [Hz]."""
        return 1.0 / self.period

    @property
    def end(self) -> float:
        """Time at which the last repeating cycle ends [s]."""
        return self.start + self.count * self.period

    def inside(self, time: Array) -> NDArray[np.bool_]:
        """Mask (n,) of the samples inside the run."""
        rounding = 1e-9 * self.period
        return (time >= self.start - rounding) & (time < self.end - rounding)

    def phase(self, time: Array) -> Array:
        """Position (n,) in the cycle, 0 <= phase < 1, also outside the run."""
        return np.mod((time - self.start) / self.period, 1.0)

    def number(self, time: Array) -> NDArray[np.int64]:
        """Index (n,) of the cycle that each sample belongs to, -1 outside the run."""
        index = np.floor((time - self.start) / self.period + 1e-9).astype(np.int64)
        return np.where(self.inside(time), index, -1)

    def points(self, time: Array) -> int:
        """Samples in one cycle, rounded down: the length of a folded cycle."""
        return max(int(np.floor(self.period / float(np.median(np.diff(time))) + 1e-6)), 4)

    def fold(self, time: Array, values: Array) -> Array:
        """One row a cycle (count, points), from a cubic through the samples."""
        points = self.points(time)
        steps = np.arange(self.count * points) / points
        return _cubic(time, values, self.start + steps * self.period).reshape(self.count, points)

    def mean(self, time: Array, values: Array) -> Array:
        """The average cycle (points,)."""
        average: Array = self.fold(time, values).mean(axis=0)
        return average


def cycles(time: Array, displacement: Array) -> Cycles | None:
    """The longest run of cycles that repeat, or None where no two whole cycles do.

    Parameters
    ----------
    time : (n,) strictly increasing, nearly regular [s]
    displacement : (n,) of any shape: sine, triangle, a road driven twice [any unit]

    Returns
    -------
    the run, with the period refined on the shift between its cycles
    """
    found = repeats(time, displacement)
    return None if found is None else _refined(time, displacement, found)


def _refined(time: Array, displacement: Array, found: Repeats) -> Cycles:
    """Refine the period on few cycles first, so that a shift never exceeds a small part of the cycle."""
    run = _whole(time, found, found.period)
    every = max(run.points(time) // REFINED_POINTS, 1)
    for round_number in range(REFINEMENTS):
        used = Cycles(run.period, run.start, min(run.count, 3 * 4**round_number))
        run = _whole(time, found, run.period + _shift_per_cycle(time[::every], displacement[::every], used))
    return run


def _whole(time: Array, found: Repeats, period: float) -> Cycles:
    """Whole cycles up to the end of the repeating section, the first starting on a sample."""
    step = float(np.median(np.diff(time)))
    end = min(found.end, float(time[-1]) + step)
    count = max(int((end - found.start + 0.5 * step) / period), 2)
    first = int(np.searchsorted(time, end - count * period - 0.5 * step))
    return Cycles(period, float(time[first]), count)


def _shift_per_cycle(time: Array, displacement: Array, run: Cycles) -> float:
    """How much later each cycle comes than the last [s], by least squares on the average cycle.

    Equation: shift_i = - sum((x_i - m) m') / sum(m'^2), m the average cycle      Source: first-order Taylor series
    """
    folded = run.fold(time, displacement)
    folded = folded - folded.mean(axis=1, keepdims=True)
    average = folded.mean(axis=0)
    slope = (np.roll(average, -1) - np.roll(average, 1)) * average.size / (2.0 * run.period)
    shifts = -(folded - average) @ slope / float(slope @ slope)
    order = np.arange(run.count) - (run.count - 1) / 2.0
    return float(order @ shifts / (order @ order))


def _cubic(time: Array, values: Array, at: Array) -> Array:
    from scipy.interpolate import CubicSpline

    near = (time >= at[0] - 8 * (time[1] - time[0])) & (time <= at[-1] + 8 * (time[1] - time[0]))
    result: Array = CubicSpline(time[near], values[near])(at)
    return result
