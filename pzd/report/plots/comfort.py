"""Comfort of the rides, one picture a road.

Acceleration over time, scale of reactions, chart of 1978, and comfort against wheel load for all policies.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from pzd.artefacts import RIDE_COLUMNS, SummaryRow
from pzd.comfort import iso2631_1978, iso2631_1997
from pzd.record import Array
from pzd.report.blocks import amount, number, spelled
from pzd.report.context import ReportContext
from pzd.report.drawing import (
    AXIS,
    BASELINE,
    FINAL,
    INK,
    MEASURED,
    Panel,
    Plot,
    axes,
    legend,
    line_of,
    thinned,
    ticks_named,
)
from pzd.simulate.policies import policies
from pzd.simulate.roads.sine import Sine

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# --- Acceleration at K over time ---

_PERIODS = 3.0
"""Of a harmonic road: enough to see that the ride repeats."""
_WINDOW_S = 4.0
"""Of any other road."""
_TIME, _ACCELERATION = RIDE_COLUMNS[0], RIDE_COLUMNS[-1]


def acceleration(context: ReportContext) -> Iterator[Panel]:
    """Draw abs(a_K): the last periods of a harmonic road, else the seconds around the largest peak; where written."""
    histories = {ride.case: ride.columns for ride in context.rides.rides}
    for road in context.rated.roads:
        shown = tuple(row for row in context.rated.most_realistic(road) if row.case in histories)
        if shown:
            yield _acceleration_panel(context, road, shown, histories)


def _acceleration_panel(
    context: ReportContext, road: str, shown: tuple[SummaryRow, ...], histories: Mapping[str, Mapping[str, Array]]
) -> Panel:
    figure, ax = axes("time [s]", "|a_K| [m/s²]", key=-(-len(shown) // 2))
    spans = {r.name: _PERIODS / r.frequency_Hz for r in context.simulate.roads if isinstance(r, Sine)}
    first = histories[shown[0].case]
    start, end = _window(first[_TIME], np.abs(first[_ACCELERATION]), spans.get(road))
    for row in shown[::-1]:
        columns = histories[row.case]
        within = (columns[_TIME] >= start) & (columns[_TIME] <= end)
        time, size = thinned(columns[_TIME][within] - start, np.abs(columns[_ACCELERATION][within]))
        colour, controlled = line_of(context, row)
        ax.plot(time, size, color=colour, linestyle="-" if controlled else "--", label=context.rated.policy_label(row))
    ax.set_xlim(left=0.0)
    ax.set_ylim(bottom=0.0)
    legend(figure, 2)
    peaks = "; ".join(f"{context.rated.label(row)} {number(row.peak_abs_aK_m_per_s2)} m/s²" for row in shown)
    title = f"Acceleration at {shown[0].point}, {context.rated.road_label(road)}"
    return Panel(figure, title, f"Peaks of |a_K| on {road}: {peaks}.", f"Fidelity {shown[0].fidelity}.")


def _window(time: Array, size: Array, span: float | None) -> tuple[float, float]:
    """Return start and end of what is shown [s]: the last `span`, or around the largest value where there is none."""
    first, last = float(time[0]), float(time[-1])
    if span is not None:
        return max(last - span, first), last
    start = float(time[int(np.argmax(size))]) - 0.5 * _WINDOW_S
    start = min(max(start, first), max(last - _WINDOW_S, first))
    return start, start + _WINDOW_S


# --- Scale of likely reactions (ISO 2631-1:1997) ---

_SCALE_HEIGHT_IN = 2.8
_BAND_SHADES = ("#f3f6f9", "#e6ecf2", "#d9e2ea", "#ccd7e2", "#bfccd9", "#b2c1d0")


def comfort_scale(context: ReportContext) -> Iterator[Panel]:
    """Draw a_w of every policy over the bands of likely reactions, which overlap as they do in the standard."""
    for road in context.rated.roads:
        values = [(row, context.rated.value(row.case, "a_w")) for row in context.rated.by_comfort(road)]
        known = [(row, value) for row, value in values if value is not None]
        if known:
            yield _scale_panel(context, road, known[::-1])


def _scale_panel(context: ReportContext, road: str, known: list[tuple[SummaryRow, float]]) -> Panel:
    names = [context.rated.policy_name(row) for row, _ in known]
    height = max(1.0 + 0.22 * (len(known) + len(iso2631_1997.REACTIONS)), _SCALE_HEIGHT_IN)
    figure, ax = axes("a_w [m/s²]", height=height, labels=names, key=0)
    right = max(2.6, 1.15 * max(value for _, value in known))
    _reaction_bands(ax, len(known), right)
    for place, (row, value) in enumerate(known):
        colour, controlled = line_of(context, row)
        ax.plot(value, place, "s" if controlled else "o", color=colour, markersize=6.0, zorder=3)
    ticks_named(ax, names)
    ax.set_ylim(-0.6, len(known) + len(iso2631_1997.REACTIONS) - 0.2)
    ax.set_xlim(0.0, right)
    ax.grid(visible=False, axis="y")
    label = context.rated.road_label(road)
    values = "; ".join(f"{context.rated.label(row)}: {number(value)} m/s²" for row, value in known[::-1])
    alt = f"Weighted r.m.s. a_w on {label}: {values}."
    caption = f"Fidelity {known[0][0].fidelity}. Bands overlap; the last two are not verified."
    return Panel(figure, f"How it is likely to be felt, {label}", alt, caption)


def _reaction_bands(ax: Axes, bottom: int, right: float) -> None:
    """Draw a row a band above the rides, its name within or beside it where it has room."""
    for place, (band, shade) in enumerate(zip(iso2631_1997.REACTIONS, _BAND_SHADES, strict=True)):
        height, end = bottom + 0.2 + place, float(np.minimum(band.high, right))
        if band.low >= right:
            continue
        ax.barh(height, end - band.low, left=band.low, height=0.8, color=shade, edgecolor=AXIS, linewidth=0.5)
        to_left = band.low > 0.5 * right
        offset, side = (-3, "right") if to_left else (3, "left")
        name, at = band.text.replace(" uncomfortable", ""), (band.low, height)
        ax.annotate(name, at, (offset, 0), textcoords="offset points", ha=side, va="center", fontsize=8.0)


# --- Chart of reduced comfort (ISO 2631:1978) ---

_EXPOSURE_LINES = {1440.0: "24 h", 480.0: "8 h", 150.0: "2.5 h", 60.0: "1 h", 25.0: "25 min", 4.0: "4 min"}
_SMALLEST_COMPONENT = 0.02
"""Components below this share of the largest are not drawn."""


def exposure_chart(context: ReportContext) -> Iterator[Panel]:
    """Draw lines of equal exposure time, and the components of the controlled ride and of the best of the others."""
    if iso2631_1978.EDITION not in context.config.editions:
        return
    for road in context.rated.roads:
        rows = context.rated.most_realistic(road)[:2]
        if rows:
            yield _exposure_panel(context, road, [row.case for row in rows])


def _exposure_panel(context: ReportContext, road: str, cases: list[str]) -> Panel:
    figure, ax = axes("frequency [Hz]", "acceleration, r.m.s. [m/s²]", height=3.3)
    _exposure_lines(ax)
    rides = [ride for ride in context.rated.rides if ride.row.case in cases]
    for ride in rides:
        parts = ride.components
        drawn = parts.rms >= _SMALLEST_COMPONENT * float(parts.rms.max())
        colour, controlled = line_of(context, ride.row)
        label, marker = context.rated.policy_label(ride.row), "s" if controlled else "o"
        ax.plot(parts.frequency[drawn], parts.rms[drawn], marker, color=colour, markersize=6.0, label=label, zorder=3)
    legend(figure, 2)
    title = f"Reduced comfort, {context.rated.road_label(road)}"
    alt = f"Components of the rides over {road} on the chart of reduced comfort of ISO 2631:1978."
    caption = "Boundaries of ISO 2631:1978: unverified transcription of a withdrawn standard."
    return Panel(figure, title, alt, f"Fidelity {rides[0].row.fidelity}. {caption}")


def _exposure_lines(ax: Axes) -> None:
    table, factor = iso2631_1978.chart(), iso2631_1978.FACTORS["reduced_comfort"]
    for minutes, level in zip(table.minutes, table.level.T, strict=True):
        if float(minutes) in _EXPOSURE_LINES:
            ax.plot(table.frequency, factor * level, color=AXIS, linewidth=1.0)
            end = (float(table.frequency[-1]), factor * float(level[-1]))
            ax.annotate(_EXPOSURE_LINES[float(minutes)], end, (3, -3), textcoords="offset points", fontsize=8)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlim(1.0, 130.0)
    ax.set_xticks([1, 2, 4, 8, 16, 31.5, 63], ["1", "2", "4", "8", "16", "31.5", "63"])
    ax.set_xticks([], minor=True)
    ticks = np.array([0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0])
    ax.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    ax.set_yticks([], minor=True)


# --- Comfort against wheel load ---

_NAMES_IN = 1.45
"""Room for the names, to the right [in]."""
_NAME_WIDE = 20
"""Characters of a line of a name that this room holds."""
_LINE_IN = 0.16
"""Height of a line of names [in]."""
_AROUND_IN = 0.75
"""Height around the lines of names [in]."""
_LEAST_IN = 3.1
"""Height of a figure with few policies [in]."""
_LEAST_SPAN = 0.1
"""Of an axis, as a share of its values."""
_LEADER = {"arrowstyle": "-", "color": AXIS, "linewidth": 0.5, "relpos": (0.0, 0.5), "shrinkA": 1.0, "shrinkB": 2.0}
"""From a name to its point."""


def trade_off(context: ReportContext) -> Iterator[Panel]:
    """Draw one panel a road; nothing where fewer than two policies control."""
    for road in context.rated.roads:
        rows = context.rated.trade_off(road)
        if rows:
            yield trade_off_panel(context, road, rows)


def trade_off_panel(
    context: ReportContext, road: str, rows: Sequence[SummaryRow], least_height: float = _LEAST_IN
) -> Panel:
    """Draw rides over one road, the best of them in a circle.

    Parameters
    ----------
    context : the run
    road : its name
    rows : the rides at one fidelity, the most comfortable first
    least_height : of the figure [in]
    """
    height = max(_AROUND_IN + _LINE_IN * len(rows), least_height)
    best = context.rated.best(road)
    names = "wheel load, r.m.s. [N]", "a_w [m/s²]"
    figure, ax = axes(*names, height=height, labels=("0.000",), key=0, right=_NAMES_IN)
    loads = np.array([row.rms_wheel_load_N for row in rows])
    comfort = np.array([context.rated.a_w(row) for row in rows])
    front = context.rated.pareto_front(rows)
    for row, load, a_w in zip(rows, loads, comfort, strict=True):
        colour, mark = _trade_off_style(context, row)
        ax.plot(load, a_w, mark, color=colour, markersize=6.5 if row in front else 4.5, zorder=3)
        if row == best:
            ax.plot(load, a_w, "o", color=INK, markersize=14.0, fillstyle="none", markeredgewidth=1.2, zorder=2)
    edge = sorted((load, a_w) for row, load, a_w in zip(rows, loads, comfort, strict=True) if row in front)
    ax.step(*zip(*edge, strict=True), where="post", color=INK, linewidth=0.8, linestyle=":", zorder=1)
    ax.margins(0.09)
    ax.set_xlim(_widened(*ax.get_xlim()))
    ax.set_ylim(_widened(*ax.get_ylim()))
    _write_names(ax, context, rows, best)
    values = "; ".join(
        f"{context.control.told(spelled(row.policy))} {amount(a_w, 'm/s2')} and {amount(load, 'N')}"
        for row, load, a_w in zip(rows, loads, comfort, strict=True)
    )
    title = f"Comfort against wheel load, {context.rated.road_label(road)}"
    alt = f"a_w and r.m.s. wheel load on {context.rated.road_label(road)}: {values}."
    of = f"Of {len(rows)} policies {context.rated.policy_name(best)} is the most comfortable (circle). " if best else ""
    caption = (
        f"{of}To the left the road feels less of the car, below the passenger less of the road ({rows[0].fidelity})."
    )
    return Panel(figure, title, alt, caption)


def _widened(low: float, high: float) -> tuple[float, float]:
    """Return limits that are a share of the values apart at least: rides that are alike shall look so."""
    more = max(0.5 * _LEAST_SPAN * abs(low + high) / 2.0 - (high - low) / 2.0, 0.0)
    return low - more, high + more


def _trade_off_style(context: ReportContext, row: SummaryRow) -> tuple[str, str]:
    """Return colour and marker of a ride: of the policy under study, the best found, others that control, the rest."""
    if context.simulate.is_controlled(row.policy):
        return FINAL, "s"
    if policies()[row.policy].tuned == "schedule":
        return INK, "*"
    return (BASELINE, "^") if policies()[row.policy].controlled else (MEASURED, "o")


def _write_names(ax: Axes, context: ReportContext, rows: Sequence[SummaryRow], best: SummaryRow | None) -> None:
    """Write every name beside the axes, in the order of comfort, with a line to its point."""
    low, high = ax.get_ylim()
    places = np.linspace(0.0, 1.0, len(rows)) if len(rows) > 1 else np.array([0.5])
    for row, place in zip(rows, places, strict=True):
        colour, _ = _trade_off_style(context, row)
        ax.annotate(
            fill(context.control.told(spelled(row.policy)), _NAME_WIDE),
            (row.rms_wheel_load_N, context.rated.a_w(row)),
            (1.06, place),
            textcoords="axes fraction",
            va="center",
            fontsize=8.0,
            color=colour,
            weight="bold" if row == best else "normal",
            annotation_clip=False,
            arrowprops=_LEADER,
        )
    ax.set_ylim(low, high)


PLOTS = (
    Plot("acceleration", "passenger", 0, acceleration),
    Plot("comfort_scale", "passenger", 1, comfort_scale),
    Plot("exposure_chart", "passenger", 2, exposure_chart),
    Plot("trade_off", "policies", 0, trade_off),
)
