"""Cycles of a periodic test: the run of whole cycles that repeat, and their average.

A record may begin at rest, ramp in and out, drift, and end inside a cycle; the run holds only whole cycles that
repeat. A record without period (a road, a sweep) has no run, and neither has one whose average cycle would remove
motion (two tones without a common period, a beat). Order: the period (`pzd.signals.period`), its refinement on the
shift between cycles, the edges of the run point by point, and the test of what averaging removes.
"""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from pzd.record import MAD_TO_SIGMA, Array, Record
from pzd.signals.harmonics import MAINS
from pzd.signals.measures import found_once, resolution, usual_step
from pzd.signals.period import PeriodicSection, periodic_section
from pzd.signals.smoothing import HIGHEST, low_pass
from pzd.signals.splines import cubic, integral

FITTED_POINTS = 1000
"""Fewest points of a cycle in the fit of the period, as far as there are samples."""
REFINEMENTS = 6
"""Most rounds of the refinement of the period; each squares the error."""
SETTLED = 1e-8
"""Shift from cycle to cycle, as a share of the period, at which the refinement ends: a thousandth of the distance of
two samples over a hundred cycles of a thousand."""
CORNER = 3
"""Points at either end of the cycle left out of the fit of the period: there may be the corner of a start from rest."""
MAINS_BAND = 0.5
"""Half width of the band around a mains frequency [Hz]: its wander, and the blur by the ends of a run."""
MAINS_PER_CYCLE = 20.0
"""Least ratio of a cycle to the period of the mains at which both can be told apart."""
FEWEST_CYCLES = 1.99
"""Fewest cycles of a run: two, but for rounding."""
MARGIN = 0.1
"""Distance of the run from the end of the section, as a share of a cycle, where there is so much to spare."""

NEARLY_WHOLE = 0.05
"""Samples that a cycle may lack of a whole number of them and have it.

Reason: periods are found to a hundred-thousandth. With a point fewer than samples, as 999.99 rounded down has, the
points pass from sample to sample, and the spline between two smooths white noise by an eighth."""


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
        """Frequency of the cycles [Hz]."""
        return 1.0 / self.period

    @property
    def end(self) -> float:
        """Time at which the last repeating cycle ends [s]."""
        return self.start + self.count * self.period

    def inside(self, time: Array) -> NDArray[np.bool_]:
        """Return the mask (n,) of the samples inside the run."""
        rounding = 1e-9 * self.period
        return (time >= self.start - rounding) & (time < self.end - rounding)

    def phase(self, time: Array) -> Array:
        """Return the position (n,) in the cycle, 0 <= phase < 1, also outside the run."""
        return np.mod((time - self.start) / self.period, 1.0)

    def number(self, time: Array) -> NDArray[np.int64]:
        """Return the index (n,) of the cycle of each sample, -1 outside the run."""
        index = np.floor((time - self.start) / self.period + 1e-9).astype(np.int64)
        return np.where(self.inside(time), index, -1)

    def whole(self, time: Array, wanted: NDArray[np.bool_]) -> list[int]:
        """Return the indices of the cycles all of whose samples are in the mask (n,)."""
        number = self.number(time)
        return [j for j in range(self.count) if np.all(wanted[number == j])]

    def points(self, time: Array) -> int:
        """Return the number of samples in one cycle, rounded down unless nearly whole: the length of a folded cycle."""
        return max(int(np.floor(self.period / usual_step(time) + NEARLY_WHOLE)), 4)

    @found_once
    def fold(self, time: Array, values: Array) -> Array:
        """Interpolate values (n,) by a cubic spline at the points of the cycles, one row a cycle (count, points)."""
        instants = self.instants(time)
        # A spline forgets in a few samples: eight beyond the run are as good as all, and cheaper.
        reach = 8 * (time[1] - time[0])
        # A view: a copy of the clock of a long record for each channel would be kept with what is known of it.
        first = np.searchsorted(time, instants[0, 0] - reach)
        near = slice(first, np.searchsorted(time, instants[-1, -1] + reach, "right"))
        return cubic(time[near], values[near])(instants)

    @found_once
    def instants(self, time: Array) -> Array:
        """Return the times (count, points) of the points of the cycles [s]."""
        points = self.points(time)
        steps = np.arange(self.count * points) / points
        return (self.start + steps * self.period).reshape(self.count, points)

    def mean(self, time: Array, values: Array) -> Array:
        """Return the average cycle (points,)."""
        return np.asarray(self.fold(time, values).mean(axis=0))


def cycles(time: Array, displacement: Array) -> Cycles | None:
    """Find the longest run of cycles that repeat.

    Parameters
    ----------
    time : (n,) strictly increasing, nearly regular [s]
    displacement : (n,) of any shape: sine, triangle, a road driven twice [any unit]

    Returns
    -------
    the run, its period refined on the shift between cycles; None where no two whole cycles repeat, or where their
    average would remove motion

    Examples
    --------
    >>> t = np.arange(4000) / 1000.0
    >>> run = cycles(t, np.sin(2.0 * np.pi * 2.0 * t))
    >>> run.count, round(run.frequency, 6)
    (8, 2.0)
    """
    found = periodic_section(time, displacement)
    if found is None:
        return None
    run = _refined_run(time, displacement, found)
    if run.count >= ENOUGH_CYCLES:
        folded, ends = run.fold(time, displacement), 0
    else:
        folded, ends = _smoothed(run, time, displacement)
    folded = _without_hum(folded - drift_over_cycles(folded), run.period)[:, ends : folded.shape[1] - ends]
    return None if departure_from_mean_cycle(folded, resolution(displacement)) > LARGEST_DEPARTURE else run


_cycles_by_record: WeakKeyDictionary[Record, Cycles | None] = WeakKeyDictionary()
"""Cycles found so far. Arrays of a record are never modified, and an entry goes with its record."""


def cycles_of(record: Record) -> Cycles | None:
    """Return the longest run of cycles that repeat in a record, found once; see `cycles`."""
    if record not in _cycles_by_record:
        _cycles_by_record[record] = cycles(record.time, record.displacement)
    return _cycles_by_record[record]


def remember_cycles(record: Record, run: Cycles | None) -> None:
    """Store the cycles of a record that were found elsewhere, perhaps in another process."""
    _cycles_by_record[record] = run


def settled_cycles(run: Cycles, time: Array, force: Array) -> Cycles:
    """Find the cycles of a run in which the force repeats as well, without the transient at its ends.

    After a rest or a ramp the oil spring is loaded first: one cycle has the motion of the others, not yet the force.

    Parameters
    ----------
    run : of the displacement, at a constant voltage
    time : (n,) of the record [s]
    force : (n,) [N]

    Returns
    -------
    the same run where its force repeats throughout, or where fewer than two cycles would remain
    """
    span = _repeating_span(time, force, run.period, (run.start, run.end), SAME_FORCE)
    if span != (run.start, run.end) and span[1] - span[0] >= FEWEST_CYCLES * run.period:
        run = _whole_cycles(time, PeriodicSection(run.period, *span), run.period)
    if run.count > 2 and _begins_with_transient(run.fold(time, force)):
        # A transient of a few samples, which the running median of `_repeating_span` takes for a spike.
        return Cycles(run.period, run.start + run.period, run.count - 1)
    return run


def _begins_with_transient(folded: Array) -> bool:
    """Decide whether the first points of the first of three cycles (count, points) or more differ from the others'.

    Where the recorder starts in full motion and the oil spring is loaded within milliseconds.
    """
    later = folded[1:] - drift_over_cycles(folded)[1:]
    head = max(folded.shape[1] // TRANSIENT_PART, 2)
    first = np.abs(folded[0] - drift_over_cycles(folded)[0] - later.mean(axis=0))
    scatter = np.abs(later - later.mean(axis=0)).max(axis=0)
    beside = np.max([np.roll(scatter, shift) for shift in range(-2, 3)], axis=0)
    noise = MAD_TO_SIGMA * float(np.median(first))
    least = max(NOISE_DEVIATIONS * noise, SAME_FORCE * float(np.ptp(later)))
    return bool(np.any(first[:head] > np.maximum(LIKE_OTHERS * beside[:head], least)))


def _smoothed(run: Cycles, time: Array, displacement: Array) -> tuple[Array, int]:
    """Return the smoothed cycles (count, points), and the number of points at either end of a cycle to leave out.

    A start from rest is as quick as noise: smoothed with it, the motion would keep its noise. A run may begin a
    little before the motion does.
    """
    ends = max(CORNER, run.points(time) // 50)
    shut_out = ends * run.period / run.points(time)
    inside = (time >= run.start + shut_out) & (time <= run.end - shut_out)
    return run.fold(time[inside], low_pass(displacement[inside], HIGHEST)), ends


def _without_hum(folded: Array, period: float) -> Array:
    """Remove the lines of the mains and their harmonics from cycles (count, points), with which they are never in step.

    In slow tests a hum of a hundredth of a millimetre is as quick as the motion. A stand drives no test at just these
    frequencies besides one so much slower.
    """
    if period * min(MAINS) < MAINS_PER_CYCLE:
        return folded
    spectrum = np.fft.rfft(folded.ravel())
    frequency = np.arange(spectrum.size) / (len(folded) * period)
    for mains in MAINS:
        order = np.maximum(np.round(frequency / mains), 1.0)
        spectrum[np.abs(frequency - order * mains) < MAINS_BAND * order] = 0.0
    return np.fft.irfft(spectrum, folded.size).reshape(folded.shape)


# --- Refinement of the period ---


def _refined_run(time: Array, displacement: Array, found: PeriodicSection) -> Cycles:
    """Refine the edges of the run and its period in turn, since either needs the other."""
    coarse, x = decimated_means(time, displacement, found.period, FITTED_POINTS)
    run = _fitted_period(time, coarse, x, found)
    for _ in range(EDGE_ROUNDS):
        start, end = _repeating_span(time, displacement, run.period, (found.start, found.end), SAME_DISPLACEMENT)
        if (start, end) == (found.start, found.end) or end - start < FEWEST_CYCLES * run.period:
            break
        found = PeriodicSection(run.period, start, end)
        run = _fitted_period(time, coarse, x, found)
    return run


def _fitted_period(time: Array, coarse: Array, displacement: Array, found: PeriodicSection) -> Cycles:
    """Fit the period to few cycles first, so that the shift never exceeds a small part of the cycle."""
    run = _whole_cycles(time, found, found.period)
    course = cubic(coarse, displacement)
    for round_number in range(REFINEMENTS):
        used = Cycles(run.period, run.start, min(run.count, 3 * 4**round_number))
        shift = _shift_per_cycle(used, course(used.instants(coarse)))
        run = _whole_cycles(time, found, run.period + shift)
        if used.count == run.count and abs(shift) < SETTLED * run.period:
            break
    return run


def _whole_cycles(time: Array, found: PeriodicSection, period: float) -> Cycles:
    """Place whole cycles at the end of the repeating section, the first starting on a sample.

    The remainder goes to the front, where a transient may linger; a little of it keeps the run off the end.
    """
    step = usual_step(time)
    end = min(found.end, float(time[-1]) + step)
    count = max(int((end - found.start + 0.5 * step) / period), 2)
    left_over = max(end - found.start - count * period, 0.0)
    end -= min(0.5 * left_over, MARGIN * period)
    first = int(np.searchsorted(time, end - count * period - 0.5 * step))
    return Cycles(period, float(time[first]), count)


def _shift_per_cycle(run: Cycles, folded: Array) -> float:
    """Estimate by how much each cycle is later than the last [s], by least squares on the average cycle.

    Equation: shift_i = - sum((x_i - m) m') / sum(m'^2), m the average cycle      Source: first-order Taylor series
    """
    order = np.arange(run.count, dtype=np.float64) - (run.count - 1) / 2.0
    folded = folded - drift_over_cycles(folded)
    average: Array = folded.mean(axis=0)
    slope = np.asarray((np.roll(average, -1) - np.roll(average, 1)) * average.size / (2.0 * run.period))
    # Where the run begins and ends it may touch the corner of a start from rest, which no cubic follows.
    touched = min(CORNER, average.size // 20)
    slope[:touched] = slope[average.size - touched :] = 0.0
    slope[touched : average.size - touched] -= slope.sum() / (average.size - 2 * touched)
    shifts = -(folded - average) @ slope / float(slope @ slope)
    return float(order @ shifts / (order @ order))


def drift_over_cycles(folded: Array) -> Array:
    """Estimate the slow drift (count, points): a parabola through the means of the cycles, whatever their shape.

    Parameters
    ----------
    folded : (count, points) one row a cycle
    """
    order = np.arange(len(folded)) - (len(folded) - 1) / 2.0
    degree = min(order.size - 1, 2)
    phase = (np.arange(folded.shape[1]) - 0.5 * (folded.shape[1] - 1)) / folded.shape[1]
    powers = np.vander(order / order[-1], degree + 1)
    coefficients = np.linalg.lstsq(powers, folded.mean(axis=1), rcond=None)[0]
    return np.polyval(coefficients, (order[:, None] + phase) / order[-1])


# --- Edges of the run ---
#
# The search for the period compares whole cycles, which hide a departure in their last tenth: its run reaches into the
# ramp or the rest that follows. Here each point is compared with the one a period later, and the outer cycles are cut
# where that difference exceeds what it is in the rest of the run.

Span = tuple[float, float]
"""Start and end [s]."""
COMPARED_POINTS = 100
"""Points of a cycle that are compared, as far as there are samples."""
MEDIAN_WINDOW = 5
"""Points of the running median of the difference: a spike of the sensor is no ramp."""
STANDS_OUT = 5.0
"""Multiple of the median difference that is a departure: 3.4 standard deviations of normal noise."""
LIKE_OTHERS = 4.0
"""Multiple of the lower quartile of the differences at the same phase that a departure exceeds as well."""
SAME_DISPLACEMENT = 1e-3
"""Difference of the displacement that always counts as repeating, as a share of its range."""
SAME_FORCE = 2e-3
"""Difference of the force that always counts as repeating, as a share of its range."""
EDGE_ROUNDS = 4
"""Most cycles cut off at either end."""
TRANSIENT_PART = 10
"""Part of a cycle at its beginning in which a transient is looked for: the running median hides less than 1/20."""
NOISE_DEVIATIONS = 5.0
"""Standard deviations of the noise that a transient exceeds: one of a hundred samples does so once in 10^4 records."""


def decimated_means(time: Array, values: Array, period: float, points: int) -> tuple[Array, Array]:
    """Thin a record to at least so many points a cycle and both its ends, each the mean of the samples around it."""
    every = max(int(period / usual_step(time)) // points, 1)
    at = np.append(np.arange(0, time.size - 1, every), time.size - 1)
    reach = np.minimum(every // 2, np.minimum(at, time.size - 1 - at))
    sums = np.concatenate(([0.0], np.cumsum(values - values[0])))
    return time[at], values[0] + (sums[at + reach + 1] - sums[at - reach]) / (2 * reach + 1)


def _repeating_span(time: Array, values: Array, period: float, span: Span, same: float) -> Span:
    """Find the part of a span in which a channel repeats point by point.

    Parameters
    ----------
    time : (n,) [s]
    values : (n,) displacement or force
    period : of the motion [s]
    span : where the motion repeats, roughly [s]
    same : difference that always counts as repeating, as a share of the range
    """
    start, end = span
    for _ in range(EDGE_ROUNDS):
        course, points = _means_over_period_parts(time, values, period, (start, end))
        departure = _change_per_period(course, points)
        if departure.size < MEDIAN_WINDOW:
            break
        first, last = _inner_points(departure > _repeat_limit(departure, points, same * float(np.ptp(course))), points)
        if (first, last) == (0, departure.size):
            break
        end = end if last == departure.size else start + (last + points) * period / points
        start += first * period / points
    return start, end


def _means_over_period_parts(time: Array, values: Array, period: float, span: Span) -> tuple[Array, int]:
    """Return the means of the values over equal parts of the period, and the number of parts in a cycle."""
    step = usual_step(time)
    points = min(COMPARED_POINTS, max(int(period / step + 1e-6), 4))
    start, end = max(span[0], float(time[0])), min(span[1], float(time[-1]))
    width = period / points
    parts = np.arange(max(int((end - start) / width + 1e-6), 0) + 1, dtype=np.float64)
    bounds: Array = start + parts * width
    near = (time >= start - 8 * step) & (time <= end + 8 * step)
    return np.asarray(np.diff(integral(time[near], values[near])(bounds)) / width), points


def _change_per_period(course: Array, points: int) -> Array:
    """Return the magnitude (m,) of the difference to one period later, drift taken off, as a running median."""
    from scipy.ndimage import median_filter

    difference = course[points:] - course[:-points]
    if difference.size < MEDIAN_WINDOW:
        return difference
    return np.asarray(median_filter(np.abs(difference - _robust_line(difference)), MEDIAN_WINDOW, mode="mirror"))


def _robust_line(values: Array) -> Array:
    """Return the line (n,) through the medians of both halves, on which the ends have no influence."""
    half = values.size // 2
    early, late = float(np.median(values[:half])), float(np.median(values[-half:]))
    slope = (late - early) / (values.size - half)
    return np.asarray(0.5 * (early + late) + slope * (np.arange(values.size) - 0.5 * (values.size - 1)))


def _repeat_limit(departure: Array, points: int, least: float) -> Array:
    """Return the largest difference (m,) that counts as repeating, larger where equal cycles differ (corners)."""
    rows = -(-departure.size // points)
    table = np.full(rows * points, np.inf)
    table[: departure.size] = departure
    table = np.sort(table.reshape(rows, points), axis=0)
    known = np.sum(np.isfinite(table), axis=0)
    others = np.where(known > 1, table[(known - 1) // 4, np.arange(points)], 0.0)
    near = np.max([np.roll(others, shift) for shift in range(-2, 3)], axis=0)
    return np.maximum(LIKE_OTHERS * np.resize(near, departure.size), max(STANDS_OUT * np.median(departure), least))


def _inner_points(bad: NDArray[np.bool_], points: int) -> tuple[int, int]:
    """Return the first point after a departure in the first cycle, and the first departure in the last cycle."""
    middle = bad.size // 2
    early = np.flatnonzero(bad[: min(points, middle)])
    behind = max(bad.size - points, middle)
    late = np.flatnonzero(bad[behind:])
    return (int(early[-1]) + 1 if early.size else 0), (behind + int(late[0]) if late.size else bad.size)


# --- Motion that averaging removes ---
#
# Two tones without a common period look alike from one cycle to the next, and yet their average holds but one of them.
# Noise differs between neighbouring cycles as much as between distant ones; a second tone, a beat or a growing
# amplitude differs least between some neighbours. Two or three cycles do not show that: there the smoothed motion is
# compared, which has next to no noise.

LARGEST_DEPARTURE = 0.03
"""Largest departure from the average cycle, as a share of the r.m.s. motion or of its r.m.s. change within a part of
the cycle: the closed loops of the measured stands wander by up to 0.027, a second tone of 2 % begins at 0.03."""
NEIGHBOURING_CYCLES = 4
"""Largest lag [cycles] at which cycles are compared: a second tone is nearly in phase again by then."""
CYCLE_PARTS = (64, 16, 4)
"""Parts of a cycle over which changes of the motion are compared, so that quick motion of small size counts."""
SIGNIFICANT_ERRORS = 5.0
"""Standard errors by which a departure has to exceed the noise."""
ENOUGH_CYCLES = 4
"""Fewest cycles whose neighbours tell a second tone from noise."""
INDEPENDENT_SAMPLES = 20
"""Fewest independent samples in a cycle of coloured noise."""


def departure_from_mean_cycle(folded: Array, step: float = 0.0) -> float:
    """Compute the share of a motion beyond noise that an average over its cycles removes.

    Equation: P - min_l D_l / 2 - q^2 / 12 with P = n / (n - 1) mean (x_j - mean x)^2, D_l = mean (x_(j+l) - x_j)^2
              Source: von Neumann 1941; noise that no cycle shares with another has P = D_l / 2 at every l;
              Bennett 1948 for steps q, which some neighbours meet alike

    Parameters
    ----------
    folded : (n, points) displacement, one row a cycle, slow drift taken off; smoothed where n < ENOUGH_CYCLES
    step : of the channel, in its unit

    Returns
    -------
    r.m.s. as a share of that of the motion, the largest over the motion and its changes within parts of a cycle; 0
    within the noise
    """
    points = folded.shape[1]
    lengths = [points // part for part in CYCLE_PARTS if points >= 2 * part]
    rounding = step**2 / 12.0
    changes = (_excess_scatter(folded[:, apart:] - folded[:, :-apart], 2.0 * rounding) for apart in lengths)
    return max((_excess_scatter(folded, rounding), *changes))


def _excess_scatter(cycles: Array, rounding: float) -> float:
    """Return the scatter of cycles (n, points) about their mean beyond noise, in r.m.s. as a share of the motion.

    Parameters
    ----------
    cycles : (n, points)
    rounding : variance by the steps of the channel
    """
    count = len(cycles)
    scatter = float(np.mean((cycles - cycles.mean(axis=0)) ** 2)) * count / (count - 1)
    lags = range(1, min(NEIGHBOURING_CYCLES, count - 1) + 1) if count >= ENOUGH_CYCLES else ()
    noise = min((0.5 * float(np.mean((cycles[lag:] - cycles[:-lag]) ** 2)) for lag in lags), default=0.0)
    excess = scatter - noise - rounding
    if excess <= SIGNIFICANT_ERRORS * noise * np.sqrt(3.0 / (count * INDEPENDENT_SAMPLES)):
        return 0.0
    return float(np.sqrt(excess / np.mean((cycles - cycles.mean()) ** 2)))
