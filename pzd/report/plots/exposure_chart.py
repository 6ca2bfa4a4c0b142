"""The boundary of reduced comfort of 1978 with what each ride puts on it, one picture a road."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from pzd.comfort import iso2631_1978
from pzd.report.context import ReportContext
from pzd.report.drawing import Panel, Plot, axes, legend, line_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LINES = {1440.0: "24 h", 480.0: "8 h", 150.0: "2.5 h", 60.0: "1 h", 25.0: "25 min", 4.0: "4 min"}
_SMALLEST = 0.02
"""Components below this share of the largest are not drawn."""


def draw(context: ReportContext) -> Iterator[Panel]:
    """Lines of equal time, and every component of the controlled ride and of the best one beside it."""
    if iso2631_1978.EDITION not in context.config.editions:
        return
    for road in context.roads:
        rows = context.nearest(road)[:2]
        if rows:
            yield _panel(context, road, [row.case for row in rows])


def _panel(context: ReportContext, road: str, cases: list[str]) -> Panel:
    figure, ax = axes(3.3)
    _boundaries(ax)
    for ride in (ride for ride in context.rated if ride.row.case in cases):
        parts = ride.components
        kept = parts.rms >= _SMALLEST * float(parts.rms.max())
        colour, controlled = line_of(context, ride.row)
        label = context.dampers(ride.row)
        marker = "s" if controlled else "o"
        ax.plot(parts.frequency[kept], parts.rms[kept], marker, color=colour, markersize=6.0, label=label, zorder=3)
    ax.set_xlabel("frequency [Hz]")
    ax.set_ylabel("acceleration, r.m.s. [m/s²]")
    legend(figure)
    title = f"Reduced comfort, {context.road(road)}"
    alt = f"Components of the rides over {road} on the chart of reduced comfort of ISO 2631:1978."
    return Panel(figure, title, alt, "Boundaries of ISO 2631:1978: unverified transcription of a withdrawn standard.")


def _boundaries(ax: Axes) -> None:
    table, factor = iso2631_1978.chart(), iso2631_1978.FACTORS["reduced_comfort"]
    for minutes, level in zip(table.minutes, table.level.T, strict=True):
        if float(minutes) in _LINES:
            ax.plot(table.frequency, factor * level, color="#9aa5b1", linewidth=1.0)
            end = (float(table.frequency[-1]), factor * float(level[-1]))
            ax.annotate(_LINES[float(minutes)], end, (3, -3), textcoords="offset points", fontsize=8)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlim(1.0, 130.0)
    ax.set_xticks([1, 2, 4, 8, 16, 31.5, 63], ["1", "2", "4", "8", "16", "31.5", "63"])
    ax.set_xticks([], minor=True)
    ticks = np.array([0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0])
    ax.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    ax.set_yticks([], minor=True)


PLOT = Plot("exposure_chart", "passenger", 2, draw)
