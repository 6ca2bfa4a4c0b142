"""The weighted r.m.s. of every ride on the overlapping scale of likely reactions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from pzd.artefacts import SummaryRow
from pzd.comfort import iso2631_1997
from pzd.report.blocks import number
from pzd.report.context import ReportContext
from pzd.report.drawing import Panel, Plot, axes, line_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_HEIGHT = 2.8
_SHADES = ("#f3f6f9", "#e6ecf2", "#d9e2ea", "#ccd7e2", "#bfccd9", "#b2c1d0")


def draw(context: ReportContext) -> Iterator[Panel]:
    """One panel a road, one line a ride, over bands that overlap as they do in the standard."""
    for road in context.roads:
        values = [(row, context.value(row.case, "a_w")) for row in context.cases(road)]
        known = [(row, value) for row, value in values if value is not None]
        if known:
            yield _panel(context, road, known[::-1])


def _panel(context: ReportContext, road: str, known: list[tuple[SummaryRow, float]]) -> Panel:
    names = [context.dampers(row) for row, _ in known]
    figure, ax = axes(max(1.5 + 0.25 * len(known), _HEIGHT), names, key=0)
    right = max(2.6, 1.15 * max(value for _, value in known))
    _bands(ax, len(known), right)
    for place, (row, value) in enumerate(known):
        colour, controlled = line_of(context, row)
        ax.plot(value, place, "s" if controlled else "o", color=colour, markersize=6.0, zorder=3)
    ax.set_yticks(range(len(known)), names)
    ax.set_ylim(-0.6, len(known) + 2.6)
    ax.set_xlim(0.0, right)
    ax.set_xlabel("a_w [m/s²]")
    ax.grid(visible=False, axis="y")
    alt = "; ".join(f"{context.dampers(row)}: {number(value)} m/s²" for row, value in known[::-1])
    title = f"How it is likely to be felt, {context.road(road)}"
    return Panel(
        figure,
        title,
        f"Weighted r.m.s. a_w on {context.road(road)}: {alt}.",
        "Bands overlap; the last two are not verified.",
    )


def _bands(ax: Axes, top: int, right: float) -> None:
    for i, (band, shade) in enumerate(zip(iso2631_1997.REACTIONS, _SHADES, strict=True)):
        height = top - 0.1 + 0.85 * (2 - i % 3)
        end = float(np.minimum(band.high, right))
        ax.barh(height, end - band.low, left=band.low, height=0.8, color=shade, edgecolor="#9aa5b1", linewidth=0.5)
        name = band.text.replace(" uncomfortable", "")
        ax.annotate(name, (band.low, height), (2, 0), textcoords="offset points", va="center", fontsize=7.0)


PLOT = Plot("comfort_scale", "passenger", 1, draw)
