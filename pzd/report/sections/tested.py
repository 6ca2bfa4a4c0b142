"""What was tested: the rig records, and what the preflight found in them."""

from __future__ import annotations

import numpy as np

from pzd.artefacts import RecordEntry
from pzd.record import Record
from pzd.report.blocks import Block, Notes, Paragraph, Section, TextTable
from pzd.report.context import ReportContext
from pzd.report.wording import amount, number
from pzd.schema.wording import counted

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
