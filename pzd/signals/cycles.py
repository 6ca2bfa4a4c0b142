"""The cycles of a periodic test: its period, and the run of cycles that repeat.

A record may begin at rest, ramp in and out, drift, and end inside a cycle; the run found
here holds only whole cycles that repeat. A record without one (a road, a sweep) has None, and so
has one whose average cycle would take away more than noise (two tones, a beat).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pzd.record import Array
from pzd.signals.departure import FEW, TOLERATED, departure
from pzd.signals.edges import ROUNDS, averaged, force_span, motion_span
from pzd.signals.mains import MAINS
from pzd.signals.period import Repeats, repeats
from pzd.signals.smoothing import HIGHEST, low_pass
from pzd.signals.step import usual_step

FITTED_POINTS = 1000
"""Points of a cycle that the period is fitted to, at least, as far as there are samples."""
REFINEMENTS = 6
"""Rounds of the refinement of the period; each squares the error."""
CORNER = 3
"""Points at either end of the cycle that the period is not fitted to."""
MAINS_BAND = 0.5
"""Either side of a mains frequency, what it wanders by and what the ends of a run blur [Hz]."""
SLOW = 20.0
"""The mains are told from the motion where their period is so many times shorter than a cycle."""
TWO = 1.99
"""Fewer cycles than these make no run."""
MARGIN = 0.1
"""Share of a cycle by which the run keeps off the end of the section, where there is so much to spare."""


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

    def whole(self, time: Array, wanted: NDArray[np.bool_]) -> list[int]:
        """Indices of the cycles all of whose samples are wanted, (n,)."""
        number = self.number(time)
        return [j for j in range(self.count) if np.all(wanted[number == j])]

    def points(self, time: Array) -> int:
        """Samples in one cycle, rounded down: the length of a folded cycle."""
        return max(int(np.floor(self.period / usual_step(time) + 1e-6)), 4)

    def fold(self, time: Array, values: Array) -> Array:
        """One row a cycle (count, points), from a cubic through the samples."""
        instants = self.instants(time)
        reach = 8 * (time[1] - time[0])
        near = (time >= instants[0, 0] - reach) & (time <= instants[-1, -1] + reach)
        return _cubic(time[near], values[near])(instants)

    def instants(self, time: Array) -> Array:
        """Times (count, points) of the points of the cycles [s]."""
        points = self.points(time)
        steps = np.arange(self.count * points) / points
        return (self.start + steps * self.period).reshape(self.count, points)

    def mean(self, time: Array, values: Array) -> Array:
        """The average cycle (points,)."""
        average: Array = self.fold(time, values).mean(axis=0)
        return average


def cycles(time: Array, displacement: Array) -> Cycles | None:
    """The longest run of cycles that repeat, or None where no two whole cycles do or their average takes motion away.

    Parameters
    ----------
    time : (n,) strictly increasing, nearly regular [s]
    displacement : (n,) of any shape: sine, triangle, a road driven twice [any unit]

    Returns
    -------
    the run, with the period refined on the shift between its cycles
    """
    found = repeats(time, displacement)
    if found is None:
        return None
    run = _refined(time, displacement, found)
    if run.count >= FEW:
        folded, ends = run.fold(time, displacement), 0
    else:
        folded, ends = _smoothed(run, time, displacement)
    folded = _without_hum(folded - drift(folded), run.period)
    return None if departure(folded[:, ends : folded.shape[1] - ends]) > TOLERATED else run


def _smoothed(run: Cycles, time: Array, displacement: Array) -> tuple[Array, int]:
    """(count, points) of the run alone smoothed, and how many points at either end of a cycle count for nothing.

    A start out of rest is as quick as noise: smoothed with it, the motion would keep its noise. A run may begin a
    little before the motion does.
    """
    ends = max(CORNER, run.points(time) // 50)
    shut_out = ends * run.period / run.points(time)
    inside = (time >= run.start + shut_out) & (time <= run.end - shut_out)
    return run.fold(time[inside], low_pass(displacement[inside], HIGHEST)), ends


def _without_hum(folded: Array, period: float) -> Array:
    """(count, points) the same without what the mains make of it: no motion, and never in step with the cycles.

    In slow tests a hum of a hundredth of a millimetre is as quick as the motion. A stand drives no test at just these
    frequencies besides one so much slower.
    """
    if period * min(MAINS) < SLOW:
        return folded
    spectrum = np.fft.rfft(folded.ravel())
    frequency = np.arange(spectrum.size) / (len(folded) * period)
    for mains in MAINS:
        order = np.maximum(np.round(frequency / mains), 1.0)
        spectrum[np.abs(frequency - order * mains) < MAINS_BAND * order] = 0.0
    return np.fft.irfft(spectrum, folded.size).reshape(folded.shape)


def settled(run: Cycles, time: Array, force: Array) -> Cycles:
    """The cycles of a run whose force repeats as well: at a constant voltage, the transient at its ends left out.

    Parameters
    ----------
    run : of the displacement
    time : (n,) of the record [s]
    force : (n,) [N]

    Returns
    -------
    the same run where its force repeats throughout, or where fewer than two cycles would remain
    """
    span = force_span(time, force, run.period, (run.start, run.end))
    if span == (run.start, run.end) or span[1] - span[0] < TWO * run.period:
        return run
    return _whole(time, Repeats(run.period, *span), run.period)


def _refined(time: Array, displacement: Array, found: Repeats) -> Cycles:
    """Find the edges of the run and its period in turn: either needs the other."""
    coarse, x = averaged(time, displacement, found.period, FITTED_POINTS)
    run = _fitted(time, coarse, x, found)
    for _ in range(ROUNDS):
        start, end = motion_span(time, displacement, run.period, (found.start, found.end))
        if (start, end) == (found.start, found.end) or end - start < TWO * run.period:
            break
        found = Repeats(run.period, start, end)
        run = _fitted(time, coarse, x, found)
    return run


def _fitted(time: Array, coarse: Array, displacement: Array, found: Repeats) -> Cycles:
    """Fit the period to few cycles first, so that a shift never exceeds a small part of the cycle."""
    run = _whole(time, found, found.period)
    course = _cubic(coarse, displacement)
    for round_number in range(REFINEMENTS):
        used = Cycles(run.period, run.start, min(run.count, 3 * 4**round_number))
        run = _whole(time, found, run.period + _shift_per_cycle(used, course(used.instants(coarse))))
    return run


def _whole(time: Array, found: Repeats, period: float) -> Cycles:
    """Whole cycles at the end of the repeating section, the first starting on a sample.

    What is left over goes to the front, where a transient may linger; a little of it keeps the run from the end.
    """
    step = usual_step(time)
    end = min(found.end, float(time[-1]) + step)
    count = max(int((end - found.start + 0.5 * step) / period), 2)
    left_over = max(end - found.start - count * period, 0.0)
    end -= min(0.5 * left_over, MARGIN * period)
    first = int(np.searchsorted(time, end - count * period - 0.5 * step))
    return Cycles(period, float(time[first]), count)


def _shift_per_cycle(run: Cycles, folded: Array) -> float:
    """How much later each cycle comes than the last [s], by least squares on the average cycle.

    Equation: shift_i = - sum((x_i - m) m') / sum(m'^2), m the average cycle      Source: first-order Taylor series
    """
    order = np.arange(run.count, dtype=np.float64) - (run.count - 1) / 2.0
    folded = folded - drift(folded)
    average: Array = folded.mean(axis=0)
    slope = np.asarray((np.roll(average, -1) - np.roll(average, 1)) * average.size / (2.0 * run.period))
    # Where the run begins and ends it may touch the corner of a start out of rest, which no cubic follows.
    touched = min(CORNER, average.size // 20)
    slope[:touched] = slope[average.size - touched :] = 0.0
    slope[touched : average.size - touched] -= slope.sum() / (average.size - 2 * touched)
    shifts = -(folded - average) @ slope / float(slope @ slope)
    return float(order @ shifts / (order @ order))


def drift(folded: Array) -> Array:
    """Slow drift (count, points), a parabola that the means of the cycles show and their shape has no part in.

    Parameters
    ----------
    folded : (count, points) one row a cycle
    """
    order = np.arange(len(folded)) - (len(folded) - 1) / 2.0
    degree = min(order.size - 1, 2)
    phase = (np.arange(folded.shape[1]) - 0.5 * (folded.shape[1] - 1)) / folded.shape[1]
    course = np.polynomial.Polynomial.fit(order, folded.mean(axis=1), degree)
    found: Array = course(order[:, None] + phase)
    return found


def _cubic(time: Array, values: Array) -> Callable[[Array], Array]:
    from scipy.interpolate import CubicSpline

    course: Callable[[Array], Array] = CubicSpline(time, values)
    return course
