"""How far the gap shrank on data that no fit has seen, beside what noise alone leaves."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.report.drawing import FINAL, MEASURED, PLAIN, Panel, Plot, axes
from pzd.report.story import Story
from pzd.report.wording import number


def draw(story: Story) -> Iterator[Panel]:
    """Three bars: before, after, noise."""
    gap = story.diagnosed.diagnosis.gap
    bars = (("noise alone", gap.noise_floor, MEASURED), ("after", gap.after, FINAL), ("before", gap.before, PLAIN))
    figure, ax = axes(2.2, ("noise alone",), key=0)
    ax.barh([b[0] for b in bars], [b[1] for b in bars], color=[b[2] for b in bars], height=0.6)
    ax.errorbar([gap.after], ["after"], xerr=[1.96 * gap.standard_error], color="black", capsize=3.0, linewidth=1.0)
    for i, bar in enumerate(bars):
        lift = 8 if bar[0] == "after" else 0
        ax.annotate(number(bar[1]), (bar[1], i), (6, lift), textcoords="offset points", va="center")
    ax.margins(x=0.18)
    ax.set_xlim(left=0.0)
    ax.set_xlabel("W_s on held-out data [-]")
    ax.grid(visible=False, axis="y")
    figures = f"{number(gap.before)} before, {number(gap.after)} after, noise {number(gap.noise_floor)}"
    alt = f"W_s on held-out data: {figures}."
    yield Panel(
        figure, "The gap on data that no fit has seen", alt, "The whisker is the 95 % interval of the gap after."
    )


PLOT = Plot("gap_figures", "missing", 0, draw)
