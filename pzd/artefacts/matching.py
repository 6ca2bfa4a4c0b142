"""Which test or condition of a rig a few stated numbers mean: the one place that says when two are the same."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TypeVar

from pzd.artefacts.characteristics import Characteristics, GasAndFrictionRow
from pzd.artefacts.identified import MeasureRow, ParameterRow
from pzd.record import CONSTANT_SHARE, SAME_TEMPERATURE

SAME_MOTION = 0.05
"""Frequencies, amplitudes and speeds that differ by less, relative, are the same: stands reach what they are set to
within a few per cent, and nobody tests at two values closer than that."""

Row = TypeVar("Row", MeasureRow, ParameterRow)


@dataclass(frozen=True)
class Conditions:
    """Conditions of a test; None where any will do."""

    setting: str | None = None
    voltage_V: float | None = None
    temperature_degC: float | None = None
    frequency_Hz: float | None = None
    amplitude_m: float | None = None

    def __str__(self) -> str:
        """In words."""
        units = {"voltage_V": "V", "temperature_degC": "°C", "frequency_Hz": "Hz", "amplitude_m": "m"}
        numbers = [(getattr(self, name), unit) for name, unit in units.items()]
        said = [self.setting] if self.setting else []
        said += [f"{value:g} {unit}" for value, unit in numbers if value is not None]
        return ", ".join(said) or "any condition"


ANY = Conditions()
"""No condition is stated."""


def same_motion(a: float, b: float) -> bool:
    """Whether two frequencies, amplitudes or speeds are the same, within `SAME_MOTION` of the larger."""
    return abs(a - b) <= SAME_MOTION * max(abs(a), abs(b))


def force_behind(found: Characteristics, row: GasAndFrictionRow) -> float:
    """The largest force of the slowest tests of a condition [N]: gas force and friction were read from them.

    The two are a mean and half a difference of such forces, so no digit below the last one of these tells anything.

    Parameters
    ----------
    found : with the tests
    row : gas force and friction of a condition
    """
    condition = (row.setting, row.voltage_V, row.temperature_degC)
    mine = [r for r in found.peak_velocity if (r.setting, r.voltage_V, r.temperature_degC) == condition]
    slowest = [r for r in mine if same_motion(r.speed, row.velocity_m_per_s)]
    forces = [force for r in slowest for force in (r.rebound_force_N, r.compression_force_N) if force is not None]
    return max(map(abs, forces), default=0.0)


def voltage_margin(rows: Sequence[MeasureRow] | Sequence[ParameterRow]) -> float:
    """How far apart two voltages of a rig may be to count as one: 2 % of the larger of span and magnitude [V]."""
    voltages = [0.0, *(row.voltage_V for row in rows if row.voltage_V is not None)]
    return CONSTANT_SHARE * (max(voltages) - min(voltages))


def matching(rows: Sequence[Row], wanted: Conditions, margin: float | None = None) -> tuple[Row, ...]:
    """The tests, or the identified conditions, that meet every stated condition.

    A condition of the motion says nothing about rows that hold no motion: those of the identified parameters.

    Parameters
    ----------
    rows : of the rig
    wanted : the conditions
    margin : of the voltage [V]; None for that of the rows

    Returns
    -------
    the rows, nearest in temperature first, else in their own order; a row without a value does not meet a condition
    """
    within = voltage_margin(rows) if margin is None else margin
    found = [row for row in rows if _meets(row, wanted, within)]
    return tuple(sorted(found, key=lambda row: abs((row.temperature_degC or 0.0) - (wanted.temperature_degC or 0.0))))


def undecided(rows: Sequence[Row], found: Sequence[Row], wanted: Conditions) -> tuple[str, ...]:
    """The conditions that were left open and in which the rows found differ, so that no one of them is meant.

    Parameters
    ----------
    rows : all of the rig
    found : those that meet what was stated, at least one
    wanted : what was stated

    Returns
    -------
    names of columns; none where the rows found are one test and its repetitions
    """
    margin, first = voltage_margin(rows), found[0]
    names = [f.name for f in fields(wanted) if getattr(wanted, f.name) is None and hasattr(first, f.name)]
    return tuple(
        name for name in names if len(matching(found, Conditions(**{name: getattr(first, name)}), margin)) < len(found)
    )


def _meets(row: MeasureRow | ParameterRow, wanted: Conditions, margin: float) -> bool:
    still = wanted.setting in (None, row.setting)
    still = still and _within(row.voltage_V, wanted.voltage_V, margin)
    still = still and _within(row.temperature_degC, wanted.temperature_degC, SAME_TEMPERATURE)
    if isinstance(row, MeasureRow):
        still = still and _moves(row.frequency_Hz, wanted.frequency_Hz) and _moves(row.amplitude_m, wanted.amplitude_m)
    return still


def _within(found: float | None, wanted: float | None, margin: float) -> bool:
    return wanted is None or (found is not None and abs(found - wanted) <= margin)


def _moves(found: float | None, wanted: float | None) -> bool:
    return wanted is None or (found is not None and same_motion(found, wanted))
