"""Where the repeating of a periodic test begins and ends, point by point.

The search for the period compares whole cycles, and a whole cycle hides a departure in its last
tenth: the run it finds reaches into the ramp or the rest that follows. Here each point is compared
with the one a period later, and the outer cycles are cut where that difference stands out of what
it is in the rest of the run.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pzd.record import Array
from pzd.signals.step import usual_step

Span = tuple[float, float]
"""Start and end [s]."""
POINTS = 100
"""Points of a cycle that are compared, as far as there are samples."""
NEIGHBOURS = 5
"""A point departs with most of this many neighbours: a spike of the sensor is no ramp."""
STANDS_OUT = 5.0
"""A departure counts from this many times the median on: 3.4 standard deviations of normal noise."""
LIKE_OTHERS = 4.0
"""It has to be this many times the lower quartile of the differences at the same phase as well."""
SAME_MOTION = 1e-3
"""A difference of the displacement that always counts as repeating, as a share of its range."""
SAME_FORCE = 2e-3
"""The same of the force."""
ROUNDS = 4
"""Cycles at most that are cut into at either end."""


def averaged(time: Array, values: Array, period: float, points: int) -> tuple[Array, Array]:
    """So many points a cycle or some more, both ends of the record among them, averaged with the samples around."""
    every = max(int(period / usual_step(time)) // points, 1)
    at = np.unique(np.append(np.arange(0, time.size, every), time.size - 1))
    reach = np.minimum(every // 2, np.minimum(at, time.size - 1 - at))
    sums = np.concatenate(([0.0], np.cumsum(values - values[0])))
    return time[at], values[0] + (sums[at + reach + 1] - sums[at - reach]) / (2 * reach + 1)


def motion_span(time: Array, displacement: Array, period: float, span: Span) -> Span:
    """The part of a span in which the displacement repeats point by point.

    Parameters
    ----------
    time : (n,) [s]
    displacement : (n,)
    period : [s]
    span : roughly where it repeats [s]
    """
    return _cut(time, displacement, period, span, SAME_MOTION)


def force_span(time: Array, force: Array, period: float, span: Span) -> Span:
    """The part of a span of repeating motion in which the force repeats as well.

    After a rest or a ramp the oil spring has to be wound up first: one cycle of motion is like the
    others and its force is not yet.
    """
    return _cut(time, force, period, span, SAME_FORCE)


def _cut(time: Array, values: Array, period: float, span: Span, same: float) -> Span:
    start, end = span
    for _ in range(ROUNDS):
        course, points = _course(time, values, period, (start, end))
        departure = _departure(course, points)
        if departure.size < NEIGHBOURS:
            break
        first, last = _inner(departure > _limit(departure, points, same * float(np.ptp(course))), points)
        if (first, last) == (0, departure.size):
            break
        end = end if last == departure.size else start + (last + points) * period / points
        start += first * period / points
    return start, end


def _course(time: Array, values: Array, period: float, span: Span) -> tuple[Array, int]:
    """Averages of the values over equal parts of the period, and how many of these make a cycle."""
    from scipy.interpolate import CubicSpline

    step = usual_step(time)
    points = min(POINTS, max(int(period / step + 1e-6), 4))
    start, end = max(span[0], float(time[0])), min(span[1], float(time[-1]))
    width = period / points
    bounds = start + np.arange(max(int((end - start) / width + 1e-6), 0) + 1) * width
    near = (time >= start - 8 * step) & (time <= end + 8 * step)
    integral = CubicSpline(time[near], values[near]).antiderivative()
    return np.asarray(np.diff(integral(bounds)) / width), points


def _departure(course: Array, points: int) -> Array:
    """Size (m,) of the difference to one period later, its drift taken off, the median of neighbours."""
    from scipy.ndimage import median_filter

    difference = course[points:] - course[:-points]
    if difference.size < NEIGHBOURS:
        return difference
    return np.asarray(median_filter(np.abs(difference - _line(difference)), NEIGHBOURS, mode="mirror"))


def _line(values: Array) -> Array:
    """The line (n,) through the medians of both halves, which the ends do not pull."""
    half = values.size // 2
    early, late = float(np.median(values[:half])), float(np.median(values[-half:]))
    slope = (late - early) / (values.size - half)
    return np.asarray(0.5 * (early + late) + slope * (np.arange(values.size) - 0.5 * (values.size - 1)))


def _limit(departure: Array, points: int, least: float) -> Array:
    """Largest difference (m,) that repeats: where equal cycles differ most, as at a corner, more is allowed."""
    rows = -(-departure.size // points)
    table = np.full(rows * points, np.inf)
    table[: departure.size] = departure
    table = np.sort(table.reshape(rows, points), axis=0)
    known = np.sum(np.isfinite(table), axis=0)
    others = np.where(known > 1, table[(known - 1) // 4, np.arange(points)], 0.0)
    near = np.max([np.roll(others, shift) for shift in range(-2, 3)], axis=0)
    return np.maximum(LIKE_OTHERS * np.resize(near, departure.size), max(STANDS_OUT * np.median(departure), least))


def _inner(bad: NDArray[np.bool_], points: int) -> tuple[int, int]:
    """First point after a departure in the first cycle, and the first departure in the last."""
    middle = bad.size // 2
    early = np.flatnonzero(bad[: min(points, middle)])
    behind = max(bad.size - points, middle)
    late = np.flatnonzero(bad[behind:])
    return (int(early[-1]) + 1 if early.size else 0), (behind + int(late[0]) if late.size else bad.size)
