"""The first screen: the loop that the simple model misses, what closes the gap, and which policy rides best."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np

from pzd.fit.intervals import LEVEL
from pzd.record import Array, Record
from pzd.report.blocks import amount, listed, number, shortened, spelled
from pzd.report.context import ReportContext
from pzd.report.drawing import (
    AXIS,
    BASELINE,
    FINAL,
    MEASURED,
    MUTED,
    Panel,
    Plot,
    axes,
    axes_with_difference,
    legend,
    thinned,
)
from pzd.report.plots.comfort import trade_off_panel
from pzd.signals.cycles import cycles_of, settled_cycles
from pzd.signals.measures import rms

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_HEIGHT_IN = 3.9
"""All pictures of a row have one height."""

# --- The loop, and the difference below on its own scale ---


def missed_loop(context: ReportContext) -> Iterator[Panel]:
    """Draw the record whose force the simple model misses by most, with the difference below.

    Of those shown, and of those in which the control signal moves: what the drive lacks shows in no other.
    """
    tried = (*context.tests.shown, *context.tests.by_motion_of_voltage()[1])
    if not tried:
        return
    residuals = {record.name: context.damper.residuals(record) for record in tried}
    record = max(tried, key=lambda one: rms(residuals[one.name][0]))
    velocity, measured, baseline, final = _one_cycle(context, record)
    figure, upper, lower = axes_with_difference("velocity [m/s]", "force [kN]", "difference [N]", height=_HEIGHT_IN)
    curves = [(context.damper.baseline_name, baseline, BASELINE, "--")]
    curves += [("with what was missing", final, FINAL, "-")] if context.damper.extended else []
    upper.plot(velocity, measured / 1000.0, color=MUTED, linewidth=4.0, label="measured")
    lower.axhline(0.0, color=AXIS, linewidth=0.8)
    for name, force, colour, style in curves:
        upper.plot(velocity, force / 1000.0, color=colour, linestyle=style, linewidth=1.2, label=name)
        lower.plot(velocity, measured - force, color=colour, linestyle=style, linewidth=1.2)
    legend(figure)
    misses = float(np.abs(measured - baseline).max())
    share = f"{number(100.0 * misses / float(np.abs(measured).max()), 2)} % of its peak"
    left = f"; with what was missing {amount(np.abs(measured - final).max(), 'N', 2)}" * context.damper.extended
    where = context.tests.conditions(record)
    alt = f"Force over velocity at {where}: the {context.damper.baseline_name} misses up to {amount(misses, 'N', 2)}"
    caption = (
        f"{context.tests.motion(record)} at {where}. The {context.damper.baseline_name} misses the force by up to "
        f"{amount(misses, 'N', 2)}, {share}{left}. Difference: measured less model."
    )
    yield Panel(figure, f"What the {context.damper.baseline_name} misses", f"{alt}, {share}{left}.", caption)


def _one_cycle(context: ReportContext, record: Record) -> tuple[Array, ...]:
    """Return velocity and measured, baseline and final force: the mean cycle where the record repeats, else its middle.

    Returns
    -------
    (n,) each, closed where it is a cycle
    """
    columns = record.velocity, record.force, *context.damper.simulated(record)
    run = cycles_of(record) if not context.tests.moves(record) else None
    if run is None:
        part = context.tests.middle(record)
        return thinned(*(column[part] for column in columns))
    run = settled_cycles(run, record.time, record.force)
    means = thinned(*(run.mean(record.time, column) for column in columns))
    return tuple(np.append(mean, mean[0]) for mean in means)


# --- What closes the gap ---


_MOST_CANDIDATES = 5
"""Candidates that are drawn: those behind are in the ranking."""
_BAR = 0.56
"""Height of a bar, of the distance to the next."""
_MOST_BEYOND = 3.0
"""Width of the axes at most, in the longest bar: a single test that no fit predicts leaves the bars to be seen."""


@dataclass(frozen=True)
class _Bar:
    """One model, with what it leaves of the gap."""

    name: str
    w_s: float
    colour: str
    error: float | None
    """Standard error of W_s; None where there is none."""
    each: tuple[float, ...] = ()
    """W_s of each test, predicted by a fit to the others."""


def closing(context: ReportContext) -> Iterator[Panel]:
    """Draw the r.m.s. error of the simple model, the adopted damper and noise on held-out tests, then the candidates'.

    A candidate is fitted together with T0, C and k, and its error is that on the tests which the fits saw.
    """
    if context.diagnosed.diagnosis.gap is None:
        return
    held_out, candidates = _held_out_bars(context), _candidate_bars(context)
    heads = ["held-out tests:", *(["seen tests:"] if candidates else [])]
    rows: list[_Bar | str] = [heads[0], *held_out, *heads[1:], *candidates]
    names = [row if isinstance(row, str) else shortened(row.name) for row in rows]
    figure, ax = axes("error [% of the force]", height=_HEIGHT_IN, labels=names, key=0, right=0.25)
    for place, row in enumerate(rows):
        if isinstance(row, _Bar):
            _draw_bar(ax, place, row)
    ax.set_yticks(range(len(rows)), names)
    for label in (label for label, row in zip(ax.get_yticklabels(), rows, strict=True) if isinstance(row, str)):
        label.set_fontstyle("italic")
    ax.tick_params(axis="y", length=0.0)
    ax.set_ylim(len(rows) - 0.4, -0.6)
    longest = max(_rms_in_percent(bar.w_s + LEVEL * (bar.error or 0.0)) for bar in (*held_out, *candidates))
    strokes = [_rms_in_percent(value) for bar in held_out for value in bar.each]
    right = 1.2 * longest if not strokes else max(1.2 * longest, min(1.05 * max(strokes), _MOST_BEYOND * longest))
    ax.set_xlim(0.0, right)
    ax.grid(visible=False, axis="y")
    texts = "; ".join(f"{bar.name} {number(_rms_in_percent(bar.w_s), 2)} %" for bar in held_out)
    also = "; ".join(f"{bar.name} {number(_rms_in_percent(bar.w_s), 2)} %" for bar in candidates)
    alt = f"Error on held-out tests, of the force: {texts}." + (f" On seen tests: {also}." if also else "")
    beyond = sum(stroke > right for stroke in strokes)
    ticks = " Strokes: each test, predicted by a fit to the others." if strokes else ""
    ticks += f" {beyond} of them are beyond the edge." if beyond else ""
    caption = f"R.m.s. of the error over that of the force. Whiskers: 95 % intervals.{ticks}"
    yield Panel(figure, "What closes the gap", alt, caption)


def _held_out_bars(context: ReportContext) -> list[_Bar]:
    """Return what the simple model, the adopted damper and noise leave of tests that no fit has seen."""
    diagnosis = context.diagnosed.diagnosis
    gap, tests = diagnosis.gap, diagnosis.prediction.by if diagnosis.prediction else ()
    if gap is None:
        return []
    added, extended = listed([spelled(name) for name in context.damper.added]), context.damper.extended
    plain = tuple(test.W_s_plain for test in tests)
    bars = [_Bar(context.damper.baseline_name, gap.before, BASELINE, None if extended else gap.standard_error, plain)]
    if extended:
        name = f"with {added}" if added else "with T0, C, k anew"
        bars.append(_Bar(name, gap.after, FINAL, gap.standard_error, tuple(test.W_s for test in tests)))
    return [*bars, _Bar("noise floor", gap.noise_floor, MEASURED, None)]


def _candidate_bars(context: ReportContext) -> list[_Bar]:
    """Return what each candidate leaves of the tests seen, the adopted ones first, then those that leave least.

    Adopted ones that the ranking has with one error were fitted together, and share a bar.
    """
    diagnosis = context.diagnosed.diagnosis
    adopted = set(diagnosis.effects)
    ranked = sorted(diagnosis.ranking, key=lambda one: (one.effect not in adopted, one.gap_after))
    together = [
        list(group) for _, group in groupby(ranked, lambda one: one.gap_after if one.effect in adopted else one.effect)
    ]
    return [
        _Bar(
            " + ".join(spelled(each.effect) for each in group),
            group[0].gap_after,
            FINAL if group[0].effect in adopted else MUTED,
            group[0].gap_standard_error,
        )
        for group in together[:_MOST_CANDIDATES]
    ]


def _draw_bar(ax: Axes, place: int, bar: _Bar) -> None:
    """Draw a bar, its interval, a stroke for each test, and its length in figures behind them."""
    length, right = _rms_in_percent(bar.w_s), _rms_in_percent(bar.w_s)
    ax.barh(place, length, color=bar.colour, height=_BAR)
    if bar.error is not None:
        ends = [_rms_in_percent(max(bar.w_s + side * LEVEL * bar.error, 0.0)) for side in (-1.0, 1.0)]
        whisker = [[length - ends[0]], [ends[1] - length]]
        ax.errorbar([length], [place], xerr=whisker, color="black", capsize=3.0, linewidth=1.1)
        right = ends[1]
    each = [_rms_in_percent(value) for value in bar.each]
    ax.plot(each, np.full(len(each), place + 0.5 * _BAR + 0.08), "|", color=MEASURED, markersize=5.0, alpha=0.6)
    ax.annotate(f"{number(length, 2)} %", (right, place), (6, 0), textcoords="offset points", va="center", fontsize=8.5)


def _rms_in_percent(w_s: float) -> float:
    """Return the r.m.s. error in % of the r.m.s. force, from W_s, which is the ratio of their squares."""
    return 100.0 * float(np.sqrt(w_s))


# --- Comfort against wheel load, on the first road ---


def best_policy(context: ReportContext) -> Iterator[Panel]:
    """Draw every policy on the first road with the most comfortable marked; nothing with fewer than two rides."""
    for road in context.rated.roads[:1]:
        rows = context.rated.by_comfort(road)
        if len(rows) > 1:
            yield trade_off_panel(context, road, rows, _HEIGHT_IN)


PLOTS = (
    Plot("missed_loop", "answer", 0, missed_loop),
    Plot("closing", "answer", 1, closing),
    Plot("best_policy", "answer", 2, best_policy),
)
