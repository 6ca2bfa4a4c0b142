"""The page of `pzd check --plot`: every record as read, with the findings of the preflight marked in it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from pzd.artefacts import Finding, RecordEntry, Rig
from pzd.parallel.processes import parallel_map
from pzd.quantities import Control
from pzd.record import Array, Record
from pzd.report.blocks import Block, Gallery, Notes, Paragraph, Section, amount, number
from pzd.report.drawing import BASELINE, FINAL, MEASURED, Panel, axes, encoded, styled
from pzd.report.page import render
from pzd.schema.errors import counted

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_BINS = 400
"""Parts of a record; the smallest and the largest sample of each are drawn, so that no spike is passed over."""
_LOOP_POINTS = 2500
"""Points of a loop that are drawn."""
_WHEN = re.compile(r"\b(?:at|after|before|until|from) (-?[\d.]+(?:e[-+]?\d+)?) s\b")
"""A time in the words of a finding."""


def records_page(rig: Rig, control: Control, jobs: int = 1) -> str:
    """Write a page with a section for each record: x, v and F over time, F over v, F over x, and the findings.

    Parameters
    ----------
    rig : the records, with what the preflight found
    control : the control signal, for its unit
    jobs : records drawn at the same time

    Returns
    -------
    HTML that asks nothing of the net and runs no script
    """
    entries: Mapping[str, RecordEntry] = {entry.name: entry for entry in rig.entries}
    with styled():
        sections = parallel_map(lambda record: _section(record, entries[record.name], control), rig.records, jobs)
    count = sum(len(entry.findings) for entry in rig.entries)
    footer = "Written by pzd check. The records stand as they were read: nothing was corrected."
    title = f"{counted(len(rig.records), 'record')} as read, with {counted(count, 'finding')} of the preflight"
    return render(title, (), (), tuple(sections), footer)


def _section(record: Record, entry: RecordEntry, control: Control) -> Section:
    conditions = [
        amount(entry.voltage_V, control.unit) if entry.voltage_V is not None else "",
        amount(entry.temperature_degC, "degC") if entry.temperature_degC is not None else "",
        f"{number(entry.cycles)} cycles at {amount(entry.rate_Hz, 'Hz', 4)}",
        entry.setting or "",
    ]
    pictures = tuple(encoded(panel) for panel in (_over_time(record, entry.findings), *_loops(record, entry.findings)))
    blocks: list[Block] = [Paragraph(f"{', '.join(part for part in conditions if part)}."), Gallery(pictures)]
    if entry.findings:
        lines = (f"{f.check}: {f.where}: {amount(f.size, f.unit)}; {f.follows}" for f in entry.findings)
        blocks.append(Notes(tuple(f"{mark}. {line}" for mark, line in enumerate(lines, 1)), "care"))
    return Section(record.name, record.name, tuple(blocks))


def times_of(findings: Sequence[Finding]) -> list[tuple[int, float]]:
    """Return the times that findings name, each with the number of the finding from 1 [s]."""
    return [(mark, float(when)) for mark, finding in enumerate(findings, 1) for when in _WHEN.findall(finding.where)]


def envelope(time: Array, values: Array) -> tuple[Array, Array]:
    """Return time and value of the smallest and the largest sample of each of many equal parts, in their order.

    Parameters
    ----------
    time : (n,) [s]
    values : (n,) of any channel
    """
    if values.size <= 2 * _BINS:
        return time, values
    edges = np.linspace(0, values.size, _BINS + 1).astype(int)
    rows = sorted(
        {int(first + end(values[first:last])) for first, last in pairwise(edges) for end in (np.argmin, np.argmax)}
    )
    return time[rows], values[rows]


def _over_time(record: Record, findings: Sequence[Finding]) -> Panel:
    from matplotlib.figure import Figure

    figure: Figure = Figure(figsize=(4.5, 4.2))
    channels = (
        ("x [mm]", 1000.0 * record.displacement),
        ("v [m/s]", record.velocity),
        ("F [kN]", record.force / 1000.0),
    )
    plots = figure.subplots(len(channels), 1, sharex=True)
    for ax, (label, values) in zip(plots, channels, strict=True):
        ax.plot(*envelope(record.time, values), color=MEASURED, linewidth=0.8)
        ax.set_ylabel(label)
        for mark, when in times_of(findings):
            ax.axvline(when, color=BASELINE, linewidth=1.2, linestyle="--")
            if ax is plots[0]:
                # 1 point to the right of the line and above the axes
                coordinates = {"xycoords": ("data", "axes fraction"), "textcoords": "offset points"}
                ax.annotate(f"{mark}", (when, 1.0), (1, 1), **coordinates, color=BASELINE)
    plots[-1].set_xlabel("time [s]")
    figure.align_ylabels()
    figure.subplots_adjust(left=0.15, right=0.97, top=0.94, bottom=0.12, hspace=0.12)
    alt = f"Displacement, velocity and force of {record.name} over time."
    return Panel(figure, "Over time", alt, "Dashed: findings, by their number below." if times_of(findings) else "")


def _loops(record: Record, findings: Sequence[Finding]) -> list[Panel]:
    step = max(record.time.size // _LOOP_POINTS, 1)
    marked = [int(np.argmin(np.abs(record.time - when))) for _, when in times_of(findings)]
    panels = []
    for values, label, title in (
        (record.velocity, "velocity [m/s]", "Force over velocity"),
        (1000.0 * record.displacement, "displacement [mm]", "Force over displacement"),
    ):
        figure, ax = axes(label, "force [kN]", height=4.2, key=0)
        ax.plot(values[::step], record.force[::step] / 1000.0, color=FINAL, linewidth=0.6)
        ax.plot(values[marked], record.force[marked] / 1000.0, "o", markersize=8.0, fillstyle="none", color=BASELINE)
        caption = "Circles: where findings are." if marked else ""
        panels.append(Panel(figure, title, f"{title} of {record.name}, all of the record.", caption))
    return panels
