"""Warm-up: the force of every cycle of a test that was run for long, over time and temperature."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from pzd.artefacts.characteristics import WarmUpRow
from pzd.artefacts.matching import same_motion
from pzd.identify.characteristics.recognition import strokes_of
from pzd.identify.characteristics.strokes import Stroke
from pzd.record import Condition, Record
from pzd.signals.stretches import separate_tests

MANY_CYCLES = 30
"""So many cycles of one motion are run to warm a damper up: a test of force over speed has ten or fewer."""
WARMS_K = 2.0
"""A test of fewer cycles counts where its temperature changes by more than this, by which conditions are told apart."""
FEWEST_CYCLES = 6
"""Cycles of which a course can be seen: three at its beginning, three at its end."""
ALIKE = 0.8
"""Share of the whole strokes that must have one peak speed: the others are starts and stops."""


def warm_up(condition: Condition) -> tuple[WarmUpRow, ...]:
    """One row for each cycle of the condition's tests of one motion that are many cycles long or change in temperature.

    Parameters
    ----------
    condition : its records, in which the control signal stands still
    """
    return tuple(
        row
        for record in condition.records
        for part in separate_tests(record)
        for row in _rows(condition, record.name, part)
    )


def _rows(condition: Condition, name: str, part: Record) -> Iterator[WarmUpRow]:
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
