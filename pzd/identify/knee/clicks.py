"""Force a click and force a unit: what one position of a clicker, one psi or one mm more makes of the force.

At the trade's speeds, the gas apart. The number is the control signal, as in `control: {name: rebound, unit: clicks}`
or `{name: gas, unit: psi}`, or one in the name of the setting, as in "R 3 C 12", "gas 150 psi" or "gap 0.2 mm".
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from pzd.artefacts import ClickRow, KneeForceRow, UnitRow
from pzd.artefacts.numbered_settings import LENGTHS, PRESSURES, numbers_in
from pzd.quantities import Control
from pzd.record import SAME_TEMPERATURE


@dataclass(frozen=True)
class Axis:
    """What varies from one position to the next; all else is equal."""

    setting: str | None
    """With # for the number, where it stands there."""
    voltage: float | None
    """Where the number is not the control signal itself."""
    unit: str
    """Of a pressure or a length; empty where the number counts clicks."""


@dataclass(frozen=True)
class Rise:
    """By how much magnitudes of the force rise from one position on an axis to the next one, at one speed [N]."""

    axis: Axis
    low: float
    high: float
    before: KneeForceRow
    rebound: float
    """Without the gas."""
    compression: float
    gas: float
    """Of the gas force itself, which has a sign: below zero where it pushes the rod out more."""

    @property
    def way(self) -> float:
        """From the lower position to the higher one, in the unit of the axis."""
        return self.high - self.low


def clicks(forces: Sequence[KneeForceRow], control: Control) -> tuple[ClickRow, ...]:
    """The force a click between neighbouring positions of every clicker, all other things equal.

    Parameters
    ----------
    forces : of every condition at the trade's speeds
    control : the control signal
    """
    return tuple(
        ClickRow(
            setting=rise.axis.setting,
            voltage_V=rise.axis.voltage,
            temperature_degC=rise.before.temperature_degC,
            from_click=rise.low,
            to_click=rise.high,
            velocity_m_per_s=rise.before.velocity_m_per_s,
            rebound_N_per_click=rise.rebound / rise.way,
            compression_N_per_click=rise.compression / rise.way,
        )
        for rise in _rises(forces, control)
        if not rise.axis.unit
    )


def per_unit(forces: Sequence[KneeForceRow], control: Control) -> tuple[UnitRow, ...]:
    """The force a unit of a gas pressure, gap or shim between neighbouring values, all other things equal.

    Parameters
    ----------
    forces : of every condition at the trade's speeds
    control : the control signal
    """
    return tuple(
        UnitRow(
            setting=rise.axis.setting,
            voltage_V=rise.axis.voltage,
            temperature_degC=rise.before.temperature_degC,
            unit=rise.axis.unit,
            from_value=rise.low,
            to_value=rise.high,
            velocity_m_per_s=rise.before.velocity_m_per_s,
            rebound_N_per_unit=rise.rebound / rise.way,
            compression_N_per_unit=rise.compression / rise.way,
            gas_force_N_per_unit=rise.gas / rise.way,
        )
        for rise in _rises(forces, control)
        if rise.axis.unit
    )


def _rises(forces: Sequence[KneeForceRow], control: Control) -> Iterator[Rise]:
    for axis, rows in _axes(forces, control).items():
        yield from _of_one(axis, rows)


def _axes(forces: Sequence[KneeForceRow], control: Control) -> dict[Axis, list[tuple[float, KneeForceRow]]]:
    """The rows that differ by one number alone, each with this number."""
    measured = control.unit if control.unit in PRESSURES | LENGTHS else ""
    stepped = bool(measured) or "click" in f"{control.name} {control.unit}".lower()
    found: dict[Axis, list[tuple[float, KneeForceRow]]] = defaultdict(list)
    for row in forces:
        if stepped and row.voltage_V is not None:
            found[Axis(row.setting, None, measured)].append((row.voltage_V, row))
        for number in numbers_in(row.setting):
            found[Axis(number.axis, row.voltage_V, number.unit)].append((number.value, row))
    return found


def _of_one(axis: Axis, rows: Sequence[tuple[float, KneeForceRow]]) -> Iterator[Rise]:
    """The rows of one axis: by temperature and speed, from one position to the next."""
    groups: dict[Hashable, list[tuple[float, KneeForceRow]]] = defaultdict(list)
    first: float | None = None
    for position, row in sorted(rows, key=lambda each: (each[1].temperature_degC or 0.0, each[0])):
        degrees = row.temperature_degC
        if first is None or degrees is None or degrees - first > SAME_TEMPERATURE:
            first = degrees
        groups[first, row.velocity_m_per_s].append((position, row))
    for same in groups.values():
        for (low, before), (high, after) in pairwise(sorted(same, key=lambda each: each[0])):
            if high > low:
                rebound = [row.rebound_force_N - row.gas_force_N for row in (before, after)]
                compression = [row.gas_force_N - row.compression_force_N for row in (before, after)]
                yield Rise(
                    axis,
                    low,
                    high,
                    before,
                    rebound[1] - rebound[0],
                    compression[1] - compression[0],
                    after.gas_force_N - before.gas_force_N,
                )
