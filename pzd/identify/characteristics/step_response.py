"""The response to a step of the control signal: how long the force takes to 63 and 90 % of its change.

Only at constant speed does the force change by the step alone, so a step during any other motion is
listed without times.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pzd.artefacts.characteristics import StepRow
from pzd.identify.characteristics.recognition import strokes_of
from pzd.identify.characteristics.strokes import Stroke
from pzd.identify.nodes import dwelled_levels
from pzd.record import CONSTANT_SHARE, Array, Record

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
