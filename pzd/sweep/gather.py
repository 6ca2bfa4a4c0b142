"""Results of a sweep: all in one table, their spread over the draws, Sobol indices, and the page that shows them."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pzd.artefacts.csv_rows import Estimate
from pzd.config import Normal, Scatter, SweepConfig, Uniform
from pzd.quantities import BINGHAM, Control
from pzd.record import Array
from pzd.report.blocks import Block, Card, Gallery, Notes, Paragraph, Section, shortened
from pzd.report.columns import Column, Table
from pzd.report.drawing import BASELINE, FINAL, Panel, axes, encoded, styled
from pzd.report.page import render
from pzd.schema.csvfile import disarmed, write_rows
from pzd.schema.errors import counted
from pzd.schema.model import Frozen
from pzd.schema.yamltree import Scalar
from pzd.sweep.task import RunResult, Task, quantities, with_indices

LABELS = ("setting", "voltage_V", "temperature_degC", "case", "road", "policy", "fidelity", "point")
"""Columns that label a row; all other numbers are measures of it."""
RESAMPLES = 500
"""Resamples of the draws for the intervals of the indices: ends are then known to a tenth of their width."""
INTERVAL = (2.5, 97.5)
"""Percentiles of the resampled indices: a 95 % interval                            Source: Efron 1979"""


class SpreadRow(Frozen):
    """One measure over the draws of one combination."""

    combination: str
    about: str
    """Labels of the row."""
    measure: str
    draws: int
    mean: float
    standard_deviation: float
    percent_5: float
    median: float
    percent_95: float


class IndexRow(Frozen):
    """Sobol indices of one measure and one quantity."""

    combination: str
    about: str
    measure: str
    quantity: str
    """Its intervals are empty where the draws do not vary with it at all."""
    first_order: float
    """Share of the variance that vanishes when the quantity alone is known."""
    first_order_low95: float | None
    first_order_high95: float | None
    total_order: float
    """Share that remains when everything else is known."""
    total_order_low95: float | None
    total_order_high95: float | None


class FailedRow(Frozen):
    """A run without a result."""

    task: int
    differs_in: str
    failure: str


@dataclass(frozen=True)
class Results:
    """All results of a sweep."""

    sweep: SweepConfig
    tasks: tuple[Task, ...]
    outcomes: tuple[RunResult, ...]
    seed: int = 1
    """Of the resampling."""

    @cached_property
    def _by_task(self) -> dict[int, RunResult]:
        return {outcome.task: outcome for outcome in self.outcomes}

    @property
    def failed(self) -> tuple[FailedRow, ...]:
        """The runs without a result."""
        pairs = ((task, self._by_task[task.number].failure) for task in self.tasks)
        return tuple(
            FailedRow(task=task.number, differs_in=task.described, failure=failure)
            for task, failure in pairs
            if failure
        )

    def rows(self) -> list[dict[str, Scalar]]:
        """Return every row of every run, behind its number and the values it differs in."""
        found = []
        for task in self.tasks:
            own = {"task": task.number, **dict(task.over), **dict(task.drawn)}
            own |= {f"damper.{name}": z for name, z in task.damper}
            found += [{**own, **row} for row in self._by_task[task.number].rows]
        return found

    @cached_property
    def spread(self) -> tuple[SpreadRow, ...]:
        """Spread of every measure over the independent draws of each combination."""
        return tuple(
            SpreadRow(
                combination=combination,
                about=label,
                measure=measure,
                draws=values.size,
                mean=float(values.mean()),
                standard_deviation=float(values.std(ddof=1)) if values.size > 1 else 0.0,
                percent_5=float(np.percentile(values, 5.0)),
                median=float(np.median(values)),
                percent_95=float(np.percentile(values, 95.0)),
            )
            for combination, label, measure, found in self._measures()
            for drawn in [found[: self._independent]]
            for values in [drawn[np.isfinite(drawn)]]
            if values.size
        )

    @cached_property
    def indices(self) -> tuple[IndexRow, ...]:
        """Sobol indices of every measure that varies, for combinations of which no run failed.

        Equation: S_i = V_i(E(Y | x_i)) / V(Y), S_Ti = E(V(Y | x_~i)) / V(Y)
                                        Source: Saltelli et al. 2010, by scipy.stats.sobol_indices
        """
        if not with_indices(self.sweep):
            return ()
        return tuple(
            row
            for combination, label, measure, found in self._measures()
            if np.isfinite(found).all() and float(np.ptp(found)) > 0.0
            for row in self._indices_of((combination, label, measure), found)
        )

    def _indices_of(self, labels: tuple[str, str, str], values: Array) -> list[IndexRow]:
        names, n = quantities(self.sweep), self.sweep.draws
        # A mean far from zero would cancel digits; the indices do not depend on it.
        parts = (values - values[: 2 * n].mean()).reshape(len(names) + 2, n)
        found = _sobol(parts)
        generator = np.random.default_rng(self.seed)
        again = [_sobol(parts[:, generator.integers(n, size=n)]) for _ in range(RESAMPLES)]
        low, high = np.nanpercentile(again, INTERVAL, axis=0)
        combination, label, measure = labels
        first, total = ([_estimate(*ends) for ends in zip(found[i], low[i], high[i], strict=True)] for i in (0, 1))
        return [
            IndexRow(
                combination=combination,
                about=label,
                measure=measure,
                quantity=name,
                **first[i].columns("first_order"),
                **total[i].columns("total_order"),
            )
            for i, name in enumerate(names)
        ]

    @property
    def _independent(self) -> int:
        """Number of runs of a combination that are independent of each other; the rest serve the indices."""
        return 2 * self.sweep.draws if with_indices(self.sweep) else self.sweep.draws

    def _measures(self) -> list[tuple[str, str, str, Array]]:
        """Return combination, label, measure, and its value in every run; NaN where a run has none."""
        found = []
        for over, some in groupby(self.tasks, key=lambda task: task.over):
            runs = [self._by_task[task.number].rows for task in some]
            names = dict.fromkeys(
                (_row_label(row), key)
                for rows in runs
                for row in rows
                for key, value in row.items()
                if _is_measure(key, value)
            )
            by_label = [{_row_label(row): row for row in rows} for rows in runs]
            combination = ", ".join(f"{key} = {value}" for key, value in over)
            for label, key in names:
                values = [_number(each.get(label, {}).get(key)) for each in by_label]
                found.append((combination, label, key, np.array(values)))
        return found


def _row_label(row: Mapping[str, Scalar]) -> str:
    if "case" in row:
        return str(row["case"]) if row.get("point") in (None, "K") else f"{row['case']} {row['point']}"
    return ", ".join(f"{row[key]}" for key in LABELS if row.get(key) is not None)


def _is_measure(key: str, value: Scalar) -> bool:
    return key not in LABELS and isinstance(value, int | float) and not isinstance(value, bool)


def _number(value: Scalar) -> float:
    return float(value) if isinstance(value, int | float) else float("nan")


def _sobol(parts: Array) -> Array:
    """Compute (2, d) first and total order of d quantities from (d + 2, n) results of the rows A, B and mixed."""
    from scipy.stats import sobol_indices

    with np.errstate(invalid="ignore", divide="ignore"):  # draws that are all alike by chance have no indices
        found = sobol_indices(
            func={"f_A": parts[:1], "f_B": parts[1:2], "f_AB": parts[2:, np.newaxis]}, n=parts.shape[1]
        )
    return np.stack([np.ravel(found.first_order), np.ravel(found.total_order)])


def _estimate(value: float, low: float, high: float) -> Estimate:
    """Return an index with its interval, none where that has no width."""
    known = np.isfinite(low) and low < high
    return Estimate(float(value), float(low), float(high)) if known else Estimate(float(value))


def write(results: Results, folder: Path, control: Control) -> None:
    """Write results.csv, spread.csv, sensitivity.csv and failed.csv; results.parquet too where pyarrow is installed.

    Parameters
    ----------
    results : of all runs
    folder : takes the files
    control : the control signal, which names its columns
    """
    rows = results.rows()
    columns = list(dict.fromkeys(key for row in rows for key in row)) or ["task"]
    _write_table(folder / "results.csv", columns, rows, control)
    write_rows(folder / "spread.csv", SpreadRow, results.spread, control)
    write_rows(folder / "sensitivity.csv", IndexRow, results.indices, control)
    write_rows(folder / "failed.csv", FailedRow, results.failed, control)
    _write_parquet(folder / "results.parquet", columns, rows, control)


def _write_table(path: Path, columns: Sequence[str], rows: Sequence[Mapping[str, Scalar]], control: Control) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([control.renamed(name) for name in columns])
        writer.writerows([disarmed(row.get(name)) for name in columns] for row in rows)


def _write_parquet(path: Path, columns: Sequence[str], rows: Sequence[Mapping[str, Scalar]], control: Control) -> None:
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError:  # an extra
        return
    table = pa.table({control.renamed(name): _of_one_type([row.get(name) for row in rows]) for name in columns})
    parquet.write_table(table, path)


def _of_one_type(values: Sequence[Scalar]) -> Sequence[Scalar]:
    """Return a column as text where some of it is text."""
    mixed = any(isinstance(value, str) for value in values)
    return [None if value is None else str(value) for value in values] if mixed else values


# --- The page ---

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MEASURES = {
    "identify": (*(quantity.column for quantity in BINGHAM), "W_s"),
    "diagnose": ("W_s", "gap_after", "confidence"),
    "simulate": ("a_w_m_per_s2", "rms_wheel_load_N", "peak_deflection_m"),
}
"""Measures that the page shows, most important first; the files hold all."""
_MOST_LINES = 24
"""Lines of a picture, and rows of a table that is not folded."""
_MOST_TORNADOES = 4
"""Pictures of indices on the page."""
_MOST_NAMED = 3
"""Quantities named in a line of the terminal."""
_FOOTER = "Written by pzd sweep. Every number of this page stands in the files beside it."


def page(results: Results, title: str) -> str:
    """Write the page as HTML that asks nothing of the net and runs no script.

    Parameters
    ----------
    results : of all runs
    title : of the page
    """
    spread, indices = results.spread, results.indices
    with styled():
        sections = (_spread(results, spread), *_decides(results, indices), *_failed(results))
    return render(title, _cards(results, indices), (), sections, _FOOTER)


def decisive(results: Results) -> list[str]:
    """Say for every label which quantities decide over the most important measure, and by how much."""
    measure = MEASURES[results.sweep.until][0]
    lines = []
    for (combination, label), rows in groupby(
        (row for row in results.indices if row.measure == measure), key=lambda row: (row.combination, row.about)
    ):
        ordered = sorted(rows, key=lambda row: -row.total_order)
        shares = ", ".join(f"{row.quantity} {row.total_order:.0%} ({_interval(row)})" for row in ordered[:_MOST_NAMED])
        lines.append(f"{measure} of {_label(combination, label)}: of the variance {shares}")
    return lines


def _interval(row: IndexRow) -> str:
    interval = Estimate.of(row, "total_order").interval
    return "no interval" if interval is None else " to ".join(map(_percent, interval))


def _cards(results: Results, indices: Sequence[IndexRow]) -> tuple[Card, ...]:
    runs, failed = len(results.tasks), len(results.failed)
    detail = f"{counted(failed, 'run')} came to no result" if failed else "all came to a result"
    cards = [Card("How many runs?", f"{runs}", detail)]
    measure = MEASURES[results.sweep.until][0]
    mine = [row for row in indices if row.measure == measure]
    if mine:
        most = max(mine, key=lambda row: row.total_order)
        answer = f"{most.quantity}: {most.total_order:.0%} of the variance"
        cards.append(Card("What decides?", answer, f"of {measure} in {_label(most.combination, most.about)}"))
    return tuple(cards)


def _spread(results: Results, spread: Sequence[SpreadRow]) -> Section:
    blocks: list[Block] = []
    names = quantities(results.sweep)
    varied = [f"{key}: {', '.join(map(str, values))}" for key, values in results.sweep.over.items()]
    varied += [f"{key}: {_in_words(how)}" for key, how in results.sweep.drawn.items()]
    varied += [f"damper.{name}: {_in_words(how)}" for name, how in results.sweep.damper.items()]
    blocks.append(Notes(tuple(varied)))
    if names:
        blocks.append(Paragraph("Dots are medians, bars hold nine draws of ten."))
    shown = MEASURES[results.sweep.until]
    panels = [_strips([row for row in spread if row.measure == measure], measure) for measure in shown]
    blocks.append(Gallery(tuple(encoded(panel) for panel in panels if panel)))
    columns = (
        _OF,
        Column("measure", "measure"),
        Column("mean", "mean"),
        Column("standard_deviation", "standard deviation"),
        Column("percent_5", "5 %"),
        Column("percent_95", "95 %"),
    )
    rows = [row for row in spread if row.measure in shown]
    blocks.append(Table("Results over the draws", columns, rows, _MOST_LINES).block())
    return Section("results", "Results", tuple(blocks))


def _decides(results: Results, indices: Sequence[IndexRow]) -> tuple[Section, ...]:
    measure = MEASURES[results.sweep.until][0]
    mine = [row for row in indices if row.measure == measure]
    if not mine:
        return ()
    labels = list(dict.fromkeys((row.combination, row.about) for row in mine))
    tornadoes = [
        _tornado([row for row in mine if (row.combination, row.about) == label], measure)
        for label in labels[:_MOST_TORNADOES]
    ]
    text = "Total order: the share of the variance that stays when everything else is known; bars are 95 % intervals."
    if len(labels) > _MOST_TORNADOES:
        text += f" The first {_MOST_TORNADOES} of {len(labels)}; the table holds all."
    columns = (
        _OF,
        Column("quantity", "quantity"),
        Column("first_order", "first order", words=_percent),
        Column("total_order", "total order", words=_percent),
        Column("interval", "95 % interval", value=_interval),
    )
    table = Table(f"Sobol indices of {measure}", columns, mine, _MOST_LINES).block()
    gallery = Gallery(tuple(encoded(panel) for panel in tornadoes))
    return (Section("decides", "What decides", (Paragraph(text), gallery, table)),)


def _failed(results: Results) -> tuple[Section, ...]:
    if not results.failed:
        return ()
    columns = (Column("task", "run"), Column("differs_in", "differs in"), Column("failure", "why"))
    return (Section("failed", "Without a result", (Table("Runs", columns, results.failed).block(),)),)


def _in_words(how: Uniform | Normal | Scatter) -> str:
    """Say how a quantity is drawn."""
    if isinstance(how, Uniform):
        return f"drawn between {how.uniform[0]:g} and {how.uniform[1]:g}"
    if isinstance(how, Normal):
        return f"drawn about {how.normal[0]:g} with a standard deviation of {how.normal[1]:g}"
    return "drawn as uncertain as the tests leave it" if isinstance(how, str) else f"scatters by {how:.3g} of its value"


def _label(combination: str, label: str) -> str:
    """Name what a result belongs to, keys of the config by their last word."""
    pairs = (part.partition(" = ") for part in combination.split(", "))
    short = ", ".join(f"{key.rpartition('.')[2]}{equals}{value}" for key, equals, value in pairs)
    return ", ".join(part for part in (short, label) if part) or "all"


_OF = Column("of", "of", value=lambda row: _label(row.combination, row.about))


def _percent(share: float) -> str:
    """Write a share in percent; one that chance makes negative is 0."""
    return f"{max(share, 0.0):.0%}"


def _strips(rows: Sequence[SpreadRow], measure: str) -> Panel | None:
    if not rows:
        return None
    shown = rows[:_MOST_LINES]
    figure, ax = _lines(measure, [_label(row.combination, row.about) for row in shown])
    for place, row in enumerate(shown):
        ax.plot((row.percent_5, row.percent_95), (place, place), color=FINAL, linewidth=5.0, alpha=0.4)
        ax.plot(row.median, place, "o", color=FINAL, markersize=5.0)
    left_out = f" The first {_MOST_LINES} of {len(rows)}." if len(rows) > _MOST_LINES else ""
    return Panel(figure, measure, f"{measure} of every combination, median and nine draws of ten.", left_out.strip())


def _tornado(rows: Sequence[IndexRow], measure: str) -> Panel:
    ordered = sorted(rows, key=lambda row: row.total_order)
    figure, ax = _lines("share of the variance (total order)", [row.quantity for row in ordered])
    for place, row in enumerate(ordered):
        ax.barh(place, row.total_order, color=FINAL, height=0.6)
        if interval := Estimate.of(row, "total_order").interval:
            ax.plot(interval, (place, place), color=BASELINE, linewidth=1.5)
    label = _label(rows[0].combination, rows[0].about)
    return Panel(figure, f"{measure}, {label}", f"Share of the variance of {measure} by quantity.", "")


def _lines(x: str, names: Sequence[str]) -> tuple[Figure, Axes]:
    """Return axes with one line a name."""
    labels = [shortened(name) for name in names]
    figure, ax = axes(x, height=0.9 + 0.24 * len(labels), labels=labels, key=0)
    ax.set_yticks(range(len(labels)), labels)
    ax.set_ylim(-0.7, len(labels) - 0.3)
    ax.locator_params(axis="x", nbins=4)
    return figure, ax
