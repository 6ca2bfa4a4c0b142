"""What the damper is: its parameters, its force, how quickly it responds."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from pzd.artefacts import ForceRow
from pzd.damper.confounders import known
from pzd.damper.effect import Parameter
from pzd.damper.model import Damper
from pzd.quantities import VOLTAGE
from pzd.report import tables
from pzd.report.blocks import Block, Notes, Paragraph, Pictures, Section, TextTable, amount, galleries, listed
from pzd.report.columns import Beyond, Cell, Column, Span, Table
from pzd.report.context import ReportContext
from pzd.report.damper_models import effect_in_words

_FRICTIONS = (
    "T0 is neither the friction that tests show without a model, which is extrapolated to rest where none is slow, nor "
    "the force at zero velocity of a test, in which is what the oil spring still holds where the stroke turns."
)


def render(context: ReportContext, pictures: Pictures) -> Section:
    """Return the section on the damper itself."""
    blocks: list[Block] = [Paragraph(_intro(context)), *_knee_blocks(context), _parameters(context)]
    if context.damper.extended or context.damper.fitted_law:
        title = "The simple model: T0, C and k of the Bingham element alone, standing in for what it lacks"
        alone = tables.parameters(context.damper.baseline_parameters, context.control, title, fold=0)
        blocks.append(alone.without("setting").block())
    if context.damper.extended and context.damper.fitted_law:
        blocks.append(_law_refitted(context))
    blocks += galleries(pictures["damper"])
    blocks += [_force(context)] if context.table.force else []
    blocks += _settings_blocks(context)
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
    what = ["what belongs to the knee law"] if context.damper.fitted_law else []
    what += ["what was missing"] if context.damper.extended else []
    origin = f"{listed(what)} {'stand' if len(what) > 1 else 'stands'}".capitalize()
    beside = f" {origin} beside it: {listed(laws)}." if laws else ""
    return (
        "Dry friction T0, damping C and oil spring k of the Bingham element, with 95 % intervals. These allow for "
        "noise and for a gain, offset and delay of the sensors that differ from test to test. A value that the data do "
        f"not determine is left out, and the status says so.{beside} {_FRICTIONS}"
    )


def _knee_blocks(context: ReportContext) -> Iterator[Block]:
    """Yield the tables of the knee law in the language of the trade; none where the config does not ask for it."""
    found = context.identified.knees
    if found.law_of(context.setting) == "knee" and not context.damper.fitted_law:
        yield Paragraph(
            "The knee law tells this damper in the terms of the trade. The damper that is handed on stands beside one "
            "T0 and C instead, with which kept-back tests are predicted far better."
        )
    shown = (*tables.knee(found, context.control), tables.knee_prediction(found, context.control))
    yield from (table.block() for table in shown if table.rows)


def _law_refitted(context: ReportContext) -> TextTable:
    """Return the parameters of the knee law as identify fitted it, and beside what was missing."""
    dampers = context.diagnosed.baseline, context.diagnosed.damper
    rows = [(name, p) for name in dampers[0].effects for p in known()[name].parameters]

    def given(damper: Damper) -> Callable[[tuple[str, Parameter]], Cell]:
        def cell(row: tuple[str, Parameter]) -> Cell:
            name, parameter = row
            values = np.atleast_1d(damper.effects[name].get(parameter.name, parameter.neutral)).tolist()
            return ", ".join(amount(value, parameter.unit) for value in values)

        return cell

    return Table(
        "The knee law alone, and fitted again beside what was missing, as the table of force and the rides have it",
        (
            Column("parameter", "parameter", value=lambda row: f"{row[1].name}: {row[1].meaning}"),
            Column("alone", "alone", value=given(dampers[0])),
            Column("beside", "beside what was missing", value=given(dampers[1])),
        ),
        rows,
    ).block()


def _parameters(context: ReportContext) -> TextTable:
    """Return T0, C and k of the damper that everything behind uses."""
    title = (
        "T0, C and k of the adopted damper" if context.damper.extended else "T0, C and k of the Bingham element alone"
    )
    title = "T0, C and k beside the knee, C the mean bleed of both directions" if context.damper.fitted_law else title
    return tables.parameters(context.damper.final_parameters, context.control, title).without("setting").block()


# --- Force of the table at a few speeds ---


def _force(context: ReportContext) -> TextTable:
    first = min((row.temperature_degC for row in context.table.force), key=lambda t: -np.inf if t is None else t)
    rows = [row for row in context.table.force if row.temperature_degC == first and row.velocity_m_per_s > 0.0]
    voltages = sorted({row.voltage_V for row in rows}, key=lambda v: v or 0.0)
    speeds = sorted({row.velocity_m_per_s for row in rows})
    at = {(row.velocity_m_per_s, row.voltage_V): row for row in rows}
    degrees = f" at {amount(first, 'degC')}" if first is not None else ""
    rest = context.damper.static_force_in_words(voltages)
    rest = f", with the {rest} at rest that the table (4-table) leaves out" if rest else ""

    def column(voltage: float | None) -> Column:
        static = context.damper.static_force(voltage)
        head = "force" if voltage is None else f"force at {context.voltage(voltage)}"
        return Column(f"force_at_{voltage}", head, "N", lambda speed: _cell(at.get((speed, voltage)), static))

    return Table(
        f"Force{degrees}{rest}; in brackets the model beyond what the rig reached",
        (
            Column("velocity_m_per_s", "speed in rebound", "m/s", lambda speed: speed),
            *(column(voltage) for voltage in voltages),
        ),
        _spread(speeds, context.table.notes.reached_m_per_s),
    ).block()


def _cell(row: ForceRow | None, static: float) -> Cell:
    """Return a force of the table, with the force at rest that the table leaves out."""
    if row is None or row.force_N is None:
        return None
    return row.force_N + static if row.inside else Beyond(row.force_N + static)


def _spread(speeds: list[float], reached: float) -> list[float]:
    """Select a few speeds of the table, up to what the rig reached and beyond."""
    if len(speeds) <= 6:
        return speeds
    wanted = [0.1 * reached, 0.25 * reached, 0.5 * reached, reached, 0.5 * (reached + speeds[-1]), speeds[-1]]
    return sorted({min(speeds, key=lambda v: abs(v - target)) for target in wanted})


# --- Settings between tested ones ---


def _settings_blocks(context: ReportContext) -> Iterator[Block]:
    """Yield the force of settings that were not tested, and how well tested ones are predicted; none unless asked."""
    found = context.table
    if not found.settings:
        return
    trust = (
        "How good this is tell tested settings that are left out and predicted in the same way; their neighbours lie "
        "further apart than those used above."
        if found.settings_left_out
        else "How good this is cannot be told: for that a third setting must be tested, between two others."
    )
    yield Paragraph(
        "The settings below were not tested. Their force is interpolated, linear in the number of the setting, between "
        "the tested ones to either side, each by its adopted law, and only where both were tested: "
        f"4-table/settings.csv holds all of it. {trust}"
    )
    yield tables.interpolated_settings(found.settings, context.control).block()
    if found.settings_left_out:
        yield tables.left_out_settings(found.settings_left_out).block()


# --- Response, and every test as an equivalent viscous damper ---


def _responses(context: ReportContext) -> TextTable:
    control = context.control
    return Table(
        "Response to a step at constant speed",
        (
            Column("signal", "signal", value=lambda row: control.name if row.signal == VOLTAGE.name else row.signal),
            Column("voltage_V", "step", control.unit, lambda row: Span(row.from_voltage_V, row.to_voltage_V)),
            Column("velocity_m_per_s", "speed", "m/s"),
            Column("to_63_percent_s", "to 63 %", "ms", factor=1000.0),
            Column("to_90_percent_s", "to 90 %", "ms", factor=1000.0),
            Column("note", "note", optional=True),
        ),
        context.rides.responses,
        tables.FOLD,
    ).block()


def _measures(context: ReportContext) -> TextTable:
    return Table(
        "Every test as an equivalent viscous damper",
        (
            Column("record", "record"),
            *tables.conditions(context.control)[1:],
            Column("frequency_Hz", "frequency", "Hz"),
            Column("amplitude_m", "amplitude", "mm", factor=1000.0),
            Column("peak_force_N", "peak force", "N"),
            Column("force_at_zero_velocity_N", "force at zero velocity", "N"),
            Column("work_per_cycle_J", "work per cycle", "J"),
            Column("equivalent_damping_Ns_per_m", "equivalent c", "N s/m"),
            Column("dynamic_range", "dynamic range", optional=True),
        ),
        [row for row in context.identified.measures if row.setting == context.setting],
        fold=0,
    ).block()
