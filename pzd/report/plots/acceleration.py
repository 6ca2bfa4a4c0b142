"""Magnitude of the acceleration at K over time, the controlled ride beside the others, one picture a road."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from pzd.artefacts import RIDE_COLUMNS, SummaryRow
from pzd.record import Array
from pzd.report.blocks import number
from pzd.report.context import ReportContext
from pzd.report.drawing import Panel, Plot, axes, legend, line_of, thinned
from pzd.simulate.roads.sine import Sine

_PERIODS = 3.0
_WINDOW_S = 4.0
_TIME, _ACCELERATION = RIDE_COLUMNS[0], RIDE_COLUMNS[-1]


def draw(context: ReportContext) -> Iterator[Panel]:
    """The last three periods of a harmonic road, of any other the four seconds with the largest peak; where written."""
    histories = {ride.case: ride.columns for ride in context.rides.rides}
    for road in context.roads:
        shown = tuple(row for row in context.nearest(road) if row.case in histories)
        if shown:
            yield _panel(context, road, shown, histories)


def _panel(
    context: ReportContext, road: str, shown: tuple[SummaryRow, ...], histories: Mapping[str, Mapping[str, Array]]
) -> Panel:
    figure, ax = axes(key=2)
    periods = {r.name: _PERIODS / r.frequency_Hz for r in context.simulate.roads if isinstance(r, Sine)}
    first = histories[shown[0].case]
    start, end = _window(first[_TIME], np.abs(first[_ACCELERATION]), periods.get(road))
    for row in shown[::-1]:
        columns = histories[row.case]
        within = (columns[_TIME] >= start) & (columns[_TIME] <= end)
        time, size = thinned(columns[_TIME][within] - start, np.abs(columns[_ACCELERATION][within]))
        colour, controlled = line_of(context, row)
        ax.plot(time, size, color=colour, linestyle="-" if controlled else "--", label=context.dampers(row))
    ax.set_xlabel("time [s]")
    ax.set_ylabel("|a_K| [m/s²]")
    ax.set_xlim(left=0.0)
    ax.set_ylim(bottom=0.0)
    legend(figure, 2)
    peaks = "; ".join(f"{context.dampers(row)} {number(row.peak_abs_aK_m_per_s2)} m/s²" for row in shown)
    title = f"Acceleration at {shown[0].point}, {context.road(road)}"
    return Panel(figure, title, f"Peaks of |a_K| on {road}: {peaks}.", "")


def _window(time: Array, size: Array, periods: float | None) -> tuple[float, float]:
    """Start and end of what is shown [s]."""
    first, last = float(time[0]), float(time[-1])
    if periods is not None:
        return max(last - periods, first), last
    start = float(time[int(np.argmax(size))]) - 0.5 * _WINDOW_S
    start = min(max(start, first), max(last - _WINDOW_S, first))
    return start, start + _WINDOW_S


PLOT = Plot("acceleration", "passenger", 0, draw)
