"""What somebody expected of this damper, and what the run gives in its place."""

from __future__ import annotations

from pzd.artefacts import ReferenceRow
from pzd.report.blocks import Paragraph, Section, TextTable
from pzd.report.context import ReportContext
from pzd.report.wording import DASH, amount, number

_FOLD = 12
"""Tables longer than this are folded."""


def render(context: ReportContext) -> tuple[Section, ...]:
    """The section of the expected numbers; none where the config names no such list."""
    reference = context.expected
    if reference is None:
        return ()
    met = sum(row.computed is not None for row in reference)
    text = f"Expected numbers in {context.config.reference}: {len(reference)}, of which the run computes {met}."
    rows = tuple(_row(row) for row in reference)
    header = ("number", "expected", "computed", "ratio", "note")
    sheet = TextTable("Expected and computed", header, rows, folded=len(rows) > _FOLD)
    return (Section("expected", "What was expected", (Paragraph(text), sheet)),)


def _row(row: ReferenceRow) -> tuple[str, ...]:
    expected = row.expected if isinstance(row.expected, str) else number(row.expected, 4)
    shown = f"{expected} {row.unit}" if isinstance(row.expected, str) else amount(row.expected, row.unit, 4)
    computed = DASH if row.computed is None else amount(row.computed, row.unit, 4)
    return row.id, shown, computed, number(row.ratio, 4), row.note
