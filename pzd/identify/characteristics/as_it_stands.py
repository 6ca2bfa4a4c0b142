"""Records that are none of the tests of the trade: a knock, a transient, a road; their extremes, and no criterion."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from pzd.artefacts.characteristics import AsItStandsRow
from pzd.record import Condition, Record


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
    return tuple(_row(*one) for one in found if one[0].name not in recognised)


def _row(record: Record, voltage: float | None, temperature: float | None) -> AsItStandsRow:
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
