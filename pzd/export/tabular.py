"""The damper as plain tables: force, inverse, T0, C and k, the parameters of the effects, and what these count from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pzd.artefacts import ForceRow, InverseRow
from pzd.damper.competing_forms import known
from pzd.damper.model import BaseRow
from pzd.export.content import Content
from pzd.quantities import CHANNELS, DAMPING, DISPLACEMENT, FRICTION, STIFFNESS, TEMPERATURE, VOLTAGE
from pzd.schema.model import Frozen

Cell = float | int | str | None


class EffectRow(Frozen):
    """One value of a parameter of an adopted effect."""

    effect: str
    parameter: str
    voltage_V: float | None
    """At which it holds; None at every one."""
    value: float
    unit: str


class ReferencePointRow(Frozen):
    """What the laws of the effects count temperature and displacement from."""

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
    """The tables of a damper by name; one that would have no row is left out."""
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
    """A row a value of every parameter of the adopted effects."""
    rows = []
    for name, given in content.damper.effects.items():
        nodes = given.get("at_voltage_V")
        for parameter in known()[name].parameters:
            value, unit = given[parameter.name], content.control.own_unit(parameter.unit)
            values = value if isinstance(value, tuple) else (value,)
            voltages = nodes if isinstance(value, tuple) and isinstance(nodes, tuple) else (None,)
            rows += [
                EffectRow(effect=name, parameter=parameter.name, voltage_V=U, value=v, unit=unit)
                for U, v in zip(voltages, values, strict=True)
            ]
    return tuple(rows)


def _columns(content: Content, model: type[Frozen], rows: Sequence[Frozen]) -> Columns:
    control = content.control
    quantities = (*CHANNELS, FRICTION, DAMPING, STIFFNESS)
    units = {q.column: q.unit for q in quantities} | {control.renamed(VOLTAGE.column): control.unit}
    units |= {"reference_temperature_degC": TEMPERATURE.unit, "zero_m": DISPLACEMENT.unit}
    left_out = set() if content.controlled else {VOLTAGE.column}
    fields = [name for name in model.model_fields if name not in left_out]
    cells = {control.renamed(name): tuple(getattr(row, name) for row in rows) for name in fields}
    return Columns(cells, {name: units[name] for name in cells if name in units})
