"""Characteristics of a damper that its tests show without a model.

The peak-velocity plot (PVP) is the force of each test at its peak speed, the continuous-velocity plot (CVP) the force
over speed in its average cycle. Gas force and friction are the force at rest; further the response to a step of the
control signal and the force over a warm-up. Records without any of these get a row of extremes.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pzd.artefacts.identified import (
    RISE_SHARES,
    AsItStandsRow,
    Characteristics,
    ContinuousVelocityRow,
    GasAndFrictionRow,
    Method,
    PeakVelocityRow,
    StepRow,
    WarmUpRow,
)
from pzd.artefacts.rig import same_motion
from pzd.identification.intervals import label_columns
from pzd.identification.moving_voltage import dwell_levels
from pzd.identification.strokes_and_loops import Cycle, SpeedTest, Stroke, speed_tests, strokes_of
from pzd.parallel.processes import parallel_map
from pzd.record import CONSTANT_SHARE, Array, Condition, Record
from pzd.signals.measures import one_record
from pzd.signals.segmentation import separate_tests


def characteristics(constant: Sequence[Condition], moving: Sequence[Record], jobs: int = 1) -> Characteristics:
    """Derive all characteristics of a rig.

    Parameters
    ----------
    constant : conditions, in each of which the control signal is constant
    moving : records in which it moves
    jobs : records worked on at the same time
    """

    def of_one(
        place: tuple[Condition, Record],
    ) -> tuple[
        tuple[PeakVelocityRow, ...], tuple[ContinuousVelocityRow, ...], list[WarmUpRow], tuple[PeakVelocityRow, ...]
    ]:
        condition, record = place
        with one_record():
            tests = [(record, test) for test in speed_tests(record)]
            warm = [row for part in separate_tests(record) for row in _warm_up_rows(condition, record.name, part)]
            slipping = peak_velocity(condition, [(record, test) for _, test in tests if test.slips])
            return peak_velocity(condition, tests), continuous_velocity(condition, tests), warm, slipping

    places = [(condition, record) for condition in constant for record in condition.records]
    found = list(zip(places, parallel_map(of_one, places, jobs, first_here=True), strict=True))
    peaks = tuple(
        row
        for condition in constant
        for row in _slowest_first(row for (mine, _), (rows, *_) in found if mine is condition for row in rows)
    )
    steps = tuple(row for record in moving for row in _step_rows(record))
    warm = tuple(row for _, (_, _, rows, _) in found for row in rows)
    recognised = {row.record for rows in (peaks, steps, warm) for row in rows}
    return Characteristics(
        peak_velocity=peaks,
        continuous_velocity=tuple(row for _, (_, rows, *_) in found for row in rows),
        gas_and_friction=gas_and_friction([row for _, (*_, rows) in found for row in rows]),
        steps=steps,
        warm_up=warm,
        as_it_stands=as_it_stands(constant, moving, recognised),
    )


# --- Peak-velocity plot ---


def peak_velocity(condition: Condition, tests: Sequence[tuple[Record, SpeedTest]]) -> tuple[PeakVelocityRow, ...]:
    """Return one row for each test of a condition, slowest first.

    Parameters
    ----------
    condition : whose labels the rows carry
    tests : of the condition's records, each with its record
    """
    return _slowest_first(_peak_velocity_row(condition, record, test) for record, test in tests)


def _slowest_first(rows: Iterable[PeakVelocityRow]) -> tuple[PeakVelocityRow, ...]:
    """Return the rows of one condition in their order."""
    return tuple(sorted(rows, key=lambda row: (row.speed, row.record)))


def _peak_velocity_row(condition: Condition, record: Record, test: SpeedTest) -> PeakVelocityRow:
    """Return the row of one test."""
    rebound = _mean_of_direction([s for s in test.strokes if s.rebound])
    compression = _mean_of_direction([s for s in test.strokes if not s.rebound])
    return PeakVelocityRow(
        record=record.name,
        **label_columns(condition.labels),
        kind=test.kind,
        frequency_Hz=1.0 / test.cycle.period if test.cycle else None,
        amplitude_m=0.5 * float(np.mean([s.length for s in test.strokes])),
        middle_m=float(np.mean([s.middle for s in test.strokes])),
        rebound_velocity_m_per_s=rebound[0],
        rebound_force_N=rebound[1],
        compression_velocity_m_per_s=compression[0],
        compression_force_N=compression[1],
    )


def _mean_of_direction(strokes: Sequence[Stroke]) -> tuple[float | None, float | None]:
    """Return the mean speed and force of the strokes of one direction; None where there are none."""
    if not strokes:
        return None, None
    speed, force = np.mean([stroke.at_peak() for stroke in strokes], axis=0)
    return float(speed), float(force)


# --- Continuous-velocity plot ---

CYCLE_POINTS = 100
"""Points written of a cycle: the curve looks smooth, and the file of many tests stays small."""


def continuous_velocity(
    condition: Condition, tests: Sequence[tuple[Record, SpeedTest]]
) -> tuple[ContinuousVelocityRow, ...]:
    """Return the average cycle of every test that repeats, in the order of the tests.

    Parameters
    ----------
    condition : whose labels the rows carry
    tests : of the condition's records, each with its record
    """
    return tuple(
        row for record, test in tests if test.cycle for row in _continuous_velocity_rows(condition, record, test.cycle)
    )


def _continuous_velocity_rows(condition: Condition, record: Record, cycle: Cycle) -> list[ContinuousVelocityRow]:
    # The last sample closes the cycle and is the first one again.
    channels = (thinned(values[:-1]) for values in (cycle.displacement, cycle.velocity, cycle.force))
    amplitude = 0.5 * float(np.ptp(cycle.displacement))
    return [
        ContinuousVelocityRow(
            record=record.name,
            **label_columns(condition.labels),
            frequency_Hz=1.0 / cycle.period,
            amplitude_m=amplitude,
            displacement_m=float(x),
            velocity_m_per_s=float(v),
            force_N=float(force),
        )
        for x, v, force in zip(*channels, strict=True)
    ]


def thinned(values: Array) -> Array:
    """Return the means of values (n,) over `CYCLE_POINTS` parts as equal as possible; fewer values unchanged."""
    if values.size <= CYCLE_POINTS:
        return values
    size, longer = divmod(values.size, CYCLE_POINTS)
    long, short = np.split(values, [longer * (size + 1)])
    return np.concatenate([part.reshape(-1, length).mean(axis=1) for part, length in ((long, size + 1), (short, size))])


# --- Gas force and friction: force at mid-stroke as the speed goes to zero ---
#
# Equation: F_gas = (F_r + F_c) / 2, F_friction = (F_r - F_c) / 2, both at v -> 0
# Source: definition; F_r and F_c are the forces in rebound and compression, compression being negative
#
# Away from rest the mean is that of the valves too, which are seldom alike both ways, and bend with the speed: no line
# through two speeds leads to the gas force. Only a slow test tells it.

SLOW_M_PER_S = 0.01
"""Largest speed of a static test [m/s]: labs measure gas force and friction at 1 to 10 mm/s."""
LEAST_SPEED_RATIO = 1.5
"""Least ratio of the two speeds of an extrapolation to rest, which otherwise follows the noise."""
BENT = 0.1
"""Share of the friction by which a third speed may lie off the line that leads to it.

Reason: at rest the line is off by as much, or twice as much; over the knee of a race damper it led to 270 N of a seal
of 35. Not tuned."""


def gas_and_friction(rows: Sequence[PeakVelocityRow]) -> tuple[GasAndFrictionRow, ...]:
    """Return one row for each condition with a test in both directions, from its slowest test.

    Where that is not static, the gas force cannot be told from asymmetry, and the friction is extrapolated to rest
    along a line through it and the next speed, which removes the damping; where there is no other speed the row says
    so, and where the next but one lies off the line it leads nowhere.

    Parameters
    ----------
    rows : of the peak-velocity plot, of any conditions, of tests in which the rod slips
    """
    by_condition: dict[tuple[str | None, float | None, float | None], list[PeakVelocityRow]] = {}
    for row in rows:
        if row.rebound_force_N is not None and row.compression_force_N is not None:
            by_condition.setdefault((row.setting, row.voltage_V, row.temperature_degC), []).append(row)
    return tuple(_gas_and_friction_row(sorted(mine, key=lambda row: row.speed)) for mine in by_condition.values())


def _gas_and_friction_row(rows: Sequence[PeakVelocityRow]) -> GasAndFrictionRow:
    """Return gas force and friction from the rows of one condition, slowest first."""
    gas: float | None
    friction: float | None
    slowest = _same_speed(rows, rows[0])
    speed, gas, friction = _at_one_speed(slowest)
    method: Method = "slow test"
    if speed > SLOW_M_PER_S:
        gas, method = None, "at the lowest speed"
        faster = [row for row in rows if row.speed >= LEAST_SPEED_RATIO * speed]
        if faster:
            next_speed, _, next_friction = _at_one_speed(_same_speed(faster, faster[0]))
            slope = (next_friction - friction) / (next_speed - speed)
            at_rest, method = friction - slope * speed, "extrapolated to rest"
            beyond = [row for row in rows if row.speed >= LEAST_SPEED_RATIO * next_speed]
            off = 0.0
            if beyond:
                third_speed, _, third_friction = _at_one_speed(_same_speed(beyond, beyond[0]))
                off = abs(third_friction - (at_rest + slope * third_speed))
            friction = at_rest if at_rest >= 0.0 and off <= BENT * at_rest else None
    return GasAndFrictionRow(
        **label_columns((rows[0].setting, rows[0].voltage_V, rows[0].temperature_degC)),
        gas_force_N=gas,
        friction_N=friction,
        velocity_m_per_s=speed,
        middle_m=float(np.mean([row.middle_m for row in slowest])),
        method=method,
    )


def _same_speed(rows: Sequence[PeakVelocityRow], first: PeakVelocityRow) -> list[PeakVelocityRow]:
    """Return the rows of the speed of the first one."""
    return [row for row in rows if same_motion(row.speed, first.speed)]


def _at_one_speed(rows: Sequence[PeakVelocityRow]) -> tuple[float, float, float]:
    """Return speed [m/s], and mean and half difference of rebound and compression [N]."""
    rebound = float(np.mean([row.rebound_force_N for row in rows]))
    compression = float(np.mean([row.compression_force_N for row in rows]))
    return float(np.mean([row.speed for row in rows])), 0.5 * (rebound + compression), 0.5 * (rebound - compression)


# --- Response to a step of the control signal ---
#
# Only at constant speed does the force change by the step alone; during any other motion a step has no times.

LONGEST_RISE_S = 0.02
"""Longest step of the control signal [s]; a longer one is a ramp: supplies take a few milliseconds."""
SETTLED_DRIFT = 0.05
"""Largest drift of the force before a step and at the end of its stroke, as a share of its change."""
FEWEST_STEP_SAMPLES = 12
"""Fewest samples of constant speed on either side of a step: three for each quarter that is compared."""
STEADY_PART = (0.05, 0.95)
"""Shares of a stroke of constant speed between which a step and its response have to lie."""


@dataclass(frozen=True)
class ControlStep:
    """One step of the control signal."""

    before: int
    """Last sample on the old level."""
    after: int
    """First sample on the new one."""
    time: float
    """Time at which the signal passes the middle [s]."""
    low: float
    high: float
    """Old and new level of the signal."""


def steps_of(time: Array, voltage: Array) -> Iterator[ControlStep]:
    """Yield the steps of a signal from one level on which it dwells to another.

    Parameters
    ----------
    time : (n,) [s]
    voltage : (n,) [V]
    """
    scale = max(float(np.ptp(voltage)), float(np.max(np.abs(voltage))))
    band = CONSTANT_SHARE * scale
    levels = np.array(dwell_levels(voltage, band))
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


def _step_rows(record: Record) -> Iterator[StepRow]:
    """Yield one row for every step of the control signal of a record."""
    if record.voltage is None:
        return
    strokes = strokes_of(record.time, record.displacement, record.force)
    found = list(steps_of(record.time, record.voltage))
    for number, step in enumerate(found):
        since = found[number - 1].after if number else 0
        until = found[number + 1].before if number + 1 < len(found) else record.time.size - 1
        yield _step_row(record, step, strokes, float(record.time[since]), float(record.time[until]))


def _step_row(record: Record, step: ControlStep, strokes: Sequence[Stroke], since: float, until: float) -> StepRow:
    """Return the row of one step, between the times of the step before and the one after it [s]."""
    here = [s for s in strokes if s.time[0] <= step.time <= s.time[-1] and s.kind == "constant velocity"]
    forces: tuple[float, float] | None = None
    reached: list[float | None] = [None for _ in RISE_SHARES]
    status = "the speed was not constant"
    if here:
        part = here[0].between(*STEADY_PART)
        time, force = here[0].time[part], here[0].force[part]
        before = force[(time >= since) & (time <= record.time[step.before])]
        later = (time > step.time) & (time <= until)
        forces, status = _settled_forces(before, force[later])
        if forces:
            progress = (force[later] - forces[0]) / (forces[1] - forces[0])
            reached = [_time_to_share(time[later] - step.time, progress, share) for share in RISE_SHARES]
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


def _settled_forces(before: Array, after: Array) -> tuple[tuple[float, float] | None, str]:
    """Return the force before a step and the settled force after it [N], or None with the reason."""
    if min(before.size, after.size) < FEWEST_STEP_SAMPLES:
        return None, "too little of the stroke lies before or after the step"
    quarters = [np.array_split(values, 4) for values in (before, after)]
    last, end = (float(np.mean(parts[3])) for parts in quarters)
    drift = [abs(float(np.mean(parts[3]) - np.mean(parts[2]))) for parts in quarters]
    scatter = float(np.std(np.diff(before))) / np.sqrt(2.0)
    if abs(end - last) < 4.0 * scatter:
        return None, "the force hardly changed"
    if max(drift) > SETTLED_DRIFT * abs(end - last):
        return None, f"the force had not settled {'before' if drift[0] >= drift[1] else 'after'} the step"
    return (last, end), "ok"


def _time_to_share(since: Array, progress: Array, share: float) -> float:
    """Return the time at which the force reaches a share of its change: the middle of its first and last crossing.

    Noise brings the first crossing forward and delays the last one; without noise both are one.
    """
    over = np.flatnonzero(progress >= share)
    under = np.flatnonzero(progress[: over[-1]] < share)
    first = int(over[0]) - 1
    last = int(under[-1]) if under.size else first
    return 0.5 * (_crossing_time(since, progress, share, first) + _crossing_time(since, progress, share, last))


def _crossing_time(since: Array, progress: Array, share: float, last: int) -> float:
    """Return the time of the crossing after a sample [s]; the first sample where the share is passed before."""
    if last < 0:
        return float(since[0])
    way = (share - progress[last]) / (progress[last + 1] - progress[last])
    return float(since[last] + way * (since[last + 1] - since[last]))


# --- Warm-up: force of every cycle of a long test, over time and temperature ---

MANY_CYCLES = 30
"""Fewest cycles of a warm-up: a test of force over speed has ten or fewer."""
LEAST_WARMING_K = 2.0
"""Change of temperature above which a shorter test is a warm-up [K]: that of two conditions."""
FEWEST_CYCLES = 6
"""Fewest cycles of such a shorter test: three at its beginning, three at its end."""
EQUAL_SPEED_SHARE = 0.8
"""Least share of the strokes that have one peak speed: the others are starts and stops."""


def _warm_up_rows(condition: Condition, name: str, part: Record) -> Iterator[WarmUpRow]:
    """Yield one row for each cycle of a test that is many cycles long or changes in temperature.

    Parameters
    ----------
    condition : of constant control signal
    name : of the record
    part : the test, of which a record may hold several
    """
    strokes = strokes_of(part.time, part.displacement, part.force)
    if len(strokes) < 2 * (FEWEST_CYCLES if _temperature_change(part) > LEAST_WARMING_K else MANY_CYCLES):
        return
    cycles = _cycles_of_one_speed(strokes)
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


def _temperature_change(part: Record) -> float:
    """Return the change of temperature from the first tenth of a test to the last [K]; 0 where none was recorded."""
    if part.temperature is None:
        return 0.0
    tenth = max(part.temperature.size // 10, 1)
    return abs(float(np.mean(part.temperature[-tenth:]) - np.mean(part.temperature[:tenth])))


def _cycles_of_one_speed(strokes: Sequence[Stroke]) -> list[tuple[Stroke, Stroke]]:
    """Return the strokes of one peak speed in pairs, one each way; none where there is no such speed."""
    speeds = [abs(stroke.at_peak()[0]) if stroke.kind else 0.0 for stroke in strokes]
    usual = float(np.median(speeds))
    alike = [usual > 0.0 and same_motion(speed, usual) for speed in speeds]
    if sum(alike) < EQUAL_SPEED_SHARE * len(strokes):
        return []
    found: list[tuple[Stroke, Stroke]] = []
    taken = -1
    for (i, first), (j, second) in pairwise(enumerate(strokes)):
        if i > taken and alike[i] and alike[j] and first.rebound != second.rebound:
            found.append((first, second))
            taken = j
    return found


# --- Records without a test of force over speed ---


def as_it_stands(
    constant: Sequence[Condition], moving: Sequence[Record], recognised: Collection[str]
) -> tuple[AsItStandsRow, ...]:
    """Return one row of extremes for each record in which no test was recognised.

    Parameters
    ----------
    constant : conditions, in each of which the control signal is constant
    moving : records in which it moves
    recognised : names of the records that hold a test of another kind
    """
    still = [(record, one.voltage, one.temperature) for one in constant for record in one.records]
    found = [*still, *((record, None, record.median_temperature()) for record in moving)]
    return tuple(_as_it_stands_row(*one) for one in found if one[0].name not in recognised)


def _as_it_stands_row(record: Record, voltage: float | None, temperature: float | None) -> AsItStandsRow:
    """Return the extremes of one record."""
    return AsItStandsRow(
        record=record.name,
        **label_columns((record.setting, voltage, temperature)),
        rebound_force_N=float(record.force.max()),
        compression_force_N=float(record.force.min()),
        rebound_velocity_m_per_s=max(float(record.velocity.max()), 0.0),
        compression_velocity_m_per_s=min(float(record.velocity.min()), 0.0),
        stroke_m=float(np.ptp(record.displacement)),
        duration_s=float(record.time[-1] - record.time[0]),
    )
