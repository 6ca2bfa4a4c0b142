"""Force over temperature, voltage and velocity, and its inverse."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal, Self

from pydantic import Field

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


class SettingRow(Frozen):
    """Force at one node of a setting between two tested ones; at v = 0 two one-sided rows stand, -0 and +0."""

    setting: str
    value: float
    """The number in its name."""
    lower_setting: str
    """The tested one below, with the number next to it."""
    upper_setting: str
    temperature_degC: float | None
    voltage_V: float | None
    velocity_m_per_s: float
    force_N: float
    """Linear in the number between the forces of both neighbours."""
    static_force_N: float
    """What stands beside it at rest in the middle of the stroke, as a gas force does; a rig records the sum of both."""


class SettingLeftOutRow(Frozen):
    """How well one tested setting is predicted from its neighbours, as if it had not been tested."""

    setting: str
    lower_setting: str
    upper_setting: str
    reached_m_per_s: float = Field(gt=0.0)
    """Up to which speed all three were tested."""
    peak_force_N: float = Field(gt=0.0)
    """Largest force of the setting itself there."""
    rms_share_of_peak: float = Field(ge=0.0)
    """R.m.s. difference between the force predicted and that of the setting itself, over both directions."""
    largest_share_of_peak: float = Field(ge=0.0)


def fastest(rows: Sequence[SettingRow]) -> tuple[tuple[SettingRow, SettingRow], ...]:
    """The rows of the largest speed in rebound and in compression, of each setting, temperature and control signal.

    Parameters
    ----------
    rows : of `settings.csv`
    """
    found: dict[tuple[str, float | None, float | None], list[SettingRow]] = {}
    for row in rows:
        found.setdefault((row.setting, row.temperature_degC, row.voltage_V), []).append(row)
    ordered = [sorted(mine, key=lambda row: row.velocity_m_per_s) for mine in found.values()]
    return tuple((mine[-1], mine[0]) for mine in ordered)


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
    settings: tuple[SettingRow, ...] = ()
    """Of settings between tested ones, where the config asks for some."""
    settings_left_out: tuple[SettingLeftOutRow, ...] = ()
    """What to think of them, where three settings or more were tested."""

    def write(self, folder: Path, control: Control) -> None:
        """Write force.csv, inverse.csv and notes.json; settings.csv and settings_left_out.csv where there are any."""
        write_rows(folder / "force.csv", ForceRow, self.force, control)
        write_rows(folder / "inverse.csv", InverseRow, self.inverse, control)
        write_json(folder / "notes.json", self.notes, control)
        if self.settings:
            write_rows(folder / "settings.csv", SettingRow, self.settings, control)
            write_rows(folder / "settings_left_out.csv", SettingLeftOutRow, self.settings_left_out, control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again."""
        return cls(
            read_rows(folder / "force.csv", ForceRow, control),
            read_rows(folder / "inverse.csv", InverseRow, control),
            read_json(folder / "notes.json", TableNotes, control),
            *cls.read_settings(folder, control),
        )

    @staticmethod
    def read_settings(folder: Path, control: Control) -> tuple[tuple[SettingRow, ...], tuple[SettingLeftOutRow, ...]]:
        """The force at settings between tested ones, and how well left-out ones are predicted; none where not asked."""
        if not (folder / "settings.csv").is_file():
            return (), ()
        return (
            read_rows(folder / "settings.csv", SettingRow, control),
            read_rows(folder / "settings_left_out.csv", SettingLeftOutRow, control),
        )
