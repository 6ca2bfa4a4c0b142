"""Where the gap lies in voltage and velocity, before and after diagnose."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pzd.record import Array
from pzd.report.context import ReportContext
from pzd.report.drawing import MAP, Panel, Plot, axes
from pzd.report.gaps import GapMap, gap_map


def draw(context: ReportContext) -> Iterator[Panel]:
    """The map of the simple model, and beside it that of the final damper where there is another."""
    if not context.records:
        return
    found = gap_map(context)
    top = float(np.nanmax(found.before))
    by = context.control.name if context.controlled else "test"
    yield _panel(found, found.before, top, context.model, by)
    if context.extended:
        yield _panel(found, found.after, top, "with what was missing", by)


def _panel(found: GapMap, values: Array, top: float, which: str, by: str) -> Panel:
    figure, ax = axes(1.5 + 0.3 * max(len(found.rows), 4), found.rows, key=0, right=0.75)
    cells = np.arange(len(found.rows) + 1)
    mesh = ax.pcolormesh(found.edges, cells, values, cmap=MAP, vmin=0.0, vmax=top, edgecolors="face", linewidth=0.9)
    ax.set_yticks(np.arange(len(found.rows)) + 0.5, found.rows)
    ax.set_xlabel("velocity [m/s]")
    ax.grid(visible=False)
    box = ax.get_position()
    figure.colorbar(
        mesh, cax=figure.add_axes((box.x1 + 0.02, box.y0, 0.025, box.height)), label="gap [% of peak force]"
    )
    title = f"Gap, {which}"
    largest = f"largest {np.nanmax(values):.2g} % of the peak force"
    alt = f"Map of the r.m.s. gap by {by} and velocity, {which}; {largest}."
    return Panel(figure, title, alt, "R.m.s. of measured minus simulated force, in % of the largest measured force.")


PLOT = Plot("gap_map", "model", 2, draw)
