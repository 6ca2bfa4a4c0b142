"""Magnitude of the acceleration at K over time, constant c and controlled, one picture a road."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pzd.artefacts import SummaryRow
from pzd.report.context import REFERENCE, ReportContext, policy_in_words
from pzd.report.drawing import BASELINE, BY_FIDELITY, Panel, Plot, axes, legend, thinned
from pzd.report.ride_comfort import SettledRide
from pzd.report.wording import number

_PERIODS = 3.0
_WINDOW_S = 4.0


def draw(context: ReportContext) -> Iterator[Panel]:
    """The last three periods of a harmonic road; of any other the four seconds with the largest peak."""
    for road in context.roads:
        rides = {ride.row.case: ride for ride in context.settled}
        reference, others = context.reference(road), [*context.controlled(road)[::-1]]
        shown = ([reference] if reference else []) + others
        if shown:
            yield _panel(context, road, shown, rides)


def _panel(context: ReportContext, road: str, shown: list[SummaryRow], rides: dict[str, SettledRide]) -> Panel:
    figure, ax = axes(key=2)
    window = _window(rides[shown[0].case])
    for row in shown:
        ride = rides[row.case]
        constant = row.policy == REFERENCE
        size = np.abs(ride.acceleration[window])
        time, size = thinned(np.arange(size.size) / ride.rate, size)
        colour = BASELINE if constant else BY_FIDELITY[row.fidelity]
        ax.plot(time, size, color=colour, linestyle="--" if constant else "-", label=policy_in_words(row))
    ax.set_xlabel("time [s]")
    ax.set_ylabel("|a_K| [m/s²]")
    ax.set_xlim(left=0.0)
    ax.set_ylim(bottom=0.0)
    legend(figure, 2)
    peaks = "; ".join(f"{policy_in_words(row)} {number(row.peak_abs_aK_m_per_s2)} m/s²" for row in shown)
    title = f"Acceleration at {shown[0].point}, {context.road(road)}"
    return Panel(figure, title, f"Peaks of |a_K| on {road}: {peaks}.", "")


def _window(ride: SettledRide) -> slice:
    size = ride.acceleration.size
    if ride.fundamental is not None:
        return slice(max(size - round(_PERIODS / ride.fundamental * ride.rate), 0), size)
    length = min(round(_WINDOW_S * ride.rate), size)
    start = int(np.argmax(np.abs(ride.acceleration))) - length // 2
    start = min(max(start, 0), size - length)
    return slice(start, start + length)


PLOT = Plot("acceleration", "passenger", 0, draw)
