"""The continuous-velocity plot (CVP): force over speed through the average settled cycle of each test."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.artefacts.characteristics import ContinuousVelocityRow
from pzd.identify.characteristics.recognition import Cycle, SpeedTest
from pzd.record import Array, Condition, Record

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
