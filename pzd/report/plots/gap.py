"""The gap between measured and simulated force: where it lies, how far it shrank, and what each candidate leaves."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pzd.fit.intervals import LEVEL
from pzd.record import Array, Record
from pzd.report.blocks import number, shortened, spelled
from pzd.report.context import ReportContext
from pzd.report.drawing import BASELINE, FINAL, GRID, MAP, MEASURED, MUTED, Panel, Plot, axes, legend
from pzd.report.rig_tests import settled
from pzd.signals.measures import criterion

# --- Before and after, on held-out data ---

_MOST_RECORDS = 16
"""Held-out records that are drawn: a picture stays readable on one screen."""


def held_out_gap(context: ReportContext) -> Iterator[Panel]:
    """Draw bars of W_s before, after and of noise; before and noise where nothing was adopted; none where unknown."""
    gap = context.diagnosed.diagnosis.gap
    if gap is None:
        return
    extended = context.damper.extended
    noise, after = ("noise floor", gap.noise_floor, MEASURED), ("after", gap.after, FINAL)
    before = ("before" if extended else "simple model", gap.before, BASELINE)
    bars = [noise, after, before] if extended else [noise, before]
    last = bars[1]
    labels = [bar[0] for bar in bars]
    figure, ax = axes("W_s on held-out data [-]", height=1.0 + 0.4 * len(bars), labels=labels, key=0, right=0.3)
    ax.barh([b[0] for b in bars], [b[1] for b in bars], color=[b[2] for b in bars], height=0.6)
    whisker = [LEVEL * gap.standard_error]
    ax.errorbar([last[1]], [last[0]], xerr=whisker, color="black", capsize=3.0, linewidth=1.0)
    for i, bar in enumerate(bars):
        lift = 8 if bar is last else 0  # clear of the whisker
        ax.annotate(number(bar[1]), (bar[1], i), (6, lift), textcoords="offset points", va="center")
    ax.set_xlim(0.0, 1.3 * max(bar[1] for bar in bars) or 1.0)
    ax.locator_params(axis="x", nbins=4)
    ax.grid(visible=False, axis="y")
    figures = ", ".join(f"{name} {number(value)}" for name, value, _ in reversed(bars))
    alt = f"W_s on held-out data: {figures}."
    yield Panel(figure, "The gap on data that no fit has seen", alt, "Whisker: 95 % interval.")


def held_out_records(context: ReportContext) -> Iterator[Panel]:
    """Draw W_s of every held-out record before and after, two dots joined; nothing where diagnose changed nothing."""
    gap = context.diagnosed.diagnosis.gap
    if not context.damper.extended or gap is None:
        return
    held_out = set(gap.held_out)
    records = [record for record in context.tests.records if record.name in held_out][:_MOST_RECORDS][::-1]
    if not records:
        return
    names = [shortened(label) for label in context.tests.labels(records)]
    before, after = np.array([record_gap(context, record) for record in records]).T
    figure, ax = axes("W_s [-]", height=1.0 + 0.26 * max(len(names), 3), labels=names, right=0.3)
    lines = range(len(names))
    ax.hlines(lines, after, before, color=MUTED, linewidth=2.0)
    ax.plot(before, lines, "o", color=BASELINE, label="before")
    ax.plot(after, lines, "s", color=FINAL, label="after")
    ax.set_yticks(lines, names)
    ax.set_xlim(0.0, 1.1 * float(max(before.max(), after.max())))
    ax.locator_params(axis="x", nbins=4)
    ax.margins(y=0.25)
    legend(figure)
    alt = f"W_s of {len(names)} held-out records; it falls in {int(np.sum(after < before))} of them."
    yield Panel(figure, "Held-out records one by one", alt, "")


def record_gap(context: ReportContext, record: Record) -> tuple[float, float]:
    """Compute W_s of a record for the baseline and the final damper, past its start."""
    measured = record.force[settled(record)]
    baseline, final = context.damper.residuals(record)
    return criterion(baseline, measured), criterion(final, measured)


# --- Map over voltage and velocity ---

_BINS = 14
"""Classes of velocity."""
_FEWEST_SAMPLES = 5
"""A cell with fewer samples stays empty: their r.m.s. says nothing."""
_MOST_ROWS = 12
"""Rows by motion, where there is no voltage to tell them apart."""


def gap_map(context: ReportContext) -> Iterator[Panel]:
    """Draw the map of the baseline, and that of the final damper where there is another."""
    if not context.tests.records:
        return
    groups = _groups(context)
    top_speed = max(float(np.abs(record.velocity).max()) for record in context.tests.sampled)
    edges = np.linspace(-top_speed, top_speed, _BINS + 1)
    maps = _rms_maps(context, list(groups.values()), edges)
    top = float(np.nanmax(maps[0]))
    yield _map_panel(context, groups, edges, maps[0], top, context.damper.baseline_name)
    if context.damper.extended:
        yield _map_panel(context, groups, edges, maps[1], top, "with what was missing")


def _groups(context: ReportContext) -> dict[str, list[Record]]:
    """Group records by voltage, or by motion where all share one; those of varying voltage form one group."""
    constant, varying = context.tests.by_motion_of_voltage()
    constant.sort(key=lambda record: context.tests.level(record) or 0.0)
    found: dict[str, list[Record]] = {}
    for record in constant:
        found.setdefault(context.voltage(context.tests.level(record)), []).append(record)
    if len(found) < 2:
        found = {}
        for record in constant[:_MOST_ROWS]:
            found.setdefault(context.tests.motion(record), []).append(record)
    if varying:
        found[f"moving {context.control.name}"] = varying
    return found


def _rms_maps(context: ReportContext, groups: list[list[Record]], edges: Array) -> Array:
    """Compute the r.m.s. residual of both dampers by group and class of velocity.

    Returns
    -------
    (2, groups, classes) in % of the largest measured force; NaN where there are too few samples
    """
    peak = max(float(np.abs(record.force).max()) for record in context.tests.sampled)
    maps = np.full((2, len(groups), _BINS), np.nan)
    for i, records in enumerate(groups):
        velocity = np.concatenate([record.velocity[settled(record)] for record in records])
        cells = np.clip(np.digitize(velocity, edges) - 1, 0, _BINS - 1)
        count = np.bincount(cells, minlength=_BINS)
        for which in (0, 1):
            residual = np.concatenate([context.damper.residuals(record)[which] for record in records])
            square = np.bincount(cells, weights=residual**2, minlength=_BINS)
            with np.errstate(invalid="ignore", divide="ignore"):
                maps[which, i] = np.where(count >= _FEWEST_SAMPLES, 100.0 / peak * np.sqrt(square / count), np.nan)
    return maps


def _map_panel(
    context: ReportContext, groups: dict[str, list[Record]], edges: Array, values: Array, top: float, damper: str
) -> Panel:
    height = 1.5 + 0.3 * max(len(groups), 4)
    figure, ax = axes("velocity [m/s]", height=height, labels=groups, key=0, right=0.75)
    rows = np.arange(len(groups) + 1)
    mesh = ax.pcolormesh(edges, rows, values, cmap=MAP, vmin=0.0, vmax=top, edgecolors="face", linewidth=0.9)
    ax.set_yticks(np.arange(len(groups)) + 0.5, list(groups))
    ax.grid(visible=False)
    box = ax.get_position()
    bar = figure.add_axes((box.x1 + 0.02, box.y0, 0.025, box.height))
    figure.colorbar(mesh, cax=bar, label="gap [% of peak force]")
    by = context.control.name if context.controlled else "test"
    largest = f"largest {np.nanmax(values):.2g} % of the peak force"
    alt = f"Map of the r.m.s. gap by {by} and velocity, {damper}; {largest}."
    caption = "R.m.s. of measured minus simulated force, in % of the largest measured force."
    return Panel(figure, f"Gap, {damper}", alt, caption)


# --- Candidates ---

_MOST_CANDIDATES = 10
"""Of the ranking: those behind are in diagnosis.json."""


def ranking(context: ReportContext) -> Iterator[Panel]:
    """Draw one bar a candidate, best on top."""
    diagnosis = context.diagnosed.diagnosis
    ranked = diagnosis.ranking[:_MOST_CANDIDATES][::-1]
    if not ranked:
        return
    names, height = [spelled(r.effect) for r in ranked], 1.0 + 0.26 * max(len(ranked), 3)
    figure, ax = axes("W_s left on the tests seen [-]", height=height, labels=names, right=0.3)
    colours = [FINAL if r.effect in diagnosis.effects else MUTED for r in ranked]
    ax.barh(names, [r.gap_after for r in ranked], color=colours, height=0.62)
    ax.locator_params(axis="x", nbins=4)
    ax.grid(visible=False, axis="y")
    ax.grid(color=GRID, axis="x")
    alt = f"What each candidate leaves of the gap; best: {names[-1]}, W_s {ranked[-1].gap_after:.3g}."
    caption = "Best first by what the noise makes likely. Adopted effects are dark blue, together as handed on."
    yield Panel(figure, "What each candidate leaves of the gap", alt, caption)


PLOTS = (
    Plot("gap_map", "model", 2, gap_map),
    Plot("held_out_gap", "missing", 0, held_out_gap),
    Plot("ranking", "missing", 1, ranking),
    Plot("held_out_records", "missing", 2, held_out_records),
)
