"""Measured and simulated force over displacement, one picture a record."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.quantities import DISPLACEMENT, FORCE
from pzd.report.context import ReportContext
from pzd.report.drawing import Panel, Plot
from pzd.report.gaps import loops


def draw(context: ReportContext) -> Iterator[Panel]:
    """One panel a record shown."""
    for record in context.shown:
        yield loops(
            context, record, 1000.0 * record.displacement, DISPLACEMENT, f"{FORCE.name} over {DISPLACEMENT.name}"
        )


PLOT = Plot("force_displacement", "model", 1, draw)
