"""What was tested: the rig records, and what the preflight found in them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pzd.artefacts import PeakVelocityRow, RecordEntry
from pzd.artefacts.identified import AVERAGED, courses
from pzd.artefacts.rig import force_behind
from pzd.record import Record
from pzd.report.blocks import (
    DASH,
    Block,
    Notes,
    Paragraph,
    Pictures,
    Section,
    TextTable,
    amount,
    amount_as,
    galleries,
    number,
)
from pzd.report.context import ReportContext, characteristics_of
from pzd.schema.errors import counted

# ----------------------------------------------------------------------------------------------------


_FOLD = 12
"""Tables longer than this are folded."""


def render(context: ReportContext) -> Section:
    """The first section."""
    blocks: list[Block] = [Paragraph(_summary(context)), _records(context)]
    findings = _findings(context)
    if findings.rows:
        text = "Nothing was corrected unasked: each finding says where it is, how large it is and what follows."
        blocks += [
            Paragraph(f"The preflight found {counted(len(findings.rows), 'thing')} to know about. {text}"),
            findings,
        ]
    else:
        blocks.append(Notes(("The preflight had no objection to any record.",), "good"))
    removed = tuple(f"{e.name}: {e.removed}" for e in context.rig.entries if e.removed)
    if removed:
        blocks += [Paragraph("A known fixture was taken out of the force:"), Notes(removed)]
    return Section("tested", "What was tested", tuple(blocks))


def _summary(context: ReportContext) -> str:
    records = context.records
    if not records:
        return "No record belongs to this setting."
    stroke = max(float(np.ptp(r.displacement)) for r in records)
    speed = max(float(np.abs(r.velocity).max()) for r in records)
    force = max(float(np.abs(r.force).max()) for r in records)
    seconds = sum(float(r.time[-1] - r.time[0]) for r in records)
    where = f" of the setting {context.chosen}" if context.chosen else ""
    parts = [
        f"{counted(len(records), 'record')}{where}, {number(seconds)} s in all",
        f"stroke up to {number(1000.0 * stroke)} mm, speed up to {number(speed)} m/s, force up to {amount(force, 'N')}",
    ]
    others = len(context.rig.records) - len(records)
    if others:
        parts.append(f"{counted(others, 'record')} of other settings were identified as well, and not used further")
    return "; ".join([*parts[:1], *_conditions(context), *parts[1:]]) + "."


def _conditions(context: ReportContext) -> list[str]:
    found = []
    volts = [
        v for r in context.records if r.voltage is not None for v in (float(r.voltage.min()), float(r.voltage.max()))
    ]
    if volts:
        span = number(min(volts)), number(max(volts))
        found.append(f"{context.control.name} {_span(*span)} {context.control.unit}")
    degrees = [
        float(t)
        for r in context.records
        if r.temperature is not None
        for t in (r.temperature.min(), r.temperature.max())
    ]
    if degrees:
        found.append(f"temperature {_span(number(min(degrees)), number(max(degrees)))} °C")
    else:
        found.append("no temperature was recorded")
    return found


def _span(low: str, high: str) -> str:
    return low if low == high else f"{low} to {high}"


def _records(context: ReportContext) -> TextTable:
    header = (
        "record",
        context.control.name,
        "temperature",
        "rate",
        "cycles",
        "stroke",
        "top speed",
        "top force",
        "findings",
    )
    pairs = [(context.entries[r.name], r) for r in context.records if r.name in context.entries]
    rows = tuple(_row(context, entry, record) for entry, record in pairs)
    return TextTable("Records", header, rows, folded=len(rows) > _FOLD).without_empty(
        context.control.name, "temperature"
    )


def _row(context: ReportContext, entry: RecordEntry, record: Record) -> tuple[str, ...]:
    return (
        entry.name,
        amount(entry.voltage_V, context.control.unit),
        amount(entry.temperature_degC, "degC"),
        amount(entry.rate_Hz, "Hz", 4),
        number(entry.cycles),
        f"{number(1000.0 * float(np.ptp(record.displacement)))} mm",
        amount(float(np.abs(record.velocity).max()), "m/s"),
        amount(float(np.abs(record.force).max()), "N"),
        str(len(entry.findings)),
    )


def _findings(context: ReportContext) -> TextTable:
    rows = tuple(
        (entry.name, finding.check, finding.where, amount(finding.size, finding.unit), finding.follows)
        for entry in context.rig.entries
        for finding in entry.findings
    )
    return TextTable(
        "Findings of the preflight", ("record", "check", "where", "size", "what follows"), rows, len(rows) > _FOLD
    )


# ----------------------------------------------------------------------------------------------------
# What the tests show without any model: force over speed, gas force, friction, response to steps.


_PAPER_RESPONSE_MS = 9
"""Stated by Makowski and Knap 2021 for the whole range of force of their piezoelectric damper, without a criterion."""


def render_characteristics(context: ReportContext, pictures: Pictures) -> Iterator[Section]:
    """The second section, where there are such tests."""
    found = characteristics_of(context)
    if not (found.peak_velocity or found.steps or found.warm_up or found.as_it_stands):
        return
    blocks: list[Block] = [Paragraph(_intro(context)), *galleries(pictures["characteristics"])]
    blocks += [_force_at_speed(context)] if found.peak_velocity else []
    blocks += [_gas_and_friction(context)] if found.gas_and_friction else []
    if found.steps:
        blocks += [_steps(context), Paragraph(_beside_the_paper(context))]
    blocks += [_warm_up(context)] if found.warm_up else []
    blocks += [_as_it_stands(context)] if found.as_it_stands else []
    yield Section("characteristics", "Force over speed, as measured", tuple(blocks))


def _intro(context: ReportContext) -> str:
    text = (
        "No model is used here. Rebound is extension: its speed and force are positive, those of compression negative. "
        "The peak-velocity plot (PVP) has one point a test and direction, the force at the peak speed of the stroke; "
        "the continuous-velocity plot (CVP) is the force over speed through the average settled cycle of one test. "
        "Forces are as recorded, with the gas force in them."
    )
    tests, records = len(characteristics_of(context).peak_velocity), len(context.rig.records)
    found = f"{counted(tests, 'such test')} in {counted(records, 'record')}"
    return f"{text} Found by their motion: {found}." if tests else text


def _places(context: ReportContext, *more: str) -> tuple[str, ...]:
    """Header of what sets conditions apart: only what the rig varied or recorded."""
    return (*_settings(context), *_control(context), *_degrees(context), *more)


def _settings(context: ReportContext) -> tuple[str, ...]:
    return ("setting",) if len({row.setting for row in characteristics_of(context).peak_velocity}) > 1 else ()


def _control(context: ReportContext) -> tuple[str, ...]:
    controlled = any(row.voltage_V is not None for row in characteristics_of(context).peak_velocity)
    return (context.control.name,) if controlled else ()


def _degrees(context: ReportContext) -> tuple[str, ...]:
    known = any(row.temperature_degC is not None for row in characteristics_of(context).peak_velocity)
    return ("temperature",) if known else ()


def _place(context: ReportContext, setting: str | None, voltage: float | None, temperature: float | None) -> list[str]:
    cells = [setting or DASH] if _settings(context) else []
    cells += [amount(voltage, context.control.unit)] if _control(context) else []
    return cells + ([amount(temperature, "degC")] if _degrees(context) else [])


def _force_at_speed(context: ReportContext) -> TextTable:
    rows = tuple(_characteristics_row(context, row) for row in characteristics_of(context).peak_velocity)
    header = ("speed", *_places(context), "rebound", "compression", "test", "record")
    return TextTable("Force at the peak speed of each test", header, rows, folded=len(rows) > _FOLD)


def _characteristics_row(context: ReportContext, row: PeakVelocityRow) -> tuple[str, ...]:
    swing = f", {number(1000.0 * row.amplitude_m)} mm"
    swing += f", {amount(row.frequency_Hz, 'Hz')}" if row.frequency_Hz is not None else ""
    return (
        amount(row.speed, "m/s"),
        *_place(context, row.setting, row.voltage_V, row.temperature_degC),
        amount(row.rebound_force_N, "N"),
        amount(row.compression_force_N, "N"),
        row.kind + swing,
        row.record,
    )


def _gas_and_friction(context: ReportContext) -> TextTable:
    found = characteristics_of(context)
    rows = tuple(
        (
            *(_place(context, row.setting, row.voltage_V, row.temperature_degC) or ["all tests"]),
            *(amount_as(force, force_behind(found, row), "N") for force in (row.gas_force_N, row.friction_N)),
            amount(row.velocity_m_per_s, "m/s"),
            row.method,
        )
        for row in found.gas_and_friction
    )
    header = (*(_places(context) or ("",)), "gas force", "friction", "slowest speed", "how")
    title = "Static force at mid-stroke: mean of both directions (gas) and half their difference (friction)"
    return TextTable(title, header, rows, folded=len(rows) > _FOLD)


def _steps(context: ReportContext) -> TextTable:
    rows = tuple(
        (
            f"{context.voltage(row.from_voltage_V)} to {context.voltage(row.to_voltage_V)}",
            amount(row.velocity_m_per_s, "m/s"),
            f"{number(row.from_force_N)} to {amount(row.to_force_N, 'N')}" if row.to_force_N is not None else DASH,
            *(_milliseconds(t) for t in (row.to_63_percent_s, row.to_90_percent_s)),
            row.status,
            f"{row.record}, {amount(row.time_s, 's', 4)}",
        )
        for row in characteristics_of(context).steps
    )
    header = ("step", "speed", "force", "to 63 %", "to 90 %", "status", "where")
    title = f"Measured response to steps of the {context.control.name}"
    return TextTable(title, header, rows, folded=len(rows) > _FOLD)


def _warm_up(context: ReportContext) -> TextTable:
    rows = tuple(
        (
            *([one.first.setting or DASH] if _settings(context) else []),
            *([amount(one.first.voltage_V, context.control.unit)] if _control(context) else []),
            amount(one.first.velocity_m_per_s, "m/s"),
            str(one.cycles),
            _course(one.first.temperature_degC, one.last.temperature_degC, "degC"),
            _course(one.first.rebound_force_N, one.last.rebound_force_N, "N"),
            _course(one.first.compression_force_N, one.last.compression_force_N, "N"),
            one.first.record,
        )
        for one in courses(characteristics_of(context).warm_up)
    )
    header = (*_settings(context), *_control(context), "speed", "cycles", "temperature", "rebound", "compression")
    title = f"Warm-up: force at the peak speed from the first {AVERAGED} cycles to the last"
    return TextTable(title, (*header, "record"), rows, folded=len(rows) > _FOLD)


def _as_it_stands(context: ReportContext) -> TextTable:
    rows = tuple(
        (
            row.record,
            row.setting or DASH,
            context.voltage(row.voltage_V),
            amount(row.temperature_degC, "degC"),
            amount(row.rebound_force_N, "N"),
            amount(row.compression_force_N, "N"),
            amount(row.rebound_velocity_m_per_s, "m/s"),
            amount(row.compression_velocity_m_per_s, "m/s"),
            f"{number(1000.0 * row.stroke_m)} mm",
            amount(row.duration_s, "s"),
        )
        for row in characteristics_of(context).as_it_stands
    )
    where = ("setting", context.control.name, "temperature")
    extremes = ("largest force", "smallest force", "largest velocity", "smallest velocity")
    title = "Records that are none of these tests, as they stand: extremes of all samples"
    header = ("record", *where, *extremes, "stroke", "duration")
    return TextTable(title, header, rows, folded=len(rows) > _FOLD).without_empty(*where)


def _course(first: float | None, last: float | None, unit: str) -> str:
    return DASH if first is None else f"{number(first)} to {amount(last, unit)}"


def _milliseconds(time: float | None) -> str:
    return DASH if time is None else amount(1000.0 * time, "ms")


def _beside_the_paper(context: ReportContext) -> str:
    times = [row.to_90_percent_s for row in characteristics_of(context).steps if row.to_90_percent_s is not None]
    ours = "No step gave a time."
    if times:
        low, high = (amount(1000.0 * end(times), "ms") for end in (min, max))
        ours = f"Of {len(characteristics_of(context).steps)} steps {len(times)} gave a time: {low} to {high} to 90 %."
    return (
        f"{ours} Times count from the middle of the step of the recorded {context.control.name}. The paper (Makowski "
        f"and Knap 2021) states {_PAPER_RESPONSE_MS} ms for its damper, over the whole range of force."
    )
