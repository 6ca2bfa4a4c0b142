"""The damper of a run and its table, in the shapes that formats write: grid, curves, inverse, plain tables.

A format is given a `Content` and takes of it what its tool reads:

    grid, full_grid   the table of force as regular arrays
    curves            one curve of force over velocity a control signal and temperature
    inverses          the control signal for a force, over velocity and share of the range of forces
    tables            the rows of the run by column: force, inverse, base, effects, reference
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pzd.artefacts import ForceRow, InverseRow, Table
from pzd.damper.confounders import known
from pzd.damper.effect import NODE_VOLTAGES
from pzd.damper.model import BaseRow, Damper
from pzd.export.drive import Drive
from pzd.force_table.lookup import Lookup
from pzd.quantities import BINGHAM, CHANNELS, DISPLACEMENT, TEMPERATURE, VOLTAGE, Control
from pzd.record import Array
from pzd.schema.errors import ConfigError
from pzd.schema.model import Frozen, safe_name
from pzd.simulate.policies import TieBreak
from pzd.simulate.vehicle.car import HalfCar

WRITTEN_BY_PZD = re.compile(rb"pzd \S+, config ")
"""Start of `Content.origin`, which every file holds: what has no such bytes is not from an export."""
NEAR_ZERO = 1e-9
"""Speed that stands for -0 and +0 where a tool wants velocities that rise strictly [m/s].

The jump of dry friction is drawn over twice this speed, less than a ten-millionth of what a rig can resolve.
"""
_LEVEL_END = 1.01
"""A clamped table ends in a level piece up to this multiple of its last speed: tools that extrapolate the last slope
then hold the force."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Table of force as regular arrays, its velocities rising strictly through zero."""

    temperatures: tuple[float | None, ...]
    """Rising [degC]; a single None where none was recorded."""
    voltages: Array
    """(m,) rising [V]; a single 0 where the damper has no control signal."""
    velocities: Array
    """(n,) rising strictly, with `NEAR_ZERO` to both sides in place of -0 and +0 [m/s]."""
    forces: Array
    """(temperatures, m, n) force [N]; NaN where the table is empty."""


@dataclass(frozen=True, eq=False)
class Content:
    """The damper of a run, as it is given to every format."""

    name: str
    """Name of the run; files are called after it."""
    version: str
    """Version of pzd."""
    config: str
    """File name of the config."""
    control: Control
    damper: Damper
    """With the adopted effects."""
    table: Table
    force_levels: int
    """Levels of force of an inverse at each velocity."""
    car: HalfCar
    """Whose comfort law a control unit follows."""
    tie_break: TieBreak
    """Which of the forces that make abs(a_K) smallest a control unit takes."""
    setting: str | None = None
    """Setting of the damper, where the config names one."""
    edited: tuple[str, ...] = ()
    """Files of the run that were edited by hand since it was written."""
    marks: tuple[str, ...] = ()
    """Why the damper is not to be trusted."""
    by_curve: bool = False
    """Whether it is known by a measured curve alone: its table holds all of it, and `damper` is without force."""
    drive: Drive | None = None
    """What drives the stand, where that is asked for."""

    @property
    def origin(self) -> str:
        """Where the damper comes from, and what speaks against it: the text of each header."""
        setting = f", setting {' '.join(self.setting.split())}" if self.setting else ""
        by_hand = f", edited by hand: {', '.join(self.edited)}" if self.edited else ""
        marks = f", not to be trusted: {'; '.join(self.marks)}" if self.marks else ""
        return f"pzd {self.version}, config {self.config}{setting}{by_hand}{marks}"

    @property
    def controlled(self) -> bool:
        """Whether the damper has a control signal."""
        return any(row.voltage_V is not None for row in self.table.force)

    @property
    def adjustable(self) -> bool:
        """Whether the table has more than one control signal, so that there is one to set."""
        return self.lookups[0].voltages.size > 1

    @property
    def clamped(self) -> bool:
        """Whether the force is held beyond the last speed of the table; otherwise it follows the last slope."""
        return self.table.notes.outside == "clamp"

    @property
    def temperatures(self) -> tuple[float | None, ...]:
        """Temperatures of the table, rising [degC]; a single None where none was recorded."""
        return tuple(dict.fromkeys(row.temperature_degC for row in self.table.force))

    @cached_property
    def lookups(self) -> tuple[Lookup, ...]:
        """The table at each of its temperatures."""
        return tuple(Lookup.of(self.table, temperature) for temperature in self.temperatures)

    @cached_property
    def grid(self) -> Grid:
        """The table as regular arrays."""
        first = self.lookups[0]
        speeds = first.speeds[:-1]
        speeds = np.concatenate([[NEAR_ZERO], speeds[1:], speeds[-1:] * _LEVEL_END if self.clamped else []])
        velocities = np.concatenate([-speeds[::-1], speeds])
        forces = [lookup.force(first.voltages[:, np.newaxis], velocities[np.newaxis, :]) for lookup in self.lookups]
        return Grid(self.temperatures, first.voltages, velocities, np.stack(forces))

    def full_grid(self, name: str) -> Grid:
        """Return the grid for a format that cannot hold an empty cell.

        Parameters
        ----------
        name : of the format

        Raises
        ------
        ConfigError : when the table has empty cells
        """
        if np.isnan(self.grid.forces).any():
            raise ConfigError(
                f"table.outside: --to {name} cannot hold the empty cells that the table has beyond the speeds of the "
                "rig; say model or clamp (got error)"
            )
        return self.grid


def comment(lines: Sequence[str], mark: str) -> str:
    """Write lines of a comment, each behind its mark."""
    return "".join(f"{mark} {line}".rstrip() + "\n" for line in lines)


# --- Curves of force over velocity ---


@dataclass(frozen=True, eq=False)
class ForceCurve:
    """Force over velocity at one control signal and temperature."""

    name: str
    """Of its file, without the ending: that of the run with what sets the curve apart from the others."""
    condition: str
    """The control signal and the temperature in words; empty where there is neither."""
    velocities: Array
    """(n,) rising strictly [m/s]."""
    forces: Array
    """(n,) [N]."""


def curves(content: Content, name: str) -> Iterator[ForceCurve]:
    """Yield the curves of the table, one a control signal and temperature.

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


# --- Inverse: the control signal for a force ---


@dataclass(frozen=True, eq=False)
class Inverse:
    """Control signal over velocity and share of the range of forces there, at one temperature; all can be reached."""

    shares: Array
    """(s,) from 0, the lowest force that the damper gives at a velocity, to 1, the highest."""
    low: Array
    """(n,) lowest force at each velocity of the grid [N]."""
    high: Array
    """(n,) highest force [N]."""
    signals: Array
    """(n, s) lowest control signal that gives the force [V]; NaN where the table is empty."""


def inverses(content: Content) -> tuple[Inverse, ...]:
    """Compute the inverse at each temperature of the table."""
    velocities = content.grid.velocities
    shares = np.linspace(0.0, 1.0, content.force_levels)
    found = []
    for lookup in content.lookups:
        lowest, highest = lookup.range(velocities)
        low, high = (np.where(lowest <= highest, force, np.nan) for force in (lowest, highest))
        wanted = low[:, np.newaxis] + shares * (high - low)[:, np.newaxis]
        found.append(Inverse(shares, low, high, lookup.nearest_voltage_for(wanted, velocities[:, np.newaxis])))
    return tuple(found)


# --- Plain tables ---

Cell = float | int | str | None


class EffectRow(Frozen):
    """One value of a parameter of an adopted effect."""

    effect: str
    parameter: str
    voltage_V: float | None
    """At which it holds; None where it holds at every one."""
    value: float
    unit: str


class ReferencePointRow(Frozen):
    """Reference temperature and displacement zero of the laws of the effects."""

    reference_temperature_degC: float | None
    """T_ref; None where none was given."""
    zero_m: float


@dataclass(frozen=True)
class Columns:
    """One table, column by column."""

    cells: Mapping[str, tuple[Cell, ...]]
    """By the name of the column."""
    units: Mapping[str, str]
    """Of the columns that have one."""


def tables(content: Content) -> dict[str, Columns]:
    """Return the tables of a damper by name, without those that have no row."""
    if content.by_curve:
        inverse = {"inverse": _columns(content, InverseRow, content.table.inverse)} if content.table.inverse else {}
        return {"force": _columns(content, ForceRow, content.table.force)} | inverse
    damper = content.damper
    reference = ReferencePointRow(reference_temperature_degC=damper.reference_temperature_degC, zero_m=damper.zero_m)
    every = {
        "force": _columns(content, ForceRow, content.table.force),
        "inverse": _columns(content, InverseRow, content.table.inverse),
        "base": _columns(content, BaseRow, damper.base),
        "effects": _columns(content, EffectRow, effect_rows(content)),
        "reference": _columns(content, ReferencePointRow, (reference,) if damper.effects else ()),
    }
    return {name: table for name, table in every.items() if any(table.cells.values())}


def effect_rows(content: Content) -> tuple[EffectRow, ...]:
    """Return the parameters of the adopted effects, one row a value."""
    rows = []
    for name, given in content.damper.effects.items():
        nodes = given.get(NODE_VOLTAGES)
        for parameter in known()[name].parameters:
            value = given.get(parameter.name, parameter.neutral)
            unit = content.control.own_unit(parameter.unit)
            values = value if isinstance(value, tuple) else (value,)
            voltages = nodes if isinstance(value, tuple) and isinstance(nodes, tuple) else (None,)
            rows += [
                EffectRow(effect=name, parameter=parameter.name, voltage_V=U, value=v, unit=unit)
                for U, v in zip(voltages, values, strict=True)
            ]
    return tuple(rows)


def _columns(content: Content, model: type[Frozen], rows: Sequence[Frozen]) -> Columns:
    control = content.control
    quantities = (*CHANNELS, *BINGHAM)
    units = {q.column: q.unit for q in quantities} | {control.renamed(VOLTAGE.column): control.unit}
    units |= {"reference_temperature_degC": TEMPERATURE.unit, "zero_m": DISPLACEMENT.unit}
    left_out = set() if content.controlled else {VOLTAGE.column}
    fields = [name for name in model.model_fields if name not in left_out]
    cells = {control.renamed(name): tuple(getattr(row, name) for row in rows) for name in fields}
    return Columns(cells, {name: units[name] for name in cells if name in units})
