"""The stage table: the final damper of diagnose becomes a table of force and its inverse."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from pzd.artefacts import Diagnosed, Identified, Rig, Table, TableNotes
from pzd.damper.model import Damper
from pzd.force_table.config import TableConfig
from pzd.quantities import Control
from pzd.record import Record, mid_stroke

if TYPE_CHECKING:
    from pzd.force_table.force import ReachedSpeeds

log = logging.getLogger(__name__)

WARM_STEPS = 5
"""Temperatures of the table where an effect of the material, as `temperature_drift`, gives the temperature axis."""


def tabulate(
    table: TableConfig, rig: Rig, identified: Identified, diagnosed: Diagnosed, control: Control, setting: str | None
) -> Table:
    """Tabulate the force at steady slip, its inverse, and settings between tested ones.

    Parameters
    ----------
    table : the config's block
    rig : the records, for the operating envelope
    identified : the dampers of all settings, for those between
    diagnosed : the damper to tabulate
    control : the control signal, for the text of the notes
    setting : of the rig's settings, the one in use

    Raises
    ------
    ConfigError : when a wanted setting does not lie between tested ones
    """
    made = force_table(table, rig, diagnosed, control, setting)
    if table.settings is None:
        return made
    from pzd.force_table.settings import between_settings

    rows, left_out = between_settings(table, rig, identified, control)
    return replace(made, settings=rows, settings_left_out=left_out)


def force_table(table: TableConfig, rig: Rig, diagnosed: Diagnosed, control: Control, setting: str | None) -> Table:
    """Tabulate the force over (temperature, voltage, velocity) at steady slip, its inverse, and what it cannot hold.

    Parameters
    ----------
    table, rig, diagnosed, control, setting : as `tabulate`
    """
    from pzd.force_table import force

    damper = diagnosed.damper
    records = [record for record in rig.records if record.setting == setting]
    given = force.temperatures_of(diagnosed.baseline), force.voltages_of(diagnosed.baseline)
    envelope = force.reached_speeds(records, *given)
    temperatures = _temperatures(table, damper, records)
    return _within(table, damper, temperatures, envelope, control, _reached_stroke(records))


def untested_table(table: TableConfig, damper: Damper, control: Control) -> Table:
    """Tabulate the force of a damper of known parameters, which is known at every speed up to that of the table.

    Parameters
    ----------
    table : the config's block
    damper : the damper
    control : the control signal, for the text of the notes
    """
    from pzd.force_table import force

    temperatures = force.temperatures_of(damper)
    T, U = (np.array([v or 0.0 for v in values]) for values in (temperatures, force.voltages_of(damper)))
    known = force.ReachedSpeeds(T, U, np.full((T.size, U.size), table.speed_max_m_per_s))
    return _within(table, damper, temperatures, known, control)


def _within(
    table: TableConfig,
    damper: Damper,
    temperatures: Sequence[float | None],
    envelope: ReachedSpeeds,
    control: Control,
    stroke: float | None = None,
) -> Table:
    """Tabulate the force of a damper that is known within an envelope, and up to a stroke where it was tested."""
    from pzd.force_table import force, lookup

    nodes = force.grid(table, damper, temperatures, envelope)
    notes = TableNotes(
        outside=table.outside,
        reached_m_per_s=float(np.nanmax(envelope.speeds)),
        reached_stroke_m=stroke,
        lost=force.lost(damper, nodes.temperatures, nodes.velocities),
        not_monotone=force.not_monotone(damper, nodes.temperatures, nodes.velocities, control),
    )
    for line in notes.not_monotone:
        log.info("table: %s", line)
    forward = Table(force.force_rows(table, damper, nodes, envelope), (), notes)
    return replace(forward, inverse=lookup.inverse_rows(table, forward))


def _reached_stroke(records: Sequence[Record]) -> float:
    """Return the farthest that a record goes from the middle of the stroke of all [m]."""
    middle = mid_stroke(record.displacement for record in records)
    return max(float(np.max(np.abs(record.displacement - middle))) for record in records)


def _temperatures(table: TableConfig, damper: Damper, records: Sequence[Record]) -> tuple[float | None, ...]:
    """Return the temperatures of the table: as configured, over the rig's range under drift, else the damper's."""
    from pzd.damper.confounders import known
    from pzd.force_table.force import temperatures_of

    recorded = [r.temperature for r in records if r.temperature is not None]
    if not recorded:
        return (None,)
    if table.temperatures_degC is not None:
        return tuple(sorted(set(table.temperatures_degC)))
    if not any(known()[name].place == "material" for name in damper.effects):
        return temperatures_of(damper)
    low, high = min(float(t.min()) for t in recorded), max(float(t.max()) for t in recorded)
    return tuple(float(t) for t in np.unique(np.linspace(low, high, WARM_STEPS)))
