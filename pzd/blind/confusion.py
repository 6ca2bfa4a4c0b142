"""What was there against what was said: the confusion matrix, as numbers and as a picture."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pzd.blind.case import Scored
from pzd.blind.outside import FORMS
from pzd.blind.rates import among, visible
from pzd.damper.effects import nameable
from pzd.record import Array

SAID = ("several", "ambiguous, truth among", "ambiguous, truth not", "none", "unexplained", "failed")


@dataclass(frozen=True, eq=False)
class Confusion:
    """Counts of cases."""

    rows: tuple[str, ...]
    """What was there."""
    columns: tuple[str, ...]
    """What was said."""
    counts: Array
    """(rows, columns)"""


def confusion(cases: Sequence[Scored]) -> Confusion:
    """Every case by what was there and what was said of it.

    Effects and pairs whose visible gap is below 0.5 % of the peak have rows of their own.
    """
    found = Counter((true_row(case), said(case)) for case in cases)
    others = sorted({case.hidden for case in cases if case.kind == "outside"} - set(FORMS))
    rows = (*nameable(), "pair", "invisible effect", "invisible pair", "none", *FORMS, *others, "invisible form")
    columns = (*nameable(), *SAID)
    kept = tuple(row for row in rows if any(found[row, column] for column in columns))
    return Confusion(kept, columns, np.array([[float(found[row, column]) for column in columns] for row in kept]))


def true_row(case: Scored) -> str:
    """The row of a case."""
    if case.kind == "outside":
        return case.hidden if visible(case) else "invisible form"
    if not case.truth:
        return "none"
    if len(case.truth) > 1:
        return "pair" if visible(case) else "invisible pair"
    return case.truth[0] if visible(case) else "invisible effect"


def said(case: Scored) -> str:
    """The column of a case."""
    if case.verdict is None:
        return "failed"
    if case.verdict == "ambiguous":
        return "ambiguous, truth among" if among(case) else "ambiguous, truth not"
    if case.verdict != "named":
        return case.verdict
    return case.effects[0] if len(case.effects) == 1 else "several"


def write_table(matrix: Confusion, path: Path) -> None:
    """Write the counts as CSV."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["truth", *matrix.columns])
        for name, counts in zip(matrix.rows, matrix.counts, strict=True):
            writer.writerow([name, *(int(count) for count in counts)])


def draw(matrix: Confusion, path: Path) -> None:
    """Draw the matrix: shares of each row, counts written in."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    from pzd.report.drawing import STYLE

    rows, columns = len(matrix.rows), len(matrix.columns)
    shares = matrix.counts / np.maximum(matrix.counts.sum(axis=1, keepdims=True), 1.0)
    style: dict[str, object] = {**STYLE, "savefig.transparent": False}
    with mpl.rc_context(style):  # type: ignore[arg-type]  # the stubs list every key of rcParams one by one
        figure = Figure(figsize=(2.6 + 0.33 * columns, 2.2 + 0.25 * rows), layout="constrained")
        ax = figure.subplots()
        ax.imshow(np.sqrt(shares), cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
        for row, column in np.argwhere(matrix.counts > 0):
            ink = "white" if shares[row, column] > 0.4 else "black"
            ax.text(column, row, f"{matrix.counts[row, column]:.0f}", ha="center", va="center", color=ink, fontsize=7.5)
        ax.set_xticks(range(columns), matrix.columns, rotation=90)
        ax.set_yticks(range(rows), matrix.rows)
        ax.set_xlabel("said")
        ax.set_ylabel("there")
        ax.grid(visible=False)
        figure.savefig(path, dpi=150, metadata={"Software": None})
