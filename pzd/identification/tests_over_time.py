"""What ties one test to an equivalent viscous damper: work per cycle, c_eq, dynamic range."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pzd.artefacts import MeasureRow
from pzd.artefacts.identified import AsItStandsRow, Characteristics, StepRow, WarmUpRow
from pzd.artefacts.rig import SAME_MOTION, same_motion
from pzd.identification.characteristics import (
    Stroke,
    continuous_velocity,
    gas_and_friction,
    peak_velocity,
    speed_tests,
    strokes_of,
)
from pzd.identification.moving_voltage import dwelled_levels
from pzd.identification.prepared_record import warm_up
from pzd.record import CONSTANT_SHARE, SAME_TEMPERATURE, Array, Condition, Record, is_constant, voltage_scale
from pzd.signals.cycles import Cycles, cycles_of
from pzd.signals.smoothing import reversals, work
from pzd.signals.stretches import separate_tests

# ----------------------------------------------------------------------------------------------------
# The response to a step of the control signal: how long the force takes to 63 and 90 % of its change.
#
# Only at constant speed does the force change by the step alone, so a step during any other motion is
# listed without times.


SHARES = (0.63, 0.9)
"""Shares of the change of force to which the time is given, as data sheets give them."""
LONGEST_RISE_S = 0.02
"""A control signal that takes longer from one level to the next is a ramp: supplies take a few milliseconds."""
SETTLED = 0.05
"""Before a step and at the end of its stroke the force moves by no more than this share of its change."""
LEAST_SAMPLES = 12
"""Samples of constant speed on either side of a step, at least: three for each quarter that is compared."""
STEADY = (0.05, 0.95)
"""Shares of a stroke of constant speed between which a step and its response must lie."""


@dataclass(frozen=True)
class ControlStep:
    """One step of the control signal."""

    before: int
    """Last sample on the old level."""
    after: int
    """First sample on the new one."""
    time: float
    """When the signal passes the middle [s]."""
    low: float
    high: float
    """The old and the new level."""


def step_responses(records: Sequence[Record]) -> tuple[StepRow, ...]:
    """Every step of the control signal in records in which it moves, in their order.

    Parameters
    ----------
    records : whose control signal moves
    """
    return tuple(row for record in records for row in _rows(record))


def steps_of(time: Array, voltage: Array) -> Iterator[ControlStep]:
    """The steps of a signal from one level that it dwells on to another.

    Parameters
    ----------
    time : (n,) [s]
    voltage : (n,) [V]
    """
    scale = max(float(np.ptp(voltage)), float(np.max(np.abs(voltage))))
    band = CONSTANT_SHARE * scale
    levels = np.array(dwelled_levels(voltage, band))
    nearest = np.argmin(np.abs(voltage[:, None] - levels), axis=1)
    nearest[np.abs(voltage - levels[nearest]) > 2.0 * band] = -1
    on_level = np.flatnonzero(nearest >= 0)
    for before, after in pairwise(on_level):
        if nearest[before] == nearest[after] or time[after] - time[before] > LONGEST_RISE_S:
            continue
        low, high = float(levels[nearest[before]]), float(levels[nearest[after]])
        way = (voltage[before : after + 1] - low) / (high - low)
        middle = float(np.interp(0.5, np.maximum.accumulate(way), time[before : after + 1]))
        yield ControlStep(int(before), int(after), middle, low, high)


def _rows(record: Record) -> Iterator[StepRow]:
    if record.voltage is None:
        return
    strokes = strokes_of(record.time, record.displacement, record.force)
    found = list(steps_of(record.time, record.voltage))
    for number, step in enumerate(found):
        since = found[number - 1].after if number else 0
        until = found[number + 1].before if number + 1 < len(found) else record.time.size - 1
        yield _row(record, step, strokes, float(record.time[since]), float(record.time[until]))


def _row(record: Record, step: ControlStep, strokes: Sequence[Stroke], since: float, until: float) -> StepRow:
    """One step between the one before it and the one behind it [s]."""
    here = [s for s in strokes if s.time[0] <= step.time <= s.time[-1] and s.kind == "constant velocity"]
    forces: tuple[float, float] | None = None
    reached: list[float | None] = [None for _ in SHARES]
    status = "the speed was not constant"
    if here:
        part = here[0].between(*STEADY)
        time, force = here[0].time[part], here[0].force[part]
        before = force[(time >= since) & (time <= record.time[step.before])]
        later = (time > step.time) & (time <= until)
        forces, status = _levels(before, force[later])
        if forces:
            progress = (force[later] - forces[0]) / (forces[1] - forces[0])
            reached = [_when(time[later] - step.time, progress, share) for share in SHARES]
    return StepRow(
        record=record.name,
        setting=record.setting,
        temperature_degC=record.median_temperature(),
        time_s=step.time,
        from_voltage_V=step.low,
        to_voltage_V=step.high,
        velocity_m_per_s=here[0].at_peak()[0] if here else None,
        from_force_N=forces[0] if forces else None,
        to_force_N=forces[1] if forces else None,
        to_63_percent_s=reached[0],
        to_90_percent_s=reached[1],
        status=status,
    )


def _levels(before: Array, after: Array) -> tuple[tuple[float, float] | None, str]:
    """Force before a step and settled after it [N], or None with the reason."""
    if min(before.size, after.size) < LEAST_SAMPLES:
        return None, "too little of the stroke lies before or after the step"
    quarters = [np.array_split(values, 4) for values in (before, after)]
    last, end = (float(np.mean(parts[3])) for parts in quarters)
    drift = [abs(float(np.mean(parts[3]) - np.mean(parts[2]))) for parts in quarters]
    scatter = float(np.std(np.diff(before))) / np.sqrt(2.0)
    if abs(end - last) < 4.0 * scatter:
        return None, "the force hardly changed"
    if max(drift) > SETTLED * abs(end - last):
        return None, f"the force had not settled {'before' if drift[0] >= drift[1] else 'after'} the step"
    return (last, end), "ok"


def _when(since: Array, progress: Array, share: float) -> float:
    """When the force comes up to a share of its way: half way between the first and the last time that it does.

    Noise brings the first crossing forward and puts the last one back; without noise both are one.
    """
    over = np.flatnonzero(progress >= share)
    under = np.flatnonzero(progress[: over[-1]] < share)
    first = int(over[0]) - 1
    last = int(under[-1]) if under.size else first
    return 0.5 * (_crossing(since, progress, share, first) + _crossing(since, progress, share, last))


def _crossing(since: Array, progress: Array, share: float, last: int) -> float:
    """When the share is passed between a sample and the next [s]; the first sample where it is passed before."""
    if last < 0:
        return float(since[0])
    way = (share - progress[last]) / (progress[last + 1] - progress[last])
    return float(since[last] + way * (since[last + 1] - since[last]))


# ----------------------------------------------------------------------------------------------------
# Warm-up: the force of every cycle of a test that was run for long, over time and temperature.


MANY_CYCLES = 30
"""So many cycles of one motion are run to warm a damper up: a test of force over speed has ten or fewer."""
WARMS_K = 2.0
"""A test of fewer cycles counts where its temperature changes by more than this, by which conditions are told apart."""
FEWEST_CYCLES = 6
"""Cycles of which a course can be seen: three at its beginning, three at its end."""
ALIKE = 0.8
"""Share of the whole strokes that must have one peak speed: the others are starts and stops."""


def warm_up_rows(condition: Condition) -> tuple[WarmUpRow, ...]:
    """One row for each cycle of the condition's tests of one motion that are many cycles long or change in temperature.

    Parameters
    ----------
    condition : its records, in which the control signal stands still
    """
    return tuple(
        row
        for record in condition.records
        for part in separate_tests(record)
        for row in _warm_up_rows(condition, record.name, part)
    )


def _warm_up_rows(condition: Condition, name: str, part: Record) -> Iterator[WarmUpRow]:
    strokes = strokes_of(part.time, part.displacement, part.force)
    if len(strokes) < 2 * (FEWEST_CYCLES if _change(part) > WARMS_K else MANY_CYCLES):
        return
    cycles = _cycles(strokes)
    if len(cycles) < FEWEST_CYCLES:
        return
    for number, pair in enumerate(cycles, 1):
        rebound, compression = sorted(pair, key=lambda stroke: not stroke.rebound)
        (up, rebound_force), (down, compression_force) = rebound.at_peak(), compression.at_peak()
        begin, end = pair[0].time[0], pair[1].time[-1]
        within = (part.time >= begin) & (part.time <= end)
        yield WarmUpRow(
            record=name,
            setting=condition.setting,
            voltage_V=condition.voltage,
            cycle=number,
            time_s=0.5 * float(begin + end),
            temperature_degC=None if part.temperature is None else float(np.mean(part.temperature[within])),
            velocity_m_per_s=0.5 * (up - down),
            rebound_force_N=rebound_force,
            compression_force_N=compression_force,
        )


def _change(part: Record) -> float:
    """How far the temperature moves from the first tenth of a test to the last [K]; 0 where none was recorded."""
    if part.temperature is None:
        return 0.0
    tenth = max(part.temperature.size // 10, 1)
    return abs(float(np.mean(part.temperature[-tenth:]) - np.mean(part.temperature[:tenth])))


def _cycles(strokes: Sequence[Stroke]) -> list[tuple[Stroke, Stroke]]:
    """Strokes of one peak speed in pairs, one each way; none where there is no such speed."""
    speeds = [abs(stroke.at_peak()[0]) if stroke.kind else 0.0 for stroke in strokes]
    usual = float(np.median(speeds))
    alike = [usual > 0.0 and same_motion(speed, usual) for speed in speeds]
    if sum(alike) < ALIKE * len(strokes):
        return []
    found: list[tuple[Stroke, Stroke]] = []
    taken = -1
    for (i, first), (j, second) in pairwise(enumerate(strokes)):
        if i > taken and alike[i] and alike[j] and first.rebound != second.rebound:
            found.append((first, second))
            taken = j
    return found


# ----------------------------------------------------------------------------------------------------
# Records that are none of the tests of the trade: a knock, a transient, a road; their extremes, and no criterion.


def as_it_stands(
    constant: Sequence[Condition], moving: Sequence[Record], recognised: Collection[str]
) -> tuple[AsItStandsRow, ...]:
    """One row for each record in which no test was recognised.

    Parameters
    ----------
    constant : the conditions, in each of which the control signal stands still
    moving : the records in which it moves
    recognised : names of the records that hold a test of another kind
    """
    held = [(record, one.voltage, one.temperature) for one in constant for record in one.records]
    found = [*held, *((record, None, record.median_temperature()) for record in moving)]
    return tuple(_as_it_stands_row(*one) for one in found if one[0].name not in recognised)


def _as_it_stands_row(record: Record, voltage: float | None, temperature: float | None) -> AsItStandsRow:
    return AsItStandsRow(
        record=record.name,
        setting=record.setting,
        voltage_V=voltage,
        temperature_degC=temperature,
        rebound_force_N=float(record.force.max()),
        compression_force_N=float(record.force.min()),
        rebound_velocity_m_per_s=max(float(record.velocity.max()), 0.0),
        compression_velocity_m_per_s=min(float(record.velocity.min()), 0.0),
        stroke_m=float(np.ptp(record.displacement)),
        duration_s=float(record.time[-1] - record.time[0]),
    )


# ----------------------------------------------------------------------------------------------------
# What the tests of a rig show without any model, condition by condition.


def characteristics(constant: Sequence[Condition], moving: Sequence[Record]) -> Characteristics:
    """Peak- and continuous-velocity plots, gas force, friction and warm-up of every condition, the response to steps.

    A record that is none of these is told as it stands.

    Parameters
    ----------
    constant : the conditions, in each of which the control signal stands still
    moving : the records in which it moves
    """
    found = [(condition, [(r, test) for r in condition.records for test in speed_tests(r)]) for condition in constant]
    peaks = tuple(row for condition, tests in found for row in peak_velocity(condition, tests))
    steps = step_responses(moving)
    warm = tuple(row for condition in constant for row in warm_up_rows(condition))
    recognised = {row.record for rows in (peaks, steps, warm) for row in rows}
    return Characteristics(
        peak_velocity=peaks,
        continuous_velocity=tuple(row for condition, tests in found for row in continuous_velocity(condition, tests)),
        gas_and_friction=gas_and_friction(peaks),
        steps=steps,
        warm_up=warm,
        as_it_stands=as_it_stands(constant, moving, recognised),
    )


# ----------------------------------------------------------------------------------------------------


WINDOW = 16
"""A constant speed is looked for in means over this part of a cycle: long against noise, short against a stroke."""
LEVEL = 0.03
"""A speed stays constant within this share; a sine does so for a sixth of its cycle."""
MOST = 0.5
"""Share of the cycle in which a test of constant speed holds it, at least."""


@dataclass(frozen=True)
class Loop:
    """A closed loop of displacement, speed and force, or a record without one from its warm-up on."""

    displacement: Array
    velocity: Array
    force: Array
    step: float
    closed: bool
    frequency: float | None
    cycles: float
    """How many cycles the arrays cover."""


def measures(records: Sequence[Record]) -> tuple[MeasureRow, ...]:
    """The measures of every test, in the records' order; several tests in one record have a row each, of its name."""
    scale = voltage_scale(records)
    still = [(record, is_constant(record, scale)) for record in records]
    rows = [
        _measures_row(test, constant) for r, constant in still for test in (separate_tests(r) if constant else (r,))
    ]
    alike = _Alike(rows)
    return tuple(row.model_copy(update={"dynamic_range": _dynamic_range(row, alike.to(row))}) for row in rows)


def equivalent_damping(work_done: float, velocity: Array, step: float) -> float:
    """The viscous coefficient that would do the same work under the same motion.

    Equation: c_eq = W / integral of v^2 dt      Source: definition

    Parameters
    ----------
    work_done : W [J]
    velocity : (n,) speed over the same path [m/s]
    step : sampling interval [s]

    Returns
    -------
    c_eq [N s/m]
    """
    return work_done / (float(velocity @ velocity) * step)


def force_at_rest(velocity: Array, force: Array, closed: bool) -> float:
    """Mean of abs(F) where the speed passes through zero, both branches alike [N].

    0 where the speed never changes its sign.
    """
    if closed:
        velocity, force = np.append(velocity, velocity[0]), np.append(force, force[0])
    before = np.flatnonzero((velocity[:-1] >= 0.0) != (velocity[1:] >= 0.0))
    if before.size == 0:
        return 0.0
    share = velocity[before] / (velocity[before] - velocity[before + 1])
    return float(np.mean(np.abs(force[before] + share * (force[before + 1] - force[before]))))


def peak_speed(loop: Loop) -> float:
    """The largest speed of a test; of one driven to and fro at a constant speed, that speed [m/s].

    A speed that steps at every turn overshoots there when it is made of a limited number of harmonics (Gibbs), by
    9 % and more, and so does the noise of a slow test: its constant part is the speed that was driven.
    """
    largest = float(np.max(np.abs(loop.velocity)))
    points = loop.displacement.size
    width = points // WINDOW
    if not loop.closed or width == 0:
        return largest
    apart = np.abs(np.roll(loop.displacement, -width) - loop.displacement) / (width * loop.step)
    level = float(np.median(apart))
    constant = np.count_nonzero(np.abs(apart - level) <= LEVEL * level) >= MOST * points
    return level if constant else largest


def loop_of(record: Record) -> Loop:
    """The record's average cycle where its motion repeats, else all of it after the warm-up."""
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


def _measures_row(record: Record, still: bool) -> MeasureRow:
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


class _Alike:
    """Finds the tests like one among many: by setting and speed first, for of a thousand few are alike."""

    def __init__(self, rows: Sequence[MeasureRow]) -> None:
        self.rows: dict[str | None, list[tuple[float, int, MeasureRow]]] = {}
        for number, row in enumerate(rows):
            if row.voltage_V is not None and row.frequency_Hz is not None:
                self.rows.setdefault(row.setting, []).append((row.peak_velocity_m_per_s, number, row))
        for of_setting in self.rows.values():
            of_setting.sort(key=lambda entry: entry[:2])

    def to(self, row: MeasureRow) -> list[MeasureRow]:
        """The tests with a voltage and a frequency that are the same but for the voltage, in the rows' order."""
        speed, mine = row.peak_velocity_m_per_s, self.rows.get(row.setting, [])
        low = bisect_left(mine, speed * (1.0 - 2.0 * SAME_MOTION), key=lambda entry: entry[0])
        high = bisect_right(mine, speed * (1.0 + 2.0 * SAME_MOTION), key=lambda entry: entry[0])
        return [r for _, _, r in sorted(mine[low:high], key=lambda entry: entry[1]) if _same_test(r, row)]


def _dynamic_range(row: MeasureRow, others: Sequence[MeasureRow]) -> float | None:
    """Peak force over that of the lowest voltage at the same speed, setting and temperature."""
    if row.voltage_V is None or row.frequency_Hz is None:
        return None
    lowest = min(others, key=lambda r: r.voltage_V or 0.0)
    if lowest.voltage_V == max(r.voltage_V or 0.0 for r in others):
        return None
    return row.peak_force_N / lowest.peak_force_N


def _same_test(a: MeasureRow, b: MeasureRow) -> bool:
    speeds = a.peak_velocity_m_per_s, b.peak_velocity_m_per_s
    strokes = a.amplitude_m, b.amplitude_m
    warm = abs((a.temperature_degC or 0.0) - (b.temperature_degC or 0.0)) <= SAME_TEMPERATURE
    return warm and same_motion(*speeds) and same_motion(*strokes)
