"""What a test of a damper usually shows: peak- and continuous-velocity plot, gas force, friction, step response."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from pzd.artefacts.identified import ContinuousVelocityRow, GasAndFrictionRow, Kind, Method, PeakVelocityRow
from pzd.artefacts.rig import same_motion
from pzd.record import Array, Condition, Record
from pzd.signals.cycles import cycles_of, settled
from pzd.signals.smoothing import reversals
from pzd.signals.stretches import separate_tests

# ----------------------------------------------------------------------------------------------------
# Strokes of the rod, and what they are: one of constant speed, half a cycle of a sine, or another smooth one.
#
# A stroke is looked at by itself, so that it does not matter what the waveform was called, how often it
# was repeated, or whether rests lie between the strokes.


STRAIGHT = (0.2, 0.8)
"""Shares of the stroke between which a test of constant speed holds it: an actuator needs the rest to turn round."""
MIDDLE = (0.4, 0.6)
"""Shares of the stroke between which its force is read: far from the reversal, after which the oil spring winds up."""
PARTS = 4
"""The straight part is cut into so many parts of equal way, whose speeds are compared."""
CONSTANT = 0.03
"""A speed stays constant within this share of its mean; that of a sine moves by 5 % over these parts."""
SINUSOIDAL = 0.03
"""R.m.s. deviation from half a cosine, as a share of the stroke: a slider-crank leaves 0.02, a triangle 0.07."""
AROUND_PEAK = 0.7
"""The peak speed of a sine is looked for within this share of the half stroke to either side of its middle."""
BESIDE_PEAK = 0.4
"""The force is read from a parabola over this share of that time to either side of the peak, 18 degrees of a sine."""
SMOOTH = 0.005
"""R.m.s. deviation from the polynomial around the middle, as a share of the stroke, up to which there is one peak."""
LEAST_POINTS = 6
"""Samples that a fit over a part of a stroke needs, at least."""


@dataclass(frozen=True, eq=False)
class Stroke:
    """The rod from one reversal to the next; every array is (n,)."""

    time: Array
    displacement: Array
    force: Array

    @property
    def rebound(self) -> bool:
        """Whether the damper extends."""
        return bool(self.displacement[-1] > self.displacement[0])

    @property
    def length(self) -> float:
        """Way from end to end [m]."""
        return float(np.ptp(self.displacement))

    @property
    def middle(self) -> float:
        """Displacement half way [m]."""
        return 0.5 * float(self.displacement.min() + self.displacement.max())

    @cached_property
    def kind(self) -> Kind | None:
        """What the motion is; None where its speed has no clear peak, or there are too few samples to say."""
        if self._constant():
            return "constant velocity"
        if self.time[self._around_middle].size < LEAST_POINTS or not self._has_one_peak():
            return None
        return "sine" if self._sinusoidal() else "other swing"

    def at_peak(self) -> tuple[float, float]:
        """Speed [m/s] and force [N] where the stroke is fastest.

        At constant speed that is the middle of the stroke, as anywhere in its straight part.

        Equation: v from a straight line, or a polynomial of degree five, through x; F from one through F
                                                                    Source: least squares, so that noise averages out
        """
        if self.kind == "constant velocity":
            part = self.between(*STRAIGHT)
            x, t = self.displacement[part], self.time[part]
            inner = self.between(*MIDDLE)
            force = _at(self.displacement[inner] - self.middle, self.force[inner], 1, 0.0)
            return float(np.polyfit(t - t[0], x, 1)[0]), force
        course, half = self._course()
        fastest = _fastest(course)
        near = self._around_middle
        s = (self.time[near] - self.time[near][0]) / half - 1.0 - fastest
        nearest = np.argsort(np.abs(s), kind="stable")
        nearest = nearest[: max(int(np.sum(np.abs(s) <= BESIDE_PEAK)), LEAST_POINTS)]
        return float(course.deriv()(fastest)) / half, _at(s[nearest], self.force[near][nearest], 2, 0.0)

    @cached_property
    def _around_middle(self) -> slice:
        return self.between(0.5 - 0.5 * AROUND_PEAK, 0.5 + 0.5 * AROUND_PEAK)

    def _course(self) -> tuple[np.polynomial.Polynomial, float]:
        """Displacement around the middle [m] over time from -1 to 1, and half of that time [s]."""
        t, x = self.time[self._around_middle], self.displacement[self._around_middle]
        half = 0.5 * float(t[-1] - t[0])
        return np.polynomial.Polynomial.fit((t - t[0]) / half - 1.0, x, 5, domain=(-1.0, 1.0)), half

    def _has_one_peak(self) -> bool:
        """Whether the motion around the middle is smooth, and fastest inside of it and not at its end."""
        course, half = self._course()
        t, x = self.time[self._around_middle], self.displacement[self._around_middle]
        left = x - course((t - t[0]) / half - 1.0)
        return bool(np.sqrt(np.mean(left**2)) <= SMOOTH * self.length) and abs(_fastest(course)) < 1.0

    def between(self, low: float, high: float) -> slice:
        """The samples between two shares of the way, counted from where the stroke begins."""
        way = np.abs(self.displacement - self.displacement[0]) / abs(self.displacement[-1] - self.displacement[0])
        first = int(np.argmax(way >= low))
        return slice(first, first + int(np.argmax(np.append(way[first:], 2.0) > high)))

    def _constant(self) -> bool:
        shares = np.linspace(*STRAIGHT, PARTS + 1)
        parts = [self.between(low, high) for low, high in pairwise(shares)]
        if any(part.stop - part.start < LEAST_POINTS // 2 for part in parts):
            return False
        speeds = np.array([np.polyfit(self.time[p] - self.time[p][0], self.displacement[p], 1)[0] for p in parts])
        return bool(np.all(np.abs(speeds / speeds.mean() - 1.0) <= CONSTANT))

    def _sinusoidal(self) -> bool:
        share = (self.time - self.time[0]) / (self.time[-1] - self.time[0])
        ideal = self.displacement[0] + (self.displacement[-1] - self.displacement[0]) * 0.5 * (
            1.0 - np.cos(np.pi * share)
        )
        return bool(np.sqrt(np.mean((self.displacement - ideal) ** 2)) <= SINUSOIDAL * self.length)


def _at(x: Array, values: Array, degree: int, place: float) -> float:
    """Value of the polynomial of a degree through (n,) values over (n,) x at a place."""
    return float(np.polynomial.Polynomial.fit(x, values, degree)(place))


def _fastest(course: np.polynomial.Polynomial) -> float:
    """Where from -1 to 1 a course has its steepest slope."""
    fine = np.linspace(-1.0, 1.0, 2001)
    return float(fine[np.argmax(np.abs(course.deriv()(fine)))])


# ----------------------------------------------------------------------------------------------------
# Which tests of force over speed a record holds: settled cycles of a stroke each way, or strokes of constant speed.


SHORT = 0.7
"""A stroke of less than this share of the record's stroke is a start, a stop or a return."""
RECOGNISED = 0.8
"""Share of the way of a record that must lie in strokes of constant speed, or it is another motion."""
CLOSED = 0.02
"""A record of a single cycle ends where it began, within this share of its stroke."""
MOVING = 0.1
"""Share of the largest speed from which a single cycle begins in the midst of a stroke, and not at a reversal."""


@dataclass(frozen=True, eq=False)
class Cycle:
    """One closed cycle from its lowest point on, rebound first; every array is (n,)."""

    time: Array
    displacement: Array
    velocity: Array
    force: Array
    period: float


@dataclass(frozen=True, eq=False)
class SpeedTest:
    """Strokes of one kind and, if it is constant, of one speed."""

    kind: Kind
    strokes: tuple[Stroke, ...]
    cycle: Cycle | None
    """Where the motion repeats."""


def speed_tests(record: Record) -> tuple[SpeedTest, ...]:
    """The tests of a record whose control signal stands still; none where it holds another motion.

    Parameters
    ----------
    record : one test, several of them without a pause, or strokes of several speeds one after another
    """
    return tuple(found for part in separate_tests(record) for found in _of_one(part))


def _of_one(record: Record) -> list[SpeedTest]:
    cycle = settled_cycle(record)
    if cycle is None:
        strokes = strokes_of(record.time, record.displacement, record.force)
        return _of_constant_speed(strokes, None)
    strokes = strokes_of(cycle.time, cycle.displacement, cycle.force)
    kinds = {stroke.kind for stroke in strokes}
    if len(strokes) == 2 and kinds <= {"sine", "other swing"}:
        return [SpeedTest("sine" if kinds == {"sine"} else "other swing", tuple(strokes), cycle)]
    return _of_constant_speed(strokes, cycle if len(strokes) == 2 else None)


def _of_constant_speed(strokes: Sequence[Stroke], cycle: Cycle | None) -> list[SpeedTest]:
    """One test for each speed, slowest first."""
    constant = [stroke for stroke in strokes if stroke.kind == "constant velocity"]
    if sum(s.length for s in constant) < RECOGNISED * sum(s.length for s in strokes):
        return []
    bands: list[list[tuple[float, Stroke]]] = []
    for speed, stroke in sorted(((abs(s.at_peak()[0]), s) for s in constant), key=lambda pair: pair[0]):
        if bands and same_motion(bands[-1][0][0], speed):
            bands[-1].append((speed, stroke))
        else:
            bands.append([(speed, stroke)])
    return [SpeedTest("constant velocity", tuple(stroke for _, stroke in band), cycle) for band in bands]


def settled_cycle(record: Record) -> Cycle | None:
    """The average of the cycles in which motion and force repeat, or the only cycle of a record that closes."""
    run = cycles_of(record)
    if run is None:
        return _single_cycle(record)
    run = settled(run, record.time, record.force)
    x, v, f = (run.mean(record.time, values) for values in (record.displacement, record.velocity, record.force))
    return _from_lowest(np.arange(x.size) * run.period / x.size, x, v, f, run.period)


def _single_cycle(record: Record) -> Cycle | None:
    """A record of one cycle, as a damper dyno saves it, whatever the phase in which it begins."""
    x, closed = record.displacement, CLOSED * float(np.ptp(record.displacement))
    way = float(np.sum(np.abs(np.diff(x))))
    if len(reversals(x)) > 2 or abs(x[-1] - x[0]) > closed or abs(way - 2.0 * np.ptp(x)) > 2.0 * closed:
        return None
    speed = 0.5 * float(record.velocity[0] + record.velocity[-1])
    last, gap = x.size, 1.0 / record.rate
    if abs(speed) > MOVING * float(np.max(np.abs(record.velocity))):
        # It begins in the midst of a stroke: what goes beyond its first place at the end is the next cycle.
        last = int(np.flatnonzero(np.sign(speed) * (x - x[0]) < 0.0)[-1]) + 1
        gap = float(x[0] - x[last - 1]) / speed
    time, velocity, force = (values[:last] for values in (record.time, record.velocity, record.force))
    return _from_lowest(time - time[0], x[:last], velocity, force, float(time[-1] - time[0]) + gap)


def _from_lowest(time: Array, displacement: Array, velocity: Array, force: Array, period: float) -> Cycle:
    first = int(np.argmin(displacement))
    later = np.concatenate((time[first:], time[:first] + period)) - time[first]
    x, v, f = (np.roll(values, -first) for values in (displacement, velocity, force))
    # The last sample is the first one again, so that the stroke back is whole.
    x, v, f = (np.append(values, values[0]) for values in (x, v, f))
    return Cycle(np.append(later, period), x, v, f, period)


def strokes_of(time: Array, displacement: Array, force: Array) -> list[Stroke]:
    """The whole strokes between reversals, ends of the record among them."""
    turns = sorted({0, *reversals(displacement), displacement.size - 1})
    found = [
        Stroke(time[first : last + 1], displacement[first : last + 1], force[first : last + 1])
        for first, last in pairwise(turns)
        if last - first > 2
    ]
    whole = SHORT * float(np.ptp(displacement))
    return [stroke for stroke in found if abs(stroke.displacement[-1] - stroke.displacement[0]) >= whole]


# ----------------------------------------------------------------------------------------------------
# The continuous-velocity plot (CVP): force over speed through the average settled cycle of each test.


POINTS = 100
"""Points of a cycle that are written: a curve looks round, and a file of many tests stays small."""


def continuous_velocity(
    condition: Condition, tests: Sequence[tuple[Record, SpeedTest]]
) -> tuple[ContinuousVelocityRow, ...]:
    """The cycle of every test that repeats, test by test in the order given.

    Parameters
    ----------
    condition : whose labels the rows carry
    tests : of the condition's records, each with its record
    """
    return tuple(row for record, test in tests if test.cycle for row in _rows(condition, record, test.cycle))


def _rows(condition: Condition, record: Record, cycle: Cycle) -> list[ContinuousVelocityRow]:
    # The last sample closes the cycle and is the first one again.
    channels = (thinned(values[:-1]) for values in (cycle.displacement, cycle.velocity, cycle.force))
    amplitude = 0.5 * float(np.ptp(cycle.displacement))
    return [
        ContinuousVelocityRow(
            record=record.name,
            setting=condition.setting,
            voltage_V=condition.voltage,
            temperature_degC=condition.temperature,
            frequency_Hz=1.0 / cycle.period,
            amplitude_m=amplitude,
            displacement_m=float(x),
            velocity_m_per_s=float(v),
            force_N=float(force),
        )
        for x, v, force in zip(*channels, strict=True)
    ]


def thinned(values: Array) -> Array:
    """Means of (n,) values over `POINTS` parts as equal as can be; the values themselves where there are no more."""
    if values.size <= POINTS:
        return values
    size, longer = divmod(values.size, POINTS)
    long, short = np.split(values, [longer * (size + 1)])
    return np.concatenate([part.reshape(-1, length).mean(axis=1) for part, length in ((long, size + 1), (short, size))])


# ----------------------------------------------------------------------------------------------------
# Gas force and friction: what is left of the force at mid-stroke when the speed goes to zero.
#
# Equation: F_gas = (F_r + F_c) / 2, F_friction = (F_r - F_c) / 2, both at v -> 0
# Source: definition; F_r and F_c are the forces in rebound and compression, compression being negative


SLOW_M_PER_S = 0.01
"""Up to this speed a test counts as static: labs measure gas force and friction at 1 to 10 mm/s."""
APART = 1.5
"""The second speed of a line to rest is at least so many times the first, or the line hangs on noise."""


def gas_and_friction(rows: Sequence[PeakVelocityRow]) -> tuple[GasAndFrictionRow, ...]:
    """One row for each condition that has a test in both directions.

    Read from the slowest test. Where that is not static, a line through it and the next speed leads to rest, which
    leaves out what the damping adds; where there is no other speed the row says so.

    Parameters
    ----------
    rows : of the peak-velocity plot, of any conditions
    """
    by_condition: dict[tuple[str | None, float | None, float | None], list[PeakVelocityRow]] = {}
    for row in rows:
        if row.rebound_force_N is not None and row.compression_force_N is not None:
            by_condition.setdefault((row.setting, row.voltage_V, row.temperature_degC), []).append(row)
    return tuple(_of_condition(sorted(mine, key=lambda row: row.speed)) for mine in by_condition.values())


def _of_condition(rows: Sequence[PeakVelocityRow]) -> GasAndFrictionRow:
    """Of the rows of one condition, slowest first."""
    slowest = _same_speed(rows, rows[0])
    speed, gas, friction = _at_one_speed(slowest)
    method: Method = "slow test" if speed <= SLOW_M_PER_S else "at the lowest speed"
    faster = [row for row in rows if row.speed >= APART * speed]
    if speed > SLOW_M_PER_S and faster:
        next_speed, next_gas, next_friction = _at_one_speed(_same_speed(faster, faster[0]))
        share = speed / (next_speed - speed)
        gas, friction = gas - share * (next_gas - gas), friction - share * (next_friction - friction)
        method = "extrapolated to rest"
    return GasAndFrictionRow(
        setting=rows[0].setting,
        voltage_V=rows[0].voltage_V,
        temperature_degC=rows[0].temperature_degC,
        gas_force_N=gas,
        friction_N=friction,
        velocity_m_per_s=speed,
        middle_m=float(np.mean([row.middle_m for row in slowest])),
        method=method,
    )


def _same_speed(rows: Sequence[PeakVelocityRow], first: PeakVelocityRow) -> list[PeakVelocityRow]:
    return [row for row in rows if same_motion(row.speed, first.speed)]


def _at_one_speed(rows: Sequence[PeakVelocityRow]) -> tuple[float, float, float]:
    """Speed [m/s], and mean and half difference of rebound and compression [N]."""
    rebound = float(np.mean([row.rebound_force_N for row in rows]))
    compression = float(np.mean([row.compression_force_N for row in rows]))
    return float(np.mean([row.speed for row in rows])), 0.5 * (rebound + compression), 0.5 * (rebound - compression)


# ----------------------------------------------------------------------------------------------------
# The peak-velocity plot (PVP): the force of each test at its peak speed, in rebound and in compression.


def peak_velocity(condition: Condition, tests: Sequence[tuple[Record, SpeedTest]]) -> tuple[PeakVelocityRow, ...]:
    """One row for each test of a condition, slowest first.

    Parameters
    ----------
    condition : whose labels the rows carry
    tests : of the condition's records, each with its record
    """
    rows = [_row(condition, record, test) for record, test in tests]
    return tuple(sorted(rows, key=lambda row: (row.speed, row.record)))


def _row(condition: Condition, record: Record, test: SpeedTest) -> PeakVelocityRow:
    rebound = _mean([s for s in test.strokes if s.rebound])
    compression = _mean([s for s in test.strokes if not s.rebound])
    return PeakVelocityRow(
        record=record.name,
        setting=condition.setting,
        voltage_V=condition.voltage,
        temperature_degC=condition.temperature,
        kind=test.kind,
        frequency_Hz=1.0 / test.cycle.period if test.cycle else None,
        amplitude_m=0.5 * float(np.mean([s.length for s in test.strokes])),
        middle_m=float(np.mean([s.middle for s in test.strokes])),
        rebound_velocity_m_per_s=rebound[0],
        rebound_force_N=rebound[1],
        compression_velocity_m_per_s=compression[0],
        compression_force_N=compression[1],
    )


def _mean(strokes: Sequence[Stroke]) -> tuple[float | None, float | None]:
    """Speed and force of the strokes of one direction; None where there are none."""
    if not strokes:
        return None, None
    speed, force = np.mean([stroke.at_peak() for stroke in strokes], axis=0)
    return float(speed), float(force)
