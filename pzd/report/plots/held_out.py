"""The gap of every held-out record, before and after diagnose."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pzd.report.drawing import FINAL, PLAIN, Panel, Plot, axes
from pzd.report.gaps import by_record
from pzd.report.story import Story

_MOST = 16


def draw(story: Story) -> Iterator[Panel]:
    """Two dots a record, joined; nothing where diagnose changed nothing."""
    if not story.extended:
        return
    held_out = set(story.diagnosed.diagnosis.gap.held_out)
    found = {name: gap for name, gap in by_record(story).items() if name in held_out}
    if not found:
        return
    names = sorted(found)[:_MOST][::-1]
    before, after = np.array([found[name] for name in names]).T
    figure, ax = axes(height=1.3 + 0.26 * max(len(names), 3))
    ax.hlines(names, after, before, color="#b8c4d0", linewidth=2.0)
    ax.plot(before, names, "o", color=PLAIN, label="before")
    ax.plot(after, names, "s", color=FINAL, label="after")
    ax.set_xlim(0.0, 1.1 * float(max(before.max(), after.max())))
    ax.set_xlabel("W_s [-]")
    figure.legend(loc="outside upper center", ncols=2)
    alt = f"W_s of {len(names)} held-out records; it falls in {int(np.sum(after < before))} of them."
    yield Panel(figure, "Held-out records one by one", alt, "")


PLOT = Plot("held_out", "missing", 2, draw)
