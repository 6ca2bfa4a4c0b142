"""The first screen: the loop that the simple model misses, what closes the gap, and which policy rides best."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pzd.record import Array, Record
from pzd.report.blocks import amount, listed, number, spelled
from pzd.report.context import ReportContext
from pzd.report.drawing import AXIS, BASELINE, FINAL, MEASURED, MUTED, Panel, Plot, axes, legend, shortened, thinned
from pzd.report.plots.comfort import trade_off_panel
from pzd.signals.cycles import cycles_of, settled_cycles
from pzd.signals.measures import rms

_HEIGHT_IN = 3.9
"""All pictures of a row have one height."""

# --- The loop, and the difference below on its own scale ---

_SHARE_BELOW = 0.32
"""Of the height for both, for the difference."""


def missed_loop(context: ReportContext) -> Iterator[Panel]:
    """Draw the record of those shown whose force the simple model misses by most, with the difference below."""
    if not context.tests.shown:
        return
    residuals = {record.name: context.damper.residuals(record) for record in context.tests.shown}
    record = max(context.tests.shown, key=lambda one: rms(residuals[one.name][0]))
    velocity, measured, baseline, final = _one_cycle(context, record)
    figure, upper = axes("", "force [kN]", height=_HEIGHT_IN, labels=("-0.00",), key=1)
    box = upper.get_position()
    below = _SHARE_BELOW * box.height
    upper.set_position((box.x0, box.y0 + below + 0.03, box.width, box.height - below - 0.03))
    lower = figure.add_axes((box.x0, box.y0, box.width, below), sharex=upper)
    upper.tick_params(labelbottom=False)
    curves = [(context.damper.baseline_name, baseline, BASELINE, "--")]
    curves += [("with what was missing", final, FINAL, "-")] if context.damper.extended else []
    upper.plot(velocity, measured / 1000.0, color=MUTED, linewidth=4.0, label="measured")
    lower.axhline(0.0, color=AXIS, linewidth=0.8)
    for name, force, colour, style in curves:
        upper.plot(velocity, force / 1000.0, color=colour, linestyle=style, linewidth=1.2, label=name)
        lower.plot(velocity, measured - force, color=colour, linestyle=style, linewidth=1.2)
    lower.set_xlabel("velocity [m/s]")
    lower.set_ylabel("difference [N]")
    lower.margins(y=0.15)
    figure.align_ylabels()
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
    run = cycles_of(record)
    if run is None:
        part = context.tests.middle(record)
        return thinned(*(column[part] for column in columns))
    run = settled_cycles(run, record.time, record.force)
    means = thinned(*(run.mean(record.time, column) for column in columns))
    return tuple(np.append(mean, mean[0]) for mean in means)


# --- What closes the gap ---

_NORMAL_95 = 1.96
"""Half-width of a 95 % interval in standard errors."""


def closing(context: ReportContext) -> Iterator[Panel]:
    """Draw the r.m.s. error on held-out tests of the simple model, of the adopted damper and of noise alone."""
    gap = context.diagnosed.diagnosis.gap
    if gap is None:
        return
    added = listed([spelled(name) for name in context.diagnosed.damper.effects])
    rows = [("noise alone", gap.noise_floor, MEASURED), (context.damper.baseline_name, gap.before, BASELINE)]
    if context.damper.extended:
        rows.insert(1, (f"with {added}" if added else "with T0, C, k anew", gap.after, FINAL))
    names = [shortened(name) for name, _, _ in rows]
    figure, ax = axes("error on held-out tests [%]", height=_HEIGHT_IN, labels=names, key=0)
    ax.barh(range(len(rows)), [_percent(value) for _, value, _ in rows], color=[c for _, _, c in rows], height=0.5)
    ends = [_percent(max(gap.after + side * _NORMAL_95 * gap.standard_error, 0.0)) for side in (-1.0, 1.0)]
    ax.errorbar(
        [_percent(gap.after)],
        [1],
        xerr=[[_percent(gap.after) - ends[0]], [ends[1] - _percent(gap.after)]],
        color="black",
        capsize=4.0,
        linewidth=1.2,
    )
    tests = context.diagnosed.diagnosis.prediction
    for place, column in ((len(rows) - 1, "W_s_plain"), (1, "W_s")):
        each = [_percent(getattr(test, column)) for test in tests.by] if tests else []
        ax.plot(each, np.full(len(each), place - 0.33), "|", color=MEASURED, markersize=6.0, alpha=0.6)
    for place, (_, value, _) in enumerate(rows):
        right = max(_percent(value), ends[1] if place == 1 else 0.0)
        ax.annotate(f"{number(_percent(value), 2)} %", (right, place), (6, 0), textcoords="offset points", va="center")
    ax.set_yticks(range(len(rows)), names)
    ax.set_ylim(-0.6, len(rows) - 0.4)
    ax.margins(x=0.18)
    ax.set_xlim(left=0.0)
    ax.grid(visible=False, axis="y")
    texts = "; ".join(f"{name} {number(_percent(value), 2)} %" for name, value, _ in rows[::-1])
    ticks = " Strokes: each test, predicted by a fit to the others." if tests and tests.by else ""
    caption = (
        f"R.m.s. of the error over that of the force, on tests that no fit has seen. Whisker: 95 % interval.{ticks}"
    )
    yield Panel(figure, "What closes the gap", f"Error on held-out tests, of the force: {texts}.", caption)


def _percent(w_s: float) -> float:
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
