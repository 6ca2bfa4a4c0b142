"""Whether what is left is spread as chance spreads it: its quantiles over those of a normal distribution."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pzd.record import Array
from pzd.report.blocks import number
from pzd.report.context import ReportContext
from pzd.report.drawing import BASELINE, FINAL, MEASURED, Panel, Plot, axes, legend
from pzd.report.gaps import begun
from pzd.signals.measures import rms

_POINTS = 120
"""Quantiles that are drawn."""


def draw(context: ReportContext) -> Iterator[Panel]:
    """One picture, under the verdict `unexplained` alone."""
    if context.diagnosed.diagnosis.verdict != "unexplained" or not context.records:
        return
    figure, ax = axes()
    curves = [(context.model, 0, BASELINE)] + [("with what was added", 1, FINAL)] * context.extended
    for label, which, colour in curves:
        normal, found = quantiles(context, which)
        ax.plot(normal, found, color=colour, label=label)
    line = [float(normal[0]), float(normal[-1])]
    ax.plot(line, line, "--", color=MEASURED, label="normal")
    ax.set_xlabel("quantile of a normal distribution")
    ax.set_ylabel("of what is left, over its r.m.s.")
    legend(figure)
    ends = f"from {number(found[0])} to {number(found[-1])}"
    alt = f"Quantiles of measured minus simulated force against a normal distribution: {ends}."
    told = "On the dashed line it is spread as chance spreads it; long ends are rare large misses, as jumps leave them."
    yield Panel(figure, "How what is left is spread", alt, told)


def quantiles(context: ReportContext, which: int) -> tuple[Array, Array]:
    """Quantiles of a normal distribution, and of what one of the dampers leaves, each test over its own r.m.s."""
    from scipy.special import ndtri

    parts = [(r.force - context.simulated(r)[which])[begun(r)] for r in context.sampled]
    whole = np.concatenate([part / (rms(part) or 1.0) for part in parts])
    shares = (np.arange(_POINTS) + 0.5) / _POINTS
    return np.asarray(ndtri(shares)), np.quantile(whole, shares)


PLOT = Plot("left_quantiles", "missing", 6, draw)
