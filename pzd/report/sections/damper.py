"""What the damper is: its parameters, its force, how quickly it responds."""

from __future__ import annotations

import numpy as np

from pzd.artefacts import ForceRow, ParameterRow
from pzd.damper.competing_forms import known
from pzd.damper.model import BaseRow
from pzd.quantities import DAMPING, FRICTION, STIFFNESS, VOLTAGE
from pzd.report.blocks import Block, Notes, Paragraph, Section, TextTable
from pzd.report.context import ReportContext, effect_in_words
from pzd.report.sections.knee import trade_blocks
from pzd.report.sections.pictures import Pictures, galleries
from pzd.report.sections.settings import settings_blocks
from pzd.report.static_force import static_force_at, static_force_in_words
from pzd.report.wording import DASH, amount, interval, listed, number, unit_of

_QUANTITIES = (FRICTION, DAMPING, STIFFNESS)
_FOLD = 12
NO_FORCE = 1e-6
"""A friction of less [N] is none: no load cell shows it, and a fit leaves such numbers where it found none."""


def render(context: ReportContext, pictures: Pictures) -> Section:
    """The fourth section."""
    blocks: list[Block] = [Paragraph(_intro(context)), *trade_blocks(context), _parameters(context)]
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


def _parameters(context: ReportContext) -> TextTable:
    """T0, C and k of the damper that everything behind uses."""
    title = "T0, C and k beside what was missing" if context.extended else "T0, C and k of the Bingham element alone"
    title = "T0, C and k beside the knee, C the mean bleed of both directions" if context.fitted_law else title
    rows = tuple(_row(context, row) for row in context.final)
    return TextTable(title, _header(context), rows).without_empty(*_conditions(context))


def _alone(context: ReportContext) -> TextTable:
    """T0, C and k of the simple model: alone they also stand in for what it lacks."""
    title = "The simple model: T0, C and k of the Bingham element alone, standing in for what it lacks"
    rows = tuple(_row(context, row) for row in context.parameters)
    return TextTable(title, _header(context), rows, folded=True).without_empty(*_conditions(context))


def _conditions(context: ReportContext) -> tuple[str, str]:
    """Headers of what a rig need not have recorded."""
    return context.control.name, "temperature"


def _header(context: ReportContext) -> tuple[str, ...]:
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
