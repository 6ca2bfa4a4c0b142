"""What there is to export: the damper of a run and its table, with what other tools ask about them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pzd.artefacts import Table
from pzd.damper.model import Damper
from pzd.quantities import Control
from pzd.record import Array
from pzd.schema.errors import ConfigError
from pzd.simulate.car import HalfCar
from pzd.simulate.policy import TieBreak
from pzd.table.lookup import Lookup

WRITTEN_BY_PZD = re.compile(rb"pzd \S+, config ")
"""How `Content.origin` begins, which every file holds: what has no such bytes is not from an export."""
NEAR_ZERO = 1e-9
"""Speed that stands for -0 and +0 where a tool wants velocities that rise strictly [m/s].

The jump of dry friction is drawn over twice this speed, less than a ten-millionth of what a rig can resolve.
"""
_HELD = 1.01
"""Where a table is held beyond its last speed, it ends in a level piece up to this multiple of that speed."""


@dataclass(frozen=True, eq=False)
class Grid:
    """The table of force as regular arrays, its velocities rising strictly through zero."""

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
    """The damper of a run, as every format is given it."""

    name: str
    """Name of the run; files are called after it."""
    version: str
    """Version of pzd that writes."""
    config: str
    """File name of the config that the run is of."""
    control: Control
    damper: Damper
    """With the adopted effects."""
    table: Table
    force_levels: int
    """Levels of force of an inverse at each velocity."""
    car: HalfCar
    """Whose comfort law a control unit follows."""
    tie_break: TieBreak
    """Which of the forces that make |a_K| smallest."""
    setting: str | None = None
    """Setting of the damper, where the config says of which one it is."""
    edited: tuple[str, ...] = ()
    """Files of the run that somebody edited by hand since it was written."""
    marks: tuple[str, ...] = ()
    """Why the damper is not to be trusted."""

    @property
    def origin(self) -> str:
        """Where the damper comes from, and what speaks against it: what each header says."""
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
        """Whether the table has more than one control signal, so that there is something to interpolate and to set."""
        return self.lookups[0].voltages.size > 1

    @property
    def held(self) -> bool:
        """Whether the force is held beyond the last speed of the table; otherwise it goes on along the last slope."""
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
        speeds = np.concatenate([[NEAR_ZERO], speeds[1:], speeds[-1:] * _HELD if self.held else []])
        velocities = np.concatenate([-speeds[::-1], speeds])
        forces = [lookup.force(first.voltages[:, np.newaxis], velocities[np.newaxis, :]) for lookup in self.lookups]
        return Grid(self.temperatures, first.voltages, velocities, np.stack(forces))

    def full_grid(self, name: str) -> Grid:
        """The same, for a format that cannot hold an empty cell.

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
    """Lines of a comment, each behind its mark."""
    return "".join(f"{mark} {line}".rstrip() + "\n" for line in lines)
