"""Force over temperature, voltage and velocity, and its inverse."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal, Self

from pzd.quantities import Control
from pzd.schema.csvfile import read_rows, write_rows
from pzd.schema.jsonfile import read_json, write_json
from pzd.schema.model import Frozen


class ForceRow(Frozen):
    """One node of the table of force; at v = 0 two one-sided rows stand, -0 and +0."""

    temperature_degC: float | None
    voltage_V: float | None
    velocity_m_per_s: float
    force_N: float | None
    inside: Literal[0, 1]
    """1 within what the rig reached, 0 the model beyond."""


class InverseRow(Frozen):
    """The voltage that gives a force at a speed; None where none does."""

    temperature_degC: float | None
    velocity_m_per_s: float
    force_N: float
    voltage_V: float | None


class TableNotes(Frozen):
    """What the table cannot carry, and where it had to decide."""

    outside: Literal["clamp", "error", "model"]
    """What the table does beyond the rig's speeds."""
    reached_m_per_s: float
    """The largest speed that the rig reached."""
    lost: tuple[str, ...]
    """What a table of force over voltage and velocity cannot carry, in words."""
    not_monotone: tuple[str, ...]
    """Where force falls with rising voltage, and how that was resolved."""


@dataclass(frozen=True, eq=False)
class Table:
    """Force over temperature, voltage and velocity, its inverse, and its limits."""

    folder: ClassVar[str] = "4-table"

    force: tuple[ForceRow, ...]
    inverse: tuple[InverseRow, ...]
    notes: TableNotes

    def write(self, folder: Path, control: Control) -> None:
        """Write force.csv, inverse.csv and notes.json."""
        write_rows(folder / "force.csv", ForceRow, self.force, control)
        write_rows(folder / "inverse.csv", InverseRow, self.inverse, control)
        write_json(folder / "notes.json", self.notes, control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again."""
        return cls(
            read_rows(folder / "force.csv", ForceRow, control),
            read_rows(folder / "inverse.csv", InverseRow, control),
            read_json(folder / "notes.json", TableNotes, control),
        )
