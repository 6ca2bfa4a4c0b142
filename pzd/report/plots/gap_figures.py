"""How far the gap shrank on data that no fit has seen, beside what noise alone leaves."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.report.blocks import number
from pzd.report.context import ReportContext
from pzd.report.drawing import BASELINE, FINAL, MEASURED, Panel, Plot, axes


def draw(context: ReportContext) -> Iterator[Panel]:
    """Bars before, after and of noise; before and noise alone where nothing was adopted; none where it is unknown."""
    gap = context.diagnosed.diagnosis.gap
    if gap is None:
        return
    noise, after = ("noise alone", gap.noise_floor, MEASURED), ("after", gap.after, FINAL)
    before = ("before" if context.extended else "simple model", gap.before, BASELINE)
    bars = [noise, after, before] if context.extended else [noise, before]
    last = bars[1]
    figure, ax = axes(1.0 + 0.4 * len(bars), [bar[0] for bar in bars], key=0)
    ax.barh([b[0] for b in bars], [b[1] for b in bars], color=[b[2] for b in bars], height=0.6)
    ax.errorbar([last[1]], [last[0]], xerr=[1.96 * gap.standard_error], color="black", capsize=3.0, linewidth=1.0)
    for i, bar in enumerate(bars):
        lift = 8 if bar is last else 0
        ax.annotate(number(bar[1]), (bar[1], i), (6, lift), textcoords="offset points", va="center")
    ax.set_xlim(0.0, 1.3 * max(bar[1] for bar in bars) or 1.0)
    ax.set_xlabel("W_s on held-out data [-]")
    ax.grid(visible=False, axis="y")
    figures = ", ".join(f"{name} {number(value)}" for name, value, _ in reversed(bars))
    alt = f"W_s on held-out data: {figures}."
    yield Panel(figure, "The gap on data that no fit has seen", alt, "Whisker: 95 % interval.")


PLOT = Plot("gap_figures", "missing", 0, draw)
