"""The gap of every held-out record, before and after diagnose."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pzd.report.context import ReportContext
from pzd.report.drawing import BASELINE, FINAL, Panel, Plot, axes, legend
from pzd.report.gaps import of_record

_MOST = 16


def draw(context: ReportContext) -> Iterator[Panel]:
    """Two dots a record, joined; nothing where diagnose changed nothing."""
    gap = context.diagnosed.diagnosis.gap
    if not context.extended or gap is None:
        return
    held_out = set(gap.held_out)
    records = [record for record in context.records if record.name in held_out][:_MOST][::-1]
    if not records:
        return
    names = [record.name for record in records]
    before, after = np.array([of_record(context, record) for record in records]).T
    figure, ax = axes(1.0 + 0.26 * max(len(names), 3), names)
    ax.hlines(names, after, before, color="#b8c4d0", linewidth=2.0)
    ax.plot(before, names, "o", color=BASELINE, label="before")
    ax.plot(after, names, "s", color=FINAL, label="after")
    ax.set_xlim(0.0, 1.1 * float(max(before.max(), after.max())))
    ax.set_xlabel("W_s [-]")
    ax.margins(y=0.25)
    legend(figure)
    alt = f"W_s of {len(names)} held-out records; it falls in {int(np.sum(after < before))} of them."
    yield Panel(figure, "Held-out records one by one", alt, "")


PLOT = Plot("held_out", "missing", 2, draw)
