"""What the damper is: its parameters, its force, how quickly it responds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from pzd.artefacts import ClickRow, ForceRow, ParameterRow, UnitRow
from pzd.artefacts.knee import DIRECTIONS, OF_A_DIRECTION, OF_BOTH, DirectionOfCondition
from pzd.artefacts.table import fastest
from pzd.damper.confounders import known
from pzd.damper.model import BaseRow
from pzd.quantities import DAMPING, FRICTION, STIFFNESS, VOLTAGE
from pzd.report.blocks import (
    DASH,
    Block,
    Notes,
    Paragraph,
    Pictures,
    Section,
    TextTable,
    amount,
    galleries,
    interval,
    listed,
    number,
    percent,
    sentence,
    unit_of,
)
from pzd.report.context import ReportContext, effect_in_words, static_force_at, static_force_in_words

# ----------------------------------------------------------------------------------------------------
# Settings between tested ones: their force, between which tests it lies, and how far such a line can be trusted.


def settings_blocks(context: ReportContext) -> Iterator[Block]:
    """The settings that the config asks for, and tested ones left out; nothing where it asks for none."""
    if not context.table.settings:
        return
    yield Paragraph(
        "The settings below were not tested. Their force is interpolated, linear in the number of the setting, between "
        "the tested ones to either side, each as identify hands it on, and only where both were tested: "
        f"4-table/settings.csv holds all of it. {_trust(context)}"
    )
    yield _forces(context)
    if context.table.settings_left_out:
        yield _left_out(context)


def _trust(context: ReportContext) -> str:
    if not context.table.settings_left_out:
        return "How good this is cannot be told: for that a third setting must be tested, between two others."
    return (
        "How good this is tell tested settings that are left out and predicted in the same way; their neighbours lie "
        "further apart than those used above."
    )


def _forces(context: ReportContext) -> TextTable:
    places = ("temperature", context.control.name)
    rows = tuple(
        (
            rebound.setting,
            amount(rebound.temperature_degC, "degC"),
            context.voltage(rebound.voltage_V),
            amount(rebound.velocity_m_per_s, "m/s"),
            *(amount(row.force_N + row.static_force_N, "N") for row in (rebound, compression)),
            f"{rebound.lower_setting} and {rebound.upper_setting}",
        )
        for rebound, compression in fastest(context.table.settings)
    )
    header = ("setting", *places, "speed", "rebound", "compression", "interpolated between")
    title = "Settings that were not tested: interpolated force at the largest speed that both neighbours reached"
    return TextTable(title, header, rows).without_empty(*places)


def _left_out(context: ReportContext) -> TextTable:
    rows = tuple(
        (
            row.setting,
            f"{row.lower_setting} and {row.upper_setting}",
            amount(row.peak_force_N, "N"),
            percent(row.rms_share_of_peak),
            percent(row.largest_share_of_peak),
        )
        for row in context.table.settings_left_out
    )
    header = ("left out", "predicted from", "its peak force", "missed by (r.m.s.)", "at most")
    return TextTable("Tested settings predicted from their neighbours, missed in % of peak force", header, rows)


# ----------------------------------------------------------------------------------------------------
# The damper in the language of the trade: rebound and compression, bleed, knee, blow-off, gas, friction, N a click.


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
    yield _knee_forces(context)
    yield _parameters(context)
    yield _of_both(context)
    if knees.clicks:
        yield _clicks(context, knees.clicks)
    if knees.per_unit:
        yield _per_unit(context, knees.per_unit)
    yield _kept_back(context)


def _knee_forces(context: ReportContext) -> TextTable:
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
        (*_direction(context, each), *(interval(*each.estimate(name)) for name in OF_A_DIRECTION))
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
            *(interval(*each.estimate(name)) for name in OF_BOTH),
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


# ----------------------------------------------------------------------------------------------------


_QUANTITIES = (FRICTION, DAMPING, STIFFNESS)
NO_FORCE = 1e-6
"""A friction of less [N] is none: no load cell shows it, and a fit leaves such numbers where it found none."""


def render(context: ReportContext, pictures: Pictures) -> Section:
    """The fourth section."""
    blocks: list[Block] = [Paragraph(_intro(context)), *trade_blocks(context), _damper_parameters(context)]
    blocks += [_alone(context)] if context.extended or context.fitted_law else []
    blocks += galleries(pictures["damper"])
    blocks += [_force(context)] if context.table.force else []
    blocks += settings_blocks(context)
    notes = context.table.notes
    if notes.not_monotone:
        blocks += [
            Paragraph(f"Force does not always rise with the {context.control.name}:"),
            Notes(notes.not_monotone, "care"),
        ]
    if notes.lost:
        blocks += [Paragraph("A table of force cannot carry:"), Notes(notes.lost)]
    blocks += [_responses(context)] if context.rides.responses else []
    blocks += [_measures(context)] if context.identified.measures else []
    return Section("damper", "What the damper is", tuple(blocks))


def _intro(context: ReportContext) -> str:
    effects = context.diagnosed.damper.effects
    laws = [f"{effect_in_words(name)}, {known()[name].law}" for name in effects]
    origin = "What belongs to the knee law stands" if context.fitted_law else "What was missing stands"
    beside = f" {origin} beside it: {listed(laws)}." if laws else ""
    return (
        "Dry friction T0, damping C and oil spring k of the Bingham element, with 95 % intervals. These allow for "
        "noise and for a gain, offset and delay of the sensors that differ from test to test. A value that the data do "
        f"not determine is left out, and the status says so.{beside}"
    )


def _damper_parameters(context: ReportContext) -> TextTable:
    """T0, C and k of the damper that everything behind uses."""
    title = "T0, C and k beside what was missing" if context.extended else "T0, C and k of the Bingham element alone"
    title = "T0, C and k beside the knee, C the mean bleed of both directions" if context.fitted_law else title
    rows = tuple(_row(context, row) for row in context.final)
    return TextTable(title, _damper_header(context), rows).without_empty(*_conditions(context))


def _alone(context: ReportContext) -> TextTable:
    """T0, C and k of the simple model: alone they also stand in for what it lacks."""
    title = "The simple model: T0, C and k of the Bingham element alone, standing in for what it lacks"
    rows = tuple(_row(context, row) for row in context.parameters)
    return TextTable(title, _damper_header(context), rows, folded=True).without_empty(*_conditions(context))


def _conditions(context: ReportContext) -> tuple[str, str]:
    """Headers of what a rig need not have recorded."""
    return context.control.name, "temperature"


def _damper_header(context: ReportContext) -> tuple[str, ...]:
    units = [f"{q.symbol} [{unit_of(q.unit)}]" for q in _QUANTITIES]
    return (*_conditions(context), *units, "W_s", "r.m.s. error", "status")


def _row(context: ReportContext, row: ParameterRow | BaseRow) -> tuple[str, ...]:
    fitted = row if isinstance(row, ParameterRow) else None
    return (
        context.voltage(row.voltage_V),
        amount(row.temperature_degC, "degC"),
        *(_shown(row, q.column) for q in _QUANTITIES),
        number(fitted.W_s if fitted else None),
        amount(fitted.rmse_N if fitted else None, "N"),
        fitted.status if fitted else "edited by hand",
    )


def _shown(row: ParameterRow | BaseRow, column: str) -> str:
    """A parameter with its interval, where it has one."""
    if isinstance(row, ParameterRow):
        return interval(*(getattr(row, f"{column}{end}") for end in ("", "_low95", "_high95")))
    return f"{parameter(getattr(row, column))} (no interval)"


def parameter(value: float) -> str:
    """A parameter that has no interval here; none is as small as a friction that no load cell shows."""
    return number(value if value >= NO_FORCE else 0.0)


def _force(context: ReportContext) -> TextTable:
    first = min((row.temperature_degC for row in context.table.force), key=lambda t: -np.inf if t is None else t)
    rows = [row for row in context.table.force if row.temperature_degC == first and row.velocity_m_per_s > 0.0]
    voltages = sorted({row.voltage_V for row in rows}, key=lambda v: v or 0.0)
    speeds = sorted({row.velocity_m_per_s for row in rows})
    at = {(row.velocity_m_per_s, row.voltage_V): row for row in rows}
    chosen = _spread(speeds, context.table.notes.reached_m_per_s)
    static = {volt: static_force_at(context, volt) for volt in voltages}
    cells = tuple((amount(v, "m/s"), *(_cell(at.get((v, volt)), static[volt]) for volt in voltages)) for v in chosen)
    degrees = f" at {amount(first, 'degC')}" if first is not None else ""
    columns = ["force" if volt is None else f"force at {context.voltage(volt)}" for volt in voltages]
    header = ("speed in rebound", *columns)
    rest = static_force_in_words(context, voltages)
    rest = f", with the {rest} at rest that the table (4-table) leaves out" if rest else ""
    return TextTable(f"Force{degrees}{rest}; in brackets the model beyond what the rig reached", header, cells)


def _cell(row: ForceRow | None, static: float) -> str:
    """A force of the table and what is there at rest."""
    if row is None or row.force_N is None:
        return DASH
    text = amount(row.force_N + static, "N")
    return text if row.inside else f"({text})"


def _spread(speeds: list[float], reached: float) -> list[float]:
    """A few speeds of the table, up to what the rig reached and beyond."""
    if len(speeds) <= 6:
        return speeds
    wanted = [0.1 * reached, 0.25 * reached, 0.5 * reached, reached, 0.5 * (reached + speeds[-1]), speeds[-1]]
    return sorted({min(speeds, key=lambda v: abs(v - target)) for target in wanted})


def _responses(context: ReportContext) -> TextTable:
    rows = tuple(
        (
            context.control.name if r.signal == VOLTAGE.name else r.signal,
            f"{context.voltage(r.from_voltage_V)} to {context.voltage(r.to_voltage_V)}",
            amount(r.velocity_m_per_s, "m/s"),
            *(f"{number(1000.0 * t)} ms" if t is not None else DASH for t in (r.to_63_percent_s, r.to_90_percent_s)),
            r.note,
        )
        for r in context.rides.responses
    )
    return TextTable(
        "Response to a step at constant speed",
        ("signal", "step", "speed", "to 63 %", "to 90 %", ""),
        rows,
        len(rows) > _FOLD,
    )


def _measures(context: ReportContext) -> TextTable:
    conditions = ("record", *_conditions(context), "frequency", "amplitude")
    found = ("peak force", "force at zero velocity", "work per cycle", "equivalent c", "dynamic range")
    rows = tuple(
        (
            m.record,
            context.voltage(m.voltage_V),
            amount(m.temperature_degC, "degC"),
            amount(m.frequency_Hz, "Hz"),
            f"{number(1000.0 * m.amplitude_m)} mm",
            amount(m.peak_force_N, "N"),
            amount(m.force_at_zero_velocity_N, "N"),
            amount(m.work_per_cycle_J, "J"),
            amount(m.equivalent_damping_Ns_per_m, "N s/m"),
            number(m.dynamic_range),
        )
        for m in context.identified.measures
        if m.setting == context.chosen
    )
    title = "Every test as an equivalent viscous damper"
    return TextTable(title, conditions + found, rows, folded=True).without_empty(*_conditions(context), "dynamic range")
