"""Which tests of force over speed a record holds: settled cycles of a stroke each way, or strokes of constant speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pzd.artefacts.characteristics import Kind
from pzd.artefacts.matching import same_motion
from pzd.identify.characteristics.strokes import Stroke
from pzd.record import Array, Record
from pzd.signals.cycles import settled
from pzd.signals.repeating import cycles_of
from pzd.signals.reversals import reversals
from pzd.signals.stretches import separate_tests

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
