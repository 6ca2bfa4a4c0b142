"""The table as curves of force over velocity, one a control signal and temperature."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from pzd.export.content import Content
from pzd.quantities import TEMPERATURE
from pzd.record import Array
from pzd.schema.filename import safe_name


@dataclass(frozen=True, eq=False)
class ForceCurve:
    """Force over velocity at one control signal and temperature."""

    name: str
    """Of its file, without the ending: that of the run with what tells the curve from the others."""
    condition: str
    """The control signal and the temperature in words; empty where there is neither."""
    velocities: Array
    """(n,) rising strictly [m/s]."""
    forces: Array
    """(n,) [N]."""


def curves(content: Content, name: str) -> Iterator[ForceCurve]:
    """Every curve of the table.

    Parameters
    ----------
    content : the damper
    name : of the format

    Raises
    ------
    ConfigError : when the table has empty cells
    """
    grid, control = content.full_grid(name), content.control
    for temperature, forces in zip(grid.temperatures, grid.forces, strict=True):
        for signal, force in zip(grid.voltages, forces, strict=True):
            labels = [safe_name(f"{signal:.12g}{control.unit}")] if content.controlled else []
            words = [f"{control.name} {signal:.12g} {control.unit}"] if content.controlled else []
            if temperature is not None:
                words.append(f"{temperature:.12g} {TEMPERATURE.unit}")
            if len(grid.temperatures) > 1:
                labels.append(f"{temperature:.12g}{TEMPERATURE.unit}")
            yield ForceCurve("-".join([content.name, *labels]), ", ".join(words), grid.velocities, force)
