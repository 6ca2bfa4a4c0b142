"""The voltage that gives a force at a speed, as rows of a regular table."""

from __future__ import annotations

import numpy as np

from pzd.artefacts import InverseRow, Table
from pzd.record import Array
from pzd.table.config import TableConfig
from pzd.table.lookup import Lookup


def inverse_rows(config: TableConfig, table: Table) -> tuple[InverseRow, ...]:
    """Voltage over velocity and evenly spaced force, read off the table of force.

    Where several voltages give the force the lowest stands; where none does the cell is empty, or
    holds the voltage that comes nearest, as `unreachable` says. Empty without a control signal.
    """
    if any(row.voltage_V is None for row in table.force):
        return ()
    rows: list[InverseRow] = []
    for temperature in dict.fromkeys(row.temperature_degC for row in table.force):
        lookup = Lookup.of(table, temperature)
        for side, velocity in ((lookup.compression, -lookup.speeds[-2::-1]), (lookup.rebound, lookup.speeds[:-1])):
            rows += _side(config, lookup, temperature, side[:, :-1], velocity)
    return tuple(rows)


def _side(
    config: TableConfig, lookup: Lookup, temperature: float | None, forces: Array, velocity: Array
) -> list[InverseRow]:
    if not np.isfinite(forces).any():
        return []
    levels = np.linspace(np.nanmin(forces), np.nanmax(forces), config.force_levels)
    read = lookup.voltage_for if config.unreachable == "empty" else lookup.nearest_voltage_for
    rows: list[InverseRow] = []
    for v in velocity:
        for force, voltage in zip(levels, read(levels, np.full(levels.size, v)), strict=True):
            rows.append(
                InverseRow(
                    temperature_degC=temperature,
                    velocity_m_per_s=float(v),
                    force_N=float(force),
                    voltage_V=None if np.isnan(voltage) else float(voltage),
                )
            )
    return rows
