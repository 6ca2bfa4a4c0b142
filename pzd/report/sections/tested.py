"""What was tested: the rig records, what the preflight found in them, and what they show without a model."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from pzd.record import Array
from pzd.report import tables
from pzd.report.blocks import Block, Notes, Paragraph, Pictures, Section, TextTable, amount, galleries, number
from pzd.report.columns import Column, Quantity, Table
from pzd.report.context import ReportContext
from pzd.schema.errors import counted

_PAPER_RESPONSE_MS = 9
"""Stated by Makowski and Knap 2021 for the whole range of force of their piezoelectric damper, without a criterion."""

# --- Records and findings ---


def render(context: ReportContext) -> Section:
    """Return the section on the records and the findings of the preflight."""
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
    records = context.tests.records
    if not records:
        return "No record belongs to this setting."
    stroke = max(float(np.ptp(r.displacement)) for r in records)
    speed = max(float(np.abs(r.velocity).max()) for r in records)
    force = max(float(np.abs(r.force).max()) for r in records)
    seconds = sum(float(r.time[-1] - r.time[0]) for r in records)
    where = f" of the setting {context.setting}" if context.setting else ""
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
    if voltages := [record.voltage for record in context.tests.records if record.voltage is not None]:
        found.append(f"{context.control.name} {_span(voltages)} {context.control.unit}")
    degrees = [record.temperature for record in context.tests.records if record.temperature is not None]
    return [*found, f"temperature {_span(degrees)} °C" if degrees else "no temperature was recorded"]


def _span(channels: Sequence[Array]) -> str:
    """Return the least and the largest value of a channel over all records."""
    low, high = number(min(float(c.min()) for c in channels)), number(max(float(c.max()) for c in channels))
    return low if low == high else f"{low} to {high}"


def _records(context: ReportContext) -> TextTable:
    pairs = [(context.tests.entries[r.name], r) for r in context.tests.records if r.name in context.tests.entries]
    return Table(
        "Records",
        (
            Column("name", "record", value=lambda pair: pair[0].name),
            *tables.conditions(context.control, lambda pair: pair[0])[1:],
            Column("rate_Hz", "rate", "Hz", lambda pair: pair[0].rate_Hz, digits=4),
            Column("cycles", "cycles", value=lambda pair: pair[0].cycles),
            Column("stroke_m", "stroke", "mm", lambda pair: float(np.ptp(pair[1].displacement)), factor=1000.0),
            Column("speed_m_per_s", "top speed", "m/s", lambda pair: float(np.abs(pair[1].velocity).max())),
            Column("force_N", "top force", "N", lambda pair: float(np.abs(pair[1].force).max())),
            Column("findings", "findings", value=lambda pair: len(pair[0].findings)),
        ),
        pairs,
        tables.FOLD,
    ).block()


def _findings(context: ReportContext) -> TextTable:
    return Table(
        "Findings of the preflight",
        (
            Column("record", "record", value=lambda pair: pair[0].name),
            Column("check", "check", value=lambda pair: pair[1].check),
            Column("where", "where", value=lambda pair: pair[1].where),
            Column("size", "size", value=lambda pair: Quantity(pair[1].size, pair[1].unit)),
            Column("follows", "what follows", value=lambda pair: pair[1].follows),
        ),
        [(entry, finding) for entry in context.rig.entries for finding in entry.findings],
        tables.FOLD,
    ).block()


# --- Characteristics: force over speed, gas force, friction, response to steps, without any model ---


def render_characteristics(context: ReportContext, pictures: Pictures) -> Iterator[Section]:
    """Yield the section on what the tests show without any model, where there are such tests."""
    found = context.tests.characteristics
    shown = tuple(tables.characteristics(found, context.control))
    if not shown:
        return
    one_setting = len({row.setting for row in found.peak_velocity}) <= 1
    blocks: list[Block] = [Paragraph(_intro(context)), *galleries(pictures["characteristics"])]
    blocks += [(table.without("setting") if one_setting else table).block() for table in shown]
    blocks += [Paragraph(_beside_the_paper(context))] if found.steps else []
    yield Section("characteristics", "Force over speed, as measured", tuple(blocks))


def _intro(context: ReportContext) -> str:
    text = (
        "No model is used here. Rebound is extension: its speed and force are positive, those of compression negative. "
        "The peak-velocity plot (PVP) has one point a test and direction, the force at the peak speed of the stroke; "
        "the continuous-velocity plot (CVP) is the force over speed through the average settled cycle of one test. "
        "Forces are as recorded, with the gas force in them."
    )
    tests, records = len(context.tests.characteristics.peak_velocity), len(context.rig.records)
    found = f"{counted(tests, 'such test')} in {counted(records, 'record')}"
    return f"{text} Found by their motion: {found}." if tests else text


def _beside_the_paper(context: ReportContext) -> str:
    times = [row.to_90_percent_s for row in context.tests.characteristics.steps if row.to_90_percent_s is not None]
    ours = "No step gave a time."
    if times:
        low, high = (amount(1000.0 * end(times), "ms") for end in (min, max))
        ours = f"Of {len(context.tests.characteristics.steps)} steps {len(times)} gave a time: {low} to {high} to 90 %."
    return (
        f"{ours} Times count from the middle of the step of the recorded {context.control.name}. The paper (Makowski "
        f"and Knap 2021) states {_PAPER_RESPONSE_MS} ms for its damper, over the whole range of force."
    )
