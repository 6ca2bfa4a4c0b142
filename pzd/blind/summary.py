"""The summary of a benchmark: its tables, the confusion matrix with its picture, and the lines that are printed."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pzd.blind.case import Scored
from pzd.blind.config import BlindConfig
from pzd.blind.outside import FORMS
from pzd.blind.rates import CalibrationRow, RateRow, calibration_rows, rate_rows, truth_among, visible
from pzd.blind.targets import Line, campaign_lines, independent_lines, lines
from pzd.damper.effects import nameable
from pzd.quantities import Control
from pzd.record import Array
from pzd.schema.csvfile import write_rows
from pzd.schema.validate import write_json

# --- The confusion matrix: truth against answer ---


OTHER_ANSWERS = ("several", "ambiguous, truth among", "ambiguous, truth not", "none", "unexplained", "failed")


@dataclass(frozen=True, eq=False)
class Confusion:
    """Counts of cases."""

    rows: tuple[str, ...]
    """Truth."""
    columns: tuple[str, ...]
    """Answer."""
    counts: Array
    """(rows, columns)"""


def confusion(cases: Sequence[Scored]) -> Confusion:
    """Count the cases by truth and answer.

    Effects and pairs whose visible gap is below 0.5 % of the peak have rows of their own.
    """
    found = Counter((_truth_row(case), _answer_column(case)) for case in cases)
    others = sorted({case.hidden for case in cases if case.kind == "outside"} - set(FORMS))
    rows = (*nameable(), "pair", "invisible effect", "invisible pair", "none", *FORMS, *others, "invisible form")
    columns = (*nameable(), *OTHER_ANSWERS)
    kept = tuple(row for row in rows if any(found[row, column] for column in columns))
    return Confusion(kept, columns, np.array([[float(found[row, column]) for column in columns] for row in kept]))


def _truth_row(case: Scored) -> str:
    if case.kind == "outside":
        return case.hidden if visible(case) else "invisible form"
    if not case.truth:
        return "none"
    if len(case.truth) > 1:
        return "pair" if visible(case) else "invisible pair"
    return case.truth[0] if visible(case) else "invisible effect"


def _answer_column(case: Scored) -> str:
    if case.verdict is None:
        return "failed"
    if case.verdict == "ambiguous":
        return "ambiguous, truth among" if truth_among(case) else "ambiguous, truth not"
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
    """Draw the matrix: colours are shares of each row, numbers are counts."""
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


# --- All files and lines ---


def write(cases: Sequence[Scored], folder: Path, control: Control, blind: BlindConfig) -> list[str]:
    """Write tables and picture beside the scored cases, and return the lines to print.

    Parameters
    ----------
    cases : all that are scored
    folder : takes rates.csv, calibration.csv, confusion.csv, confusion.png and summary.json
    control : the control signal
    blind : the generator, whether the seed is one that thresholds were tuned on, and whether campaigns get rates
    """
    folder.mkdir(parents=True, exist_ok=True)
    write_rows(folder / "rates.csv", RateRow, rate_rows(cases), control)
    write_rows(folder / "calibration.csv", CalibrationRow, calibration_rows(cases), control)
    matrix = confusion(cases)
    write_table(matrix, folder / "confusion.csv")
    draw(matrix, folder / "confusion.png")
    summary = lines(cases) if blind.generator == "own" else independent_lines(cases)
    if blind.by_campaign:
        summary = [*summary, *campaign_lines(cases)]
    write_json(folder / "summary.json", summary, control)
    head = f"{len(cases)} cases"
    if blind.tuning:
        head += "; thresholds were tuned on this seed, so these figures are no result"
    return [head, *(_printed(line) for line in summary), *_failures(cases), _cost(cases)]


def _printed(line: Line) -> str:
    figure = f"{line.about}: {line.figure}"
    if line.value is None:
        return f"{figure:68} {line.count:>18} {line.target and f'({line.target})':>14}  {line.met}"
    value = f"{100 * line.value:5.1f} %"
    spread = "" if line.low95 is None else f"{100 * line.low95:5.1f}-{100 * (line.high95 or 0.0):.1f}"
    target = f"({line.target})" if line.target else ""
    return f"{figure:68} {value} {spread:>11} of {line.count:<5} {target:>12}  {line.met}"


def _failures(cases: Sequence[Scored]) -> list[str]:
    failures = Counter(case.failure for case in cases if case.failure)
    return [f"failed {count} times: {failure}" for failure, count in failures.most_common(3)]


def _cost(cases: Sequence[Scored]) -> str:
    seconds = [case.diagnose_seconds for case in cases]
    middle, late, most = np.percentile(seconds, [50, 95, 100])
    memory = max(case.peak_memory_MB for case in cases)
    return (
        f"diagnose took {middle:.1f} s (median), {late:.1f} s (95th percentile), {most:.1f} s (most); "
        f"memory {memory:.0f} MB at most"
    )
