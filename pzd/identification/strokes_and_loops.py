"""Strokes and loops of single tests: the kind of motion, work per cycle, and the equivalent viscous damper.

A stroke runs from one reversal to the next and is examined by itself, so that neither the name of the waveform, nor the
number of repetitions, nor rests between strokes matter. A loop is the average cycle of force over displacement.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from pzd.artefacts import MeasureRow
from pzd.artefacts.identified import Kind
from pzd.artefacts.rig import SAME_SET_VALUE, same_motion
from pzd.identification.prepared_record import warm_up
from pzd.parallel.processes import parallel_map
from pzd.record import SAME_TEMPERATURE, Array, Record, is_constant, voltage_scale
from pzd.signals.cycles import Cycles, cycles_of, settled_cycles
from pzd.signals.measures import one_record, reversals, work
from pzd.signals.segmentation import separate_tests

# --- Strokes ---

STRAIGHT_PART = (0.2, 0.8)
"""Shares of the stroke between which a test of constant speed keeps its speed: an actuator reverses in the rest."""
MIDDLE_PART = (0.4, 0.6)
"""Shares of the stroke between which its force is read: far from the reversal, after which the oil spring loads."""
STRAIGHT_PIECES = 4
"""Pieces of equal length of the straight part, whose speeds are compared."""
CONSTANT_SPEED = 0.03
"""Largest relative deviation of a constant speed from its mean; that of a sine changes by 5 % over these pieces, and
stays within it for a sixth of its cycle."""
SINUSOIDAL = 0.03
"""Largest r.m.s. deviation of a sine from half a cosine, as a share of stroke: a crank has 0.02, a triangle 0.07."""
AROUND_PEAK = 0.7
"""Part of the stroke around its middle in which the peak speed of a sine is sought."""
BESIDE_PEAK = 0.4
"""Half width of the parabola for the force at the peak, as a share of half that time: 18 degrees of a sine."""
SMOOTHNESS = 0.005
"""Largest r.m.s. deviation from the polynomial around the middle, as a share of the stroke, with a single peak."""
LEAST_FULLNESS = 0.05
"""Least work of a cycle, as a share of its stroke times the range of its force, of a rod that slips.

Reason: friction fills the whole, damping pi/4, an oil spring nothing; beside a gas spring of twenty times the friction
neither would be read anyway."""
FEWEST_POINTS = 6
"""Fewest samples for a fit over a part of a stroke."""


@dataclass(frozen=True, eq=False)
class Stroke:
    """Motion and force from one reversal to the next, in SI units; every array is (n,)."""

    time: Array
    displacement: Array
    force: Array

    @property
    def rebound(self) -> bool:
        """Whether the damper extends."""
        return bool(self.displacement[-1] > self.displacement[0])

    @property
    def length(self) -> float:
        """Distance from end to end [m]."""
        return float(np.ptp(self.displacement))

    @property
    def middle(self) -> float:
        """Displacement at mid-stroke [m]."""
        return 0.5 * float(self.displacement.min() + self.displacement.max())

    @cached_property
    def kind(self) -> Kind | None:
        """Kind of the motion; None where its speed has no clear peak, or there are too few samples."""
        if self._constant():
            return "constant velocity"
        if self.time[self._around_middle].size < FEWEST_POINTS or not self._has_one_peak():
            return None
        return "sine" if self._sinusoidal() else "other swing"

    def at_peak(self) -> tuple[float, float]:
        """Return speed [m/s] and force [N] where the stroke is fastest: at constant speed, at mid-stroke.

        Equation: v from a straight line, or a polynomial of degree five, through x; F from one through F
                                                                    Source: least squares
        """
        if self.kind == "constant velocity":
            part = self.between(*STRAIGHT_PART)
            x, t = self.displacement[part], self.time[part]
            inner = self.between(*MIDDLE_PART)
            force = _value_at_zero(self.displacement[inner] - self.middle, self.force[inner], 1)
            return float(np.polyfit(t - t[0], x, 1)[0]), force
        course, half = self._course
        fastest = _steepest_place(course)
        near = self._around_middle
        s = (self.time[near] - self.time[near][0]) / half - 1.0 - fastest
        nearest = np.argsort(np.abs(s), kind="stable")
        nearest = nearest[: max(int(np.sum(np.abs(s) <= BESIDE_PEAK)), FEWEST_POINTS)]
        return float(course.deriv()(fastest)) / half, _value_at_zero(s[nearest], self.force[near][nearest], 2)

    @cached_property
    def _around_middle(self) -> slice:
        """Samples around mid-stroke."""
        return self.between(0.5 - 0.5 * AROUND_PEAK, 0.5 + 0.5 * AROUND_PEAK)

    @cached_property
    def _course(self) -> tuple[np.polynomial.Polynomial, float]:
        """Return the displacement around mid-stroke [m] over time from -1 to 1, and half of that time [s]."""
        t, x = self.time[self._around_middle], self.displacement[self._around_middle]
        half = 0.5 * float(t[-1] - t[0])
        return np.polynomial.Polynomial.fit((t - t[0]) / half - 1.0, x, 5, domain=(-1.0, 1.0)), half

    def _has_one_peak(self) -> bool:
        """Tell whether the motion around mid-stroke is smooth, and fastest inside and not at its ends."""
        course, half = self._course
        t, x = self.time[self._around_middle], self.displacement[self._around_middle]
        left = x - course((t - t[0]) / half - 1.0)
        return bool(np.sqrt(np.mean(left**2)) <= SMOOTHNESS * self.length) and abs(_steepest_place(course)) < 1.0

    def between(self, low: float, high: float) -> slice:
        """Return the samples between two shares of the stroke, counted from its beginning."""
        path = np.abs(self.displacement - self.displacement[0]) / abs(self.displacement[-1] - self.displacement[0])
        first = int(np.argmax(path >= low))
        return slice(first, first + int(np.argmax(np.append(path[first:], 2.0) > high)))

    def _constant(self) -> bool:
        """Tell whether the speed is constant in the straight part."""
        shares = np.linspace(*STRAIGHT_PART, STRAIGHT_PIECES + 1)
        parts = [self.between(low, high) for low, high in pairwise(shares)]
        if any(part.stop - part.start < FEWEST_POINTS // 2 for part in parts):
            return False
        speeds = np.array([np.polyfit(self.time[p] - self.time[p][0], self.displacement[p], 1)[0] for p in parts])
        return bool(np.all(np.abs(speeds / speeds.mean() - 1.0) <= CONSTANT_SPEED))

    def _sinusoidal(self) -> bool:
        """Tell whether the stroke is half a cosine."""
        share = (self.time - self.time[0]) / (self.time[-1] - self.time[0])
        first, last = self.displacement[0], self.displacement[-1]
        ideal = first + (last - first) * 0.5 * (1.0 - np.cos(np.pi * share))
        return bool(np.sqrt(np.mean((self.displacement - ideal) ** 2)) <= SINUSOIDAL * self.length)


def _value_at_zero(x: Array, values: Array, degree: int) -> float:
    """Return the value at x = 0 of the least-squares polynomial through values (n,) over x (n,)."""
    return float(np.polynomial.Polynomial.fit(x, values, degree)(0.0))


def _steepest_place(course: np.polynomial.Polynomial) -> float:
    """Return the place from -1 to 1 of the steepest slope."""
    fine = np.linspace(-1.0, 1.0, 2001)
    return float(fine[np.argmax(np.abs(course.deriv()(fine)))])


SHORT_STROKE = 0.7
"""Least stroke, as a share of that of the record: a shorter one is a start, a stop or a return."""
RECOGNISED_SHARE = 0.8
"""Least share of the path of a record in strokes of constant speed: otherwise it is another motion."""
CLOSURE = 0.02
"""Largest distance between the ends of a record of a single cycle, as a share of its stroke."""
MID_STROKE_SPEED = 0.1
"""Speed, as a share of the largest, above which a single cycle begins within a stroke and not at a reversal."""


def strokes_of(time: Array, displacement: Array, force: Array) -> list[Stroke]:
    """Return the whole strokes between reversals, the ends of the record among them.

    Parameters
    ----------
    time, displacement, force : (n,) of one record [s], [m], [N]

    Returns
    -------
    those of `SHORT_STROKE` of the record's and more, in their order
    """
    turns = sorted({0, *reversals(displacement), displacement.size - 1})
    found = [
        Stroke(time[first : last + 1], displacement[first : last + 1], force[first : last + 1])
        for first, last in pairwise(turns)
        if last - first > 2
    ]
    whole = SHORT_STROKE * float(np.ptp(displacement))
    return [stroke for stroke in found if abs(stroke.displacement[-1] - stroke.displacement[0]) >= whole]


@dataclass(frozen=True, eq=False)
class Cycle:
    """One closed cycle from its lowest point on, rebound first, in SI units; every array is (n,)."""

    time: Array
    displacement: Array
    velocity: Array
    force: Array
    period: float


@dataclass(frozen=True, eq=False)
class SpeedTest:
    """Strokes of one kind and, at constant speed, of one speed."""

    kind: Kind
    strokes: tuple[Stroke, ...]
    cycle: Cycle | None
    """Average cycle, where the motion repeats."""

    @property
    def slips(self) -> bool:
        """Whether the rod slips: a test that only strains the oil spring does no work, and hides friction and gas.

        Equation: W / (L range F) >= LEAST_FULLNESS, W work of a stroke each way, L its length; 1 of dry friction
        """
        force = np.concatenate([stroke.force for stroke in self.strokes])
        middle = force.mean()

        def mean_work(*, rebound: bool) -> float:
            each = [work(s.displacement, s.force - middle) for s in self.strokes if s.rebound == rebound]
            return float(np.mean(each)) if each else 0.0

        length = float(np.mean([stroke.length for stroke in self.strokes]))
        whole = mean_work(rebound=True) + mean_work(rebound=False)
        return whole >= LEAST_FULLNESS * length * float(np.ptp(force))


def speed_tests(record: Record) -> tuple[SpeedTest, ...]:
    """Find the tests of force over speed in a record of constant control signal; none where it holds another motion.

    Parameters
    ----------
    record : one test, several of them without a pause, or strokes of several speeds one after another
    """
    return tuple(found for part in separate_tests(record) for found in _tests_of_one_motion(part))


def _tests_of_one_motion(record: Record) -> list[SpeedTest]:
    """Find the tests in a record of one motion."""
    cycle = settled_cycle(record)
    if cycle is None:
        strokes = strokes_of(record.time, record.displacement, record.force)
        return _tests_of_constant_speed(strokes, None)
    strokes = strokes_of(cycle.time, cycle.displacement, cycle.force)
    kinds = {stroke.kind for stroke in strokes}
    if len(strokes) == 2 and kinds <= {"sine", "other swing"}:
        return [SpeedTest("sine" if kinds == {"sine"} else "other swing", tuple(strokes), cycle)]
    return _tests_of_constant_speed(strokes, cycle if len(strokes) == 2 else None)


def _tests_of_constant_speed(strokes: Sequence[Stroke], cycle: Cycle | None) -> list[SpeedTest]:
    """Group strokes of constant speed into one test for each speed, slowest first."""
    constant = [stroke for stroke in strokes if stroke.kind == "constant velocity"]
    if sum(s.length for s in constant) < RECOGNISED_SHARE * sum(s.length for s in strokes):
        return []
    bands: list[list[tuple[float, Stroke]]] = []
    for speed, stroke in sorted(((abs(s.at_peak()[0]), s) for s in constant), key=lambda pair: pair[0]):
        if bands and same_motion(bands[-1][0][0], speed):
            bands[-1].append((speed, stroke))
        else:
            bands.append([(speed, stroke)])
    return [SpeedTest("constant velocity", tuple(stroke for _, stroke in band), cycle) for band in bands]


def settled_cycle(record: Record) -> Cycle | None:
    """Return the average of the cycles in which motion and force repeat, or the only cycle of a closed record."""
    run = cycles_of(record)
    if run is None:
        return _single_cycle(record)
    run = settled_cycles(run, record.time, record.force)
    x, v, f = (run.mean(record.time, values) for values in (record.displacement, record.velocity, record.force))
    return _cycle_from_lowest(np.arange(x.size) * run.period / x.size, x, v, f, run.period)


def _single_cycle(record: Record) -> Cycle | None:
    """Return the cycle of a record of one cycle, as a damper dyno saves it, whatever the phase at its beginning."""
    x, closed = record.displacement, CLOSURE * float(np.ptp(record.displacement))
    path = float(np.sum(np.abs(np.diff(x))))
    if len(reversals(x)) > 2 or abs(x[-1] - x[0]) > closed or abs(path - 2.0 * np.ptp(x)) > 2.0 * closed:
        return None
    speed = 0.5 * float(record.velocity[0] + record.velocity[-1])
    last, gap = x.size, 1.0 / record.rate
    if abs(speed) > MID_STROKE_SPEED * float(np.max(np.abs(record.velocity))):
        # It begins within a stroke: what goes beyond its first place at the end belongs to the next cycle.
        last = int(np.flatnonzero(np.sign(speed) * (x - x[0]) < 0.0)[-1]) + 1
        gap = float(x[0] - x[last - 1]) / speed
    time, velocity, force = (values[:last] for values in (record.time, record.velocity, record.force))
    return _cycle_from_lowest(time - time[0], x[:last], velocity, force, float(time[-1] - time[0]) + gap)


def _cycle_from_lowest(time: Array, displacement: Array, velocity: Array, force: Array, period: float) -> Cycle:
    """Return a cycle from its lowest point on."""
    first = int(np.argmin(displacement))
    later = np.concatenate((time[first:], time[:first] + period)) - time[first]
    x, v, f = (np.roll(values, -first) for values in (displacement, velocity, force))
    # The last sample is the first one again, so that the stroke back is whole.
    x, v, f = (np.append(values, values[0]) for values in (x, v, f))
    return Cycle(np.append(later, period), x, v, f, period)


# --- Loops: work per cycle, equivalent damping, dynamic range ---

SPEED_WINDOWS = 16
"""Windows in a cycle in which a constant speed is sought: long against noise, short against a stroke."""
CONSTANT_SPEED_SHARE = 0.5
"""Least share of the cycle in which a test of constant speed keeps it."""


def measures(records: Sequence[Record], jobs: int = 1) -> tuple[MeasureRow, ...]:
    """Compute the measures of every test, in the order of the records; each test of a record has a row of its name.

    So many records are worked on at the same time.
    """
    scale = voltage_scale(records)

    def of_one(record: Record) -> list[MeasureRow]:
        constant = is_constant(record, scale)
        with one_record():
            return [_measures_row(test, constant) for test in (separate_tests(record) if constant else (record,))]

    rows = [row for of_record in parallel_map(of_one, records, jobs, first_here=True) for row in of_record]
    alike = _SameTests(rows)
    return tuple(row.model_copy(update={"dynamic_range": _dynamic_range(row, alike.to(row))}) for row in rows)


@dataclass(frozen=True)
class Loop:
    """A closed loop of displacement, speed and force (n,), or a record without one after its warm-up, in SI units."""

    displacement: Array
    velocity: Array
    force: Array
    step: float
    closed: bool
    frequency: float | None
    cycles: float
    """Number of cycles that the arrays cover."""


def loop_of(record: Record) -> Loop:
    """Return the average cycle of a record where its motion repeats, else all of it after the warm-up."""
    run = cycles_of(record)
    if run is None:
        start = warm_up(record.displacement)
        turns = len([i for i in reversals(record.displacement) if i >= start])
        return Loop(
            record.displacement[start:],
            record.velocity[start:],
            record.force[start:],
            1.0 / record.rate,
            False,
            None,
            max(0.5 * turns, 0.5),
        )
    if run.count >= 4:  # the outer cycles may still hold the start and the stop
        run = Cycles(run.period, run.start + run.period, run.count - 2)
    displacement, velocity, force = (
        run.mean(record.time, channel) for channel in (record.displacement, record.velocity, record.force)
    )
    return Loop(displacement, velocity, force, run.period / displacement.size, True, run.frequency, 1.0)


def equivalent_damping(work_done: float, velocity: Array, step: float) -> float:
    """Compute the viscous coefficient that does the same work under the same motion.

    Equation: c_eq = W / integral of v^2 dt      Source: definition

    Parameters
    ----------
    work_done : W [J]
    velocity : (n,) speed over the same path [m/s]
    step : sampling interval [s]

    Returns
    -------
    c_eq [N s/m]

    Examples
    --------
    >>> v = np.sin(np.linspace(0.0, 2.0 * np.pi, 1000, endpoint=False))  # of a viscous damper of 50 N s/m
    >>> round(equivalent_damping(float(50.0 * v @ v) * 0.001, v, 0.001), 9)
    50.0
    """
    return work_done / (float(velocity @ velocity) * step)


def force_at_rest(velocity: Array, force: Array, closed: bool) -> float:
    """Compute the mean of abs(F) where the speed passes through zero [N]; 0 where it never does.

    Parameters
    ----------
    velocity, force : (n,) [m/s], [N]
    closed : whether the last sample is followed by the first, as in an average cycle
    """
    if closed:
        velocity, force = np.append(velocity, velocity[0]), np.append(force, force[0])
    before = np.flatnonzero((velocity[:-1] >= 0.0) != (velocity[1:] >= 0.0))
    if before.size == 0:
        return 0.0
    share = velocity[before] / (velocity[before] - velocity[before + 1])
    return float(np.mean(np.abs(force[before] + share * (force[before + 1] - force[before]))))


def peak_speed(loop: Loop) -> float:
    """Return the largest speed of a test, or the speed of one at constant speed [m/s].

    A speed that steps at every reversal overshoots there by 9 % and more when made of a limited number of harmonics
    (Gibbs), and so does the noise of a slow test: the constant part is the speed that was driven.
    """
    largest = float(np.max(np.abs(loop.velocity)))
    points = loop.displacement.size
    width = points // SPEED_WINDOWS
    if not loop.closed or width == 0:
        return largest
    apart = np.abs(np.roll(loop.displacement, -width) - loop.displacement) / (width * loop.step)
    level = float(np.median(apart))
    constant = np.count_nonzero(np.abs(apart - level) <= CONSTANT_SPEED * level) >= CONSTANT_SPEED_SHARE * points
    return level if constant else largest


def _measures_row(record: Record, still: bool) -> MeasureRow:
    """Return the measures of one test, without its dynamic range."""
    loop = loop_of(record)
    total = work(loop.displacement, loop.force, loop.closed)
    return MeasureRow(
        record=record.name,
        setting=record.setting,
        voltage_V=record.median_voltage() if still else None,
        temperature_degC=record.median_temperature(),
        frequency_Hz=loop.frequency,
        amplitude_m=0.5 * float(np.ptp(loop.displacement)),
        peak_velocity_m_per_s=peak_speed(loop),
        peak_force_N=float(np.max(np.abs(loop.force))),
        force_at_zero_velocity_N=force_at_rest(loop.velocity, loop.force, loop.closed),
        work_per_cycle_J=total / loop.cycles,
        equivalent_damping_Ns_per_m=equivalent_damping(total, loop.velocity, loop.step),
        dynamic_range=None,
    )


class _SameTests:
    """Search for tests of equal motion among many: by setting and speed first, since of a thousand few are equal."""

    def __init__(self, rows: Sequence[MeasureRow]) -> None:
        self.rows: dict[str | None, list[tuple[float, int, MeasureRow]]] = {}
        for number, row in enumerate(rows):
            if row.voltage_V is not None and row.frequency_Hz is not None:
                self.rows.setdefault(row.setting, []).append((row.peak_velocity_m_per_s, number, row))
        for of_setting in self.rows.values():
            of_setting.sort(key=lambda entry: entry[:2])

    def to(self, row: MeasureRow) -> list[MeasureRow]:
        """Return the periodic tests that are the same but for the voltage, in the order of the rows."""
        speed, of_setting = row.peak_velocity_m_per_s, self.rows.get(row.setting, [])
        low = bisect_left(of_setting, speed * (1.0 - 2.0 * SAME_SET_VALUE), key=lambda entry: entry[0])
        high = bisect_right(of_setting, speed * (1.0 + 2.0 * SAME_SET_VALUE), key=lambda entry: entry[0])
        return [r for _, _, r in sorted(of_setting[low:high], key=lambda entry: entry[1]) if _same_test(r, row)]


def _dynamic_range(row: MeasureRow, others: Sequence[MeasureRow]) -> float | None:
    """Return the peak force over that at the lowest voltage, at the same speed, setting and temperature."""
    if row.voltage_V is None or row.frequency_Hz is None:
        return None
    lowest = min(others, key=lambda r: r.voltage_V or 0.0)
    if lowest.voltage_V == max(r.voltage_V or 0.0 for r in others):
        return None
    return row.peak_force_N / lowest.peak_force_N


def _same_test(a: MeasureRow, b: MeasureRow) -> bool:
    """Tell whether two tests have the same temperature, speed and stroke."""
    speeds = a.peak_velocity_m_per_s, b.peak_velocity_m_per_s
    strokes = a.amplitude_m, b.amplitude_m
    warm = abs((a.temperature_degC or 0.0) - (b.temperature_degC or 0.0)) <= SAME_TEMPERATURE
    return warm and same_motion(*speeds) and same_motion(*strokes)
