"""What ties one test to an equivalent viscous damper: work per cycle, c_eq, dynamic range."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pzd.artefacts import MeasureRow
from pzd.artefacts.matching import SAME_MOTION, same_motion
from pzd.identify.trial import warm_up
from pzd.record import SAME_TEMPERATURE, Array, Record, is_constant, voltage_scale
from pzd.signals.cycles import Cycles
from pzd.signals.repeating import cycles_of
from pzd.signals.reversals import reversals
from pzd.signals.stretches import separate_tests
from pzd.signals.work import work

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
    rows = [_row(test, constant) for r, constant in still for test in (separate_tests(r) if constant else (r,))]
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


def _row(record: Record, still: bool) -> MeasureRow:
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
