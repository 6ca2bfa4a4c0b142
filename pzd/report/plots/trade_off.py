"""Comfort against wheel load: all policies on one road, each with its name."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from pzd.artefacts import SummaryRow
from pzd.record import Array
from pzd.report.blocks import amount
from pzd.report.context import ReportContext, name_of, of_road, unbeaten
from pzd.report.drawing import BASELINE, FINAL, INK, MEASURED, Panel, Plot, axes
from pzd.simulate.policies import policies

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_NAMES_IN = 1.45
"""Room for the names, to the right."""
_LINE_IN = 0.16
_AROUND_IN = 0.75
_LEAST_IN = 3.1
_LEADER = {
    "arrowstyle": "-",
    "color": "#9aa5b1",
    "linewidth": 0.5,
    "relpos": (0.0, 0.5),
    "shrinkA": 1.0,
    "shrinkB": 2.0,
}
"""From a name to its point."""


def draw(context: ReportContext) -> Iterator[Panel]:
    """One panel a road; nothing where fewer than two policies control."""
    for road in context.roads:
        rows = of_road(context, road)
        if rows:
            yield _panel(context, road, rows)


def _panel(context: ReportContext, road: str, rows: Sequence[SummaryRow]) -> Panel:
    figure, ax = axes(max(_AROUND_IN + _LINE_IN * len(rows), _LEAST_IN), ("0.00",), key=0, right=_NAMES_IN)
    loads, comfort = np.array([row.rms_wheel_load_N for row in rows]), np.array([context.a_w(row) for row in rows])
    best = unbeaten(context, rows)
    for row, load, a_w in zip(rows, loads, comfort, strict=True):
        colour, mark = _style(context, row)
        ax.plot(load, a_w, mark, color=colour, markersize=6.5 if row in best else 4.5, zorder=3)
    edge = sorted((load, a_w) for row, load, a_w in zip(rows, loads, comfort, strict=True) if row in best)
    ax.step(*zip(*edge, strict=True), where="post", color=INK, linewidth=0.8, linestyle=":", zorder=1)
    ax.margins(0.06)
    ax.set_xlabel("wheel load, r.m.s. [N]")
    ax.set_ylabel("a_w [m/s²]")
    _name(ax, context, rows, loads, comfort)
    told = "; ".join(
        f"{name_of(row.policy)} {amount(a_w, 'm/s2')} and {amount(load, 'N')}"
        for row, load, a_w in zip(rows, loads, comfort, strict=True)
    )
    title = f"Comfort against wheel load, {context.road(road)}"
    alt = f"a_w and r.m.s. wheel load on {context.road(road)}: {told}."
    return Panel(figure, title, alt, f"Fidelity {rows[0].fidelity}.")


def _style(context: ReportContext, row: SummaryRow) -> tuple[str, str]:
    """Colour and mark of a ride: the policy that the report is about, the others that control, those that hold."""
    if context.simulate.is_controlled(row.policy):
        return FINAL, "s"
    if policies()[row.policy].tuned == "schedule":
        return INK, "*"
    return (BASELINE, "^") if policies()[row.policy].controlled else (MEASURED, "o")


def _name(ax: Axes, context: ReportContext, rows: Sequence[SummaryRow], loads: Array, comfort: Array) -> None:
    """Every name beside the axes, in the order of comfort, with a line to its point."""
    low, high = ax.get_ylim()
    places = np.linspace(0.0, 1.0, len(rows)) if len(rows) > 1 else np.array([0.5])
    for row, load, a_w, place in zip(rows, loads, comfort, places, strict=True):
        colour, _ = _style(context, row)
        ax.annotate(
            name_of(row.policy),
            (load, a_w),
            (1.06, place),
            textcoords="axes fraction",
            va="center",
            fontsize=8.0,
            color=colour,
            annotation_clip=False,
            arrowprops=_LEADER,
        )
    ax.set_ylim(low, high)


PLOT = Plot("trade_off", "policies", 0, draw)
