"""Measured and simulated force over displacement, one picture a record."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.quantities import DISPLACEMENT, FORCE
from pzd.report.drawing import Panel, Plot
from pzd.report.loops import loops
from pzd.report.story import Story


def draw(story: Story) -> Iterator[Panel]:
    """One panel a record shown."""
    for record in story.shown:
        yield loops(story, record, 1000.0 * record.displacement, DISPLACEMENT, f"{FORCE.name} over {DISPLACEMENT.name}")


PLOT = Plot("force_displacement", "model", 1, draw)
