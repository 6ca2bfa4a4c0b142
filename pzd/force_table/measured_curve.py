"""The table of a measured curve: its points and nodes between them, so that straight lines follow it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pzd.artefacts import ForceRow, Table, TableNotes
from pzd.damper.curve import ForceCurve
from pzd.force_table.config import TableConfig
from pzd.force_table.force import refined
from pzd.force_table.lookup import inverse_rows
from pzd.record import Array

_ROUNDING = 1e-9
"""Share by which a node may lie beyond the last point: rounding."""


def table_of_curve(table: TableConfig, curve: ForceCurve) -> Table:
    """Tabulate a measured curve; what lies beyond its last point in a direction counts as outside.

    Parameters
    ----------
    table : the config's block
    curve : the curve
    """
    largest = max(table.speed_max_m_per_s, *np.abs(curve.velocity))
    even = largest * np.linspace(0.0, 1.0, table.speed_points + 1) ** 2
    nodes = np.unique(np.concatenate([[0.0], even, np.abs(curve.velocity)]))
    nodes = nodes[np.diff(nodes, prepend=-1.0) > _ROUNDING * largest]

    def law(speeds: Array) -> Array:
        both = np.stack([-speeds, speeds], axis=1)
        return curve.at(both[:, :, np.newaxis], curve.voltages).reshape(speeds.size, -1)

    speeds = refined(nodes, law, table.tolerance * float(np.max(np.abs(law(nodes)))))
    velocity = np.concatenate([-speeds[::-1], speeds])
    ends = curve.velocity[0] * (1.0 + _ROUNDING), curve.velocity[-1] * (1.0 + _ROUNDING)
    inside = (velocity >= ends[0]) & (velocity <= ends[1])
    asked = np.clip(velocity, curve.velocity[0], curve.velocity[-1]) if table.outside == "clamp" else velocity
    rows = tuple(
        ForceRow(
            temperature_degC=None,
            voltage_V=float(voltage) if curve.has_voltage else None,
            velocity_m_per_s=float(v),
            force_N=None if table.outside == "error" and not within else float(force),
            inside=1 if within else 0,
        )
        for voltage in curve.voltages
        for v, within, force in zip(velocity, inside, curve.at(asked, voltage), strict=True)
    )
    notes = TableNotes(outside=table.outside, reached_m_per_s=curve.reached, lost=(), not_monotone=())
    forward = Table(rows, (), notes)
    return replace(forward, inverse=inverse_rows(table, forward))
