"""Measured and simulated force over velocity, one picture a record."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.quantities import FORCE, VELOCITY
from pzd.report.context import ReportContext
from pzd.report.drawing import Panel, Plot
from pzd.report.gaps import loops


def draw(context: ReportContext) -> Iterator[Panel]:
    """One panel a record shown."""
    for record in context.shown:
        yield loops(context, record, record.velocity, VELOCITY, f"{FORCE.name} over {VELOCITY.name}")


PLOT = Plot("force_velocity", "model", 0, draw)
