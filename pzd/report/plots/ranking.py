"""The candidates, by what each leaves of the gap."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.report.context import ReportContext
from pzd.report.drawing import FINAL, GRID, Panel, Plot, axes

_MOST = 10


def draw(context: ReportContext) -> Iterator[Panel]:
    """One bar a candidate, best on top."""
    diagnosis = context.diagnosed.diagnosis
    ranked = diagnosis.ranking[:_MOST][::-1]
    if not ranked:
        return
    figure, ax = axes(1.0 + 0.26 * max(len(ranked), 3), [r.effect for r in ranked])
    colours = [FINAL if r.effect in diagnosis.effects else "#b8c4d0" for r in ranked]
    ax.barh([r.effect for r in ranked], [r.gap_after for r in ranked], color=colours, height=0.62)
    ax.locator_params(axis="x", nbins=4)
    ax.set_xlabel("W_s left on the tests seen [-]")
    ax.grid(visible=False, axis="y")
    ax.grid(color=GRID, axis="x")
    alt = f"What each candidate leaves of the gap; best: {ranked[-1].effect}, W_s {ranked[-1].gap_after:.3g}."
    caption = "Best first by what the noise makes likely. Adopted effects stand out in dark blue."
    yield Panel(figure, "What each candidate leaves of the gap", alt, caption)


PLOT = Plot("ranking", "missing", 1, draw)
