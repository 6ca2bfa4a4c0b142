"""The voltage that gives a force at a speed, as rows of a regular table."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pzd.artefacts import InverseRow, Table
from pzd.table.config import TableConfig
from pzd.table.lookup import Lookup


def inverse_rows(config: TableConfig, table: Table) -> tuple[InverseRow, ...]:
    """Voltage over velocity and force, read off the table of force.

    At each speed the forces are spaced evenly from the least to the largest that the damper gives there, so that
    every row has its voltage. Where several voltages give the force the lowest stands; a force within a gap of the
    table, whose ends were tested and whose middle was not, is empty or holds the voltage that comes nearest, as
    `unreachable` says. Speeds at which the table is empty are left out; so is all without a control signal.
    """
    if any(row.voltage_V is None for row in table.force):
        return ()
    rows: list[InverseRow] = []
    for temperature in dict.fromkeys(row.temperature_degC for row in table.force):
        lookup = Lookup.of(table, temperature)
        speeds = lookup.speeds[:-1]
        for velocity in (*-speeds[::-1], *speeds):
            rows += _at(config, lookup, temperature, float(velocity))
    return tuple(rows)


def _at(config: TableConfig, lookup: Lookup, temperature: float | None, velocity: float) -> Iterator[InverseRow]:
    low, high = lookup.range(velocity)
    if not low <= high:
        return
    read = lookup.voltage_for if config.unreachable == "empty" else lookup.nearest_voltage_for
    levels = np.unique(np.linspace(low, high, config.force_levels))
    for force, voltage in zip(levels, read(levels, velocity), strict=True):
        yield InverseRow(
            temperature_degC=temperature,
            velocity_m_per_s=velocity,
            force_N=float(force),
            voltage_V=None if np.isnan(voltage) else float(voltage),
        )
