"""The damper in the language of the trade: rebound and compression, bleed, knee, blow-off, gas, friction, N a click."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from pzd.artefacts import ClickRow, UnitRow
from pzd.artefacts.knee import DIRECTIONS, OF_A_DIRECTION, DirectionOfCondition
from pzd.report.blocks import Block, Paragraph, TextTable
from pzd.report.context import ReportContext
from pzd.report.wording import DASH, amount, interval, number, sentence

_FOLD = 12
_CONDITION = ("setting", "temperature")


def trade_blocks(context: ReportContext) -> Iterator[Block]:
    """Which law is handed on and why, the knee law of all conditions, and the force a click or unit; else nothing."""
    knees = context.identified.knees
    if not knees.rows:
        return
    laws = [
        f"{row.setting}: {row.law}, {row.reason}" if row.setting else f"{row.law}, {row.reason}" for row in knees.laws
    ]
    yield Paragraph(f"Law of the element handed on: {sentence('; '.join(laws))}")
    yield _forces(context)
    yield _parameters(context)
    yield _of_both(context)
    if knees.clicks:
        yield _clicks(context, knees.clicks)
    if knees.per_unit:
        yield _per_unit(context, knees.per_unit)
    yield _kept_back(context)


def _forces(context: ReportContext) -> TextTable:
    """Force at the trade's speeds."""
    knees = context.identified.knees
    header = (*_header(context), "direction", *(f"at {amount(v, 'm/s')}" for v in knees.speeds))
    rows = []
    for each in knees.directions():
        told = [amount(force, "N") for force in each.forces]
        inside = zip(told, each.inside, strict=True)
        rows.append((*_direction(context, each), *(t if known or t == DASH else f"({t})" for t, known in inside)))
    title = (
        "Force at the speeds of the trade, as a rig records it with the gas force at mid-stroke, in brackets beyond "
        "what the tests reached"
    )
    return TextTable(title, header, tuple(rows)).without_empty(context.control.name, *_CONDITION)


def _parameters(context: ReportContext) -> TextTable:
    """Bleed, knee and blow-off of either direction."""
    header = (*_header(context), "direction", "bleed [N s/m]", "knee [N]", "knee [m/s]", "blow-off [N s/m]")
    rows = tuple(
        (*_direction(context, each), *(interval(*bounds) for bounds in each.intervals[: len(OF_A_DIRECTION)]))
        for each in context.identified.knees.directions()
    )
    title = "Bleed, knee (with friction, without gas) and blow-off with 95 % intervals"
    return TextTable(title, header, rows).without_empty(context.control.name, *_CONDITION)


def _of_both(context: ReportContext) -> TextTable:
    """Gas and friction, which both directions share, and how far all of it is to be trusted."""
    header = (*_header(context), "gas force [N]", "seal friction [N]", "status")
    rows = tuple(
        (
            *_place(context, each.row.setting, each.row.voltage_V, each.row.temperature_degC),
            *(interval(*bounds) for bounds in each.intervals[len(OF_A_DIRECTION) :]),
            each.row.status,
        )
        for each in context.identified.knees.directions()
        if each.direction == DIRECTIONS[0]
    )
    title = "Gas force at mid-stroke and seal friction with 95 % intervals, and the status of the condition"
    return TextTable(title, header, rows).without_empty(context.control.name, *_CONDITION)


def _direction(context: ReportContext, each: DirectionOfCondition) -> tuple[str, ...]:
    row = each.row
    return *_place(context, row.setting, row.voltage_V, row.temperature_degC), each.direction


def _clicks(context: ReportContext, clicks: Sequence[ClickRow]) -> TextTable:
    rows = tuple(
        (
            *_place(context, row.setting, row.voltage_V, row.temperature_degC),
            f"{number(row.from_click)} to {number(row.to_click)}",
            amount(row.velocity_m_per_s, "m/s"),
            number(row.rebound_N_per_click),
            number(row.compression_N_per_click),
        )
        for row in clicks
    )
    header = (*_header(context), "position", "speed", "rebound [N a click]", "compression [N a click]")
    title = "Force a click, without the gas: by how much the magnitude rises with the number of the clicker"
    return TextTable(title, header, rows, folded=len(rows) > _FOLD).without_empty(context.control.name, *_CONDITION)


def _per_unit(context: ReportContext, found: Sequence[UnitRow]) -> TextTable:
    rows = tuple(
        (
            *_place(context, row.setting, row.voltage_V, row.temperature_degC),
            f"{number(row.from_value)} to {amount(row.to_value, row.unit)}",
            amount(row.velocity_m_per_s, "m/s"),
            *(
                amount(force, f"N/{row.unit}")
                for force in (row.rebound_N_per_unit, row.compression_N_per_unit, row.gas_force_N_per_unit)
            ),
        )
        for row in found
    )
    header = (*_header(context), "from", "speed", "rebound", "compression", "gas force")
    title = (
        "Force a unit of pressure or length: by how much the magnitude without the gas rises, and how the gas force "
        "itself changes, below zero where it pushes the rod out more"
    )
    return TextTable(title, header, rows, folded=len(rows) > _FOLD).without_empty(context.control.name, *_CONDITION)


def _kept_back(context: ReportContext) -> TextTable:
    rows = tuple(
        (
            row.record,
            *_place(context, row.setting, row.voltage_V, row.temperature_degC),
            number(row.W_s_bingham),
            number(row.W_s_knee),
        )
        for row in context.identified.knees.predicted
    )
    header = ("test kept back", *_header(context), "W_s by one T0 and C", "W_s by the knee law")
    title = "Tests predicted by both laws, each fitted without them"
    return TextTable(title, header, rows, folded=True).without_empty(context.control.name, *_CONDITION)


def _header(context: ReportContext) -> tuple[str, ...]:
    return _CONDITION[0], context.control.name, _CONDITION[1]


def _place(
    context: ReportContext, setting: str | None, voltage: float | None, temperature: float | None
) -> tuple[str, ...]:
    return setting or DASH, context.voltage(voltage), amount(temperature, "degC")
