"""The peak-velocity plot (PVP): the force of each test at its peak speed, in rebound and in compression."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.artefacts.characteristics import PeakVelocityRow
from pzd.identify.characteristics.recognition import SpeedTest
from pzd.identify.characteristics.strokes import Stroke
from pzd.record import Condition, Record


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
