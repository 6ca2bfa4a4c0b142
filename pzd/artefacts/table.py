"""Artefact of table: force over temperature, voltage and velocity, its inverse, and settings between tested ones."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal, Self

from pydantic import Field

from pzd.artefacts.csv_rows import Files, read_files, write_files
from pzd.quantities import Control
from pzd.schema.model import Frozen
from pzd.schema.validate import read_json, write_json


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
    """Prediction error of one tested setting, interpolated from its neighbours as if it had not been tested."""

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


def at_largest_speed(rows: Sequence[SettingRow]) -> tuple[tuple[SettingRow, SettingRow], ...]:
    """Return the rows of the largest speed in rebound and in compression, of each setting, temperature and control.

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
    reached_stroke_m: float | None = None
    """The farthest that a test of the setting went from the middle of the stroke; an earlier version has none."""
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
    """How well such interpolation predicts tested ones, where three settings or more were tested."""

    def write(self, folder: Path, control: Control) -> None:
        """Write force.csv, inverse.csv and notes.json; settings.csv and settings_left_out.csv where there are any."""
        write_files(self, FORCES, folder, control)
        write_json(folder / "notes.json", self.notes, control)
        if self.settings:
            write_files(self, SETTINGS, folder, control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again."""
        notes = read_json(folder / "notes.json", TableNotes, control)
        return cls(
            **read_files(FORCES, folder, control),
            notes=notes,
            **read_files(SETTINGS, folder, control, optional=SETTINGS),
        )

    @staticmethod
    def read_settings(folder: Path, control: Control) -> tuple[tuple[SettingRow, ...], tuple[SettingLeftOutRow, ...]]:
        """Return `settings` and `settings_left_out`, both empty where the config asks for none."""
        rows = read_files(SETTINGS, folder, control, optional=SETTINGS)
        return rows["settings"], rows["settings_left_out"]


FORCES: Files = {"force": ("force.csv", ForceRow), "inverse": ("inverse.csv", InverseRow)}
SETTINGS: Files = {
    "settings": ("settings.csv", SettingRow),
    "settings_left_out": ("settings_left_out.csv", SettingLeftOutRow),
}


# --- Settings on one axis: names that differ by one number alone, as `gap 0.15 mm` and `gap 0.25 mm` ---
#
# The number of a clicker, a gap, a shim or a gas pressure stands in the name of a setting; the rest of the name says
# what it is a number of.

PRESSURES = frozenset({"psi", "bar", "mbar", "Pa", "hPa", "kPa", "MPa"})
"""Units of the gas pressure of a damper, as their symbols are written."""
LENGTHS = frozenset({"mm", "um", "µm", "μm", "in", "mil"})
"""Units of gaps and shims."""
_NUMBER = re.compile(r"\d+(?:\.\d+)?")
_UNIT = re.compile(r"[ _-]?([A-Za-zµμ]+)")


@dataclass(frozen=True)
class NumberedSetting:
    """One number in the name of a setting."""

    setting: str
    axis: str
    """The name with # in the place of the number: what two settings must share to differ by this number alone."""
    value: float
    unit: str
    """Of a pressure or a length, where it stands behind the number; empty where the number merely counts, as clicks."""


@dataclass(frozen=True)
class Neighbours:
    """A setting between two tested ones, which differ from it by one number alone."""

    wanted: NumberedSetting
    lower: NumberedSetting
    upper: NumberedSetting
    """The same as `lower` where the setting itself was tested."""

    @property
    def share(self) -> float:
        """Share of the distance from the lower to the upper one."""
        way = self.upper.value - self.lower.value
        return (self.wanted.value - self.lower.value) / way if way > 0.0 else 0.0


def numbers_in(setting: str | None) -> tuple[NumberedSetting, ...]:
    """Return every number in the name of a setting.

    >>> numbers_in("gap 0.15 mm")
    (NumberedSetting(setting='gap 0.15 mm', axis='gap # mm', value=0.15, unit='mm'),)
    """
    name = setting or ""
    found = []
    for number in _NUMBER.finditer(name):
        word = _UNIT.match(name, number.end())
        unit = word[1] if word and word[1] in PRESSURES | LENGTHS else ""
        axis = f"{name[: number.start()]}#{name[number.end() :]}"
        found.append(NumberedSetting(name, axis, float(number.group()), unit))
    return tuple(found)


def on_axis(axis: str, tested: Sequence[str | None]) -> tuple[NumberedSetting, ...]:
    """Return the tested settings on an axis, by rising number; `gap 0.2 mm` and `gap 0.20 mm` count once."""
    found: dict[float, NumberedSetting] = {}
    for name in sorted({name for name in tested if name is not None}):
        for one in numbers_in(name):
            if one.axis == axis:
                found.setdefault(one.value, one)
    return tuple(found[value] for value in sorted(found))


def neighbours(wanted: str, tested: Sequence[str | None]) -> Neighbours:
    """Return the tested settings to either side of a wanted one, on the first axis of its name that has two.

    >>> found = neighbours("gap 0.2 mm", ["gap 0.15 mm", "gap 0.25 mm"])
    >>> found.lower.setting, found.upper.setting, round(found.share, 3)
    ('gap 0.15 mm', 'gap 0.25 mm', 0.5)

    Parameters
    ----------
    wanted : name of the wanted setting
    tested : the settings of the rig's records

    Raises
    ------
    ValueError : when no two tested ones differ from it by one number alone, or when it lies beyond them
    """
    beyond: tuple[NumberedSetting, ...] = ()
    for number in numbers_in(wanted):
        line = on_axis(number.axis, tested)
        if len(line) < 2:
            continue
        lower = [one for one in line if one.value <= number.value]
        upper = [one for one in line if one.value >= number.value]
        if lower and upper:
            return Neighbours(number, lower[-1], upper[0])
        beyond = beyond or line
    if beyond:
        raise ValueError(
            f"must lie between {beyond[0].setting} and {beyond[-1].setting}, which were tested: nothing is "
            f"extrapolated (got {wanted})"
        )
    names = ", ".join(sorted({name for name in tested if name is not None})) or "none that has a name"
    raise ValueError(
        f"no two tested settings differ from it by one number alone, as gap 0.15 mm and gap 0.25 mm do from gap "
        f"0.2 mm; tested: {names} (got {wanted})"
    )
