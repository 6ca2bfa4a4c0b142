"""What is left of the force over the shape that predicts it best, with the shape as it was fitted."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

from pzd.report.blocks import number
from pzd.report.context import ReportContext
from pzd.report.drawing import FINAL, Panel, Plot, axes, legend, shades


def draw(context: ReportContext) -> Iterator[Panel]:
    """Means of classes with their scatter, a colour a voltage; nothing where no shape was told."""
    points = context.diagnosed.hypotheses.points
    if not points:
        return
    groups = [(voltage, list(mine)) for voltage, mine in groupby(points, key=lambda p: p.voltage_V)]
    named = len(groups) > 1
    most = max(abs(p.left_N) + p.scatter_N for p in points)
    figure, ax = axes(labels=(f"-{most:.0f}",), key=(len(groups) + 3) // 4 if named else 0)
    for (voltage, mine), colour in zip(groups, shades(len(groups)), strict=True):
        x, left, scatter = ([getattr(p, name) for p in mine] for name in ("value", "left_N", "scatter_N"))
        label = context.voltage(voltage) if voltage is not None else f"moving {context.control.name}"
        ax.errorbar(x, left, scatter, fmt="o", markersize=3.0, linewidth=0.7, color=colour, label=label)
        ax.plot(x, [p.fitted_N for p in mine], color=FINAL, linewidth=1.5)
    ax.axhline(0.0, color="#9aa5b1", linewidth=0.8)
    ax.locator_params(axis="x", nbins=5)
    first = points[0]
    ax.set_xlabel(f"{first.argument} [{first.unit}]")
    ax.set_ylabel("what is left [N]")
    if named:
        legend(figure, 4)
    high = max(points, key=lambda p: abs(p.fitted_N))
    alt = (
        f"What is left of the force over {first.argument}; c {first.shape} reaches {number(high.fitted_N)} N at "
        f"{number(high.value)} {first.unit}."
    )
    caption = (
        "Dots: mean and standard deviation of samples of one class, less what T0, C, k, the effects adopted and each "
        "test's own offset, gain and delay take up. Line: the hypothesis, which is adopted nowhere."
    )
    yield Panel(figure, f"Hypothesis: what is left, as c {first.shape}", alt, caption)


PLOT = Plot("hypothesis", "missing", 3, draw)
