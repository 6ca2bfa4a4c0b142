"""Comfort against wheel load: all policies on each road, each with its name."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from pzd.artefacts import SummaryRow
from pzd.record import Array
from pzd.report.blocks import amount, spelled
from pzd.report.context import ReportContext
from pzd.report.drawing import AXIS, BASELINE, FINAL, INK, MEASURED, Panel, Plot, axes
from pzd.simulate.policies import policies

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_NAMES_IN = 1.45
"""Room for the names, to the right [in]."""
_LINE_IN = 0.16
"""Height of a line of names [in]."""
_AROUND_IN = 0.75
"""Height around the lines of names [in]."""
_LEAST_IN = 3.1
"""Height of a figure with few policies [in]."""
_LEADER = {
    "arrowstyle": "-",
    "color": AXIS,
    "linewidth": 0.5,
    "relpos": (0.0, 0.5),
    "shrinkA": 1.0,
    "shrinkB": 2.0,
}
"""From a name to its point."""


def trade_off(context: ReportContext) -> Iterator[Panel]:
    """Draw one panel a road; nothing where fewer than two policies control."""
    for road in context.rated.roads:
        rows = context.rated.trade_off(road)
        if rows:
            yield _panel(context, road, rows)


def _panel(context: ReportContext, road: str, rows: Sequence[SummaryRow]) -> Panel:
    figure, ax = axes(max(_AROUND_IN + _LINE_IN * len(rows), _LEAST_IN), ("0.00",), key=0, right=_NAMES_IN)
    loads, comfort = (
        np.array([row.rms_wheel_load_N for row in rows]),
        np.array([context.rated.a_w(row) for row in rows]),
    )
    front = context.rated.pareto_front(rows)
    for row, load, a_w in zip(rows, loads, comfort, strict=True):
        colour, mark = _style(context, row)
        ax.plot(load, a_w, mark, color=colour, markersize=6.5 if row in front else 4.5, zorder=3)
    edge = sorted((load, a_w) for row, load, a_w in zip(rows, loads, comfort, strict=True) if row in front)
    ax.step(*zip(*edge, strict=True), where="post", color=INK, linewidth=0.8, linestyle=":", zorder=1)
    ax.margins(0.06)
    ax.set_xlabel("wheel load, r.m.s. [N]")
    ax.set_ylabel("a_w [m/s²]")
    _name(ax, context, rows, loads, comfort)
    values = "; ".join(
        f"{spelled(row.policy)} {amount(a_w, 'm/s2')} and {amount(load, 'N')}"
        for row, load, a_w in zip(rows, loads, comfort, strict=True)
    )
    title = f"Comfort against wheel load, {context.rated.road_label(road)}"
    alt = f"a_w and r.m.s. wheel load on {context.rated.road_label(road)}: {values}."
    return Panel(figure, title, alt, f"Fidelity {rows[0].fidelity}.")


def _style(context: ReportContext, row: SummaryRow) -> tuple[str, str]:
    """Return colour and marker of a ride: of the policy under study, the best found, others that control, the rest."""
    if context.simulate.is_controlled(row.policy):
        return FINAL, "s"
    if policies()[row.policy].tuned == "schedule":
        return INK, "*"
    return (BASELINE, "^") if policies()[row.policy].controlled else (MEASURED, "o")


def _name(ax: Axes, context: ReportContext, rows: Sequence[SummaryRow], loads: Array, comfort: Array) -> None:
    """Write every name beside the axes, in the order of comfort, with a line to its point."""
    low, high = ax.get_ylim()
    places = np.linspace(0.0, 1.0, len(rows)) if len(rows) > 1 else np.array([0.5])
    for row, load, a_w, place in zip(rows, loads, comfort, places, strict=True):
        colour, _ = _style(context, row)
        ax.annotate(
            spelled(row.policy),
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


PLOTS = (Plot("trade_off", "policies", 0, trade_off),)
