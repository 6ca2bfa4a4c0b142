"""The page of a sweep: how far its results spread, and what decides."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING

from pzd.config import Normal, Scatter, Uniform
from pzd.report.blocks import Block, Card, Gallery, Notes, Paragraph, Section, TextTable
from pzd.report.drawing import BASELINE, FINAL, STYLE, Panel, axes, encoded
from pzd.report.page import render
from pzd.report.wording import number
from pzd.schema.wording import counted
from pzd.sweep.gather import IndexRow, Results, SpreadRow
from pzd.sweep.plan import quantities

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MEASURES = {
    "identify": ("T0_N", "C_Ns_per_m", "k_N_per_m", "W_s"),
    "diagnose": ("W_s", "gap_after", "confidence"),
    "simulate": ("a_w_m_per_s2", "rms_wheel_load_N", "peak_deflection_m"),
}
"""What the page shows, most important first; the files hold all."""
_MOST_LINES = 24
"""Of a picture."""
_MOST_TORNADOES = 4
_MOST_NAMED = 3
_FOOTER = "Written by pzd sweep. Every number of this page stands in the files beside it."
_LONGEST_LABEL = 34


def page(results: Results, title: str) -> str:
    """The page as HTML that asks nothing of the net and runs no script.

    Parameters
    ----------
    results : of all runs
    title : of the page
    """
    import matplotlib as mpl

    spread, indices = results.spread, results.indices
    with mpl.rc_context(STYLE):  # type: ignore[arg-type]  # the stubs list every key of rcParams one by one
        sections = (_spread(results, spread), *_decides(results, indices), *_failed(results))
    return render(title, _cards(results, indices), (), sections, _FOOTER)


def decisive(results: Results) -> list[str]:
    """For every label, in words, which quantity decides over the measure that matters most, and by how much."""
    measure = MEASURES[results.sweep.until][0]
    lines = []
    for (combination, about), rows in groupby(
        (row for row in results.indices if row.measure == measure), key=lambda row: (row.combination, row.about)
    ):
        ordered = sorted(rows, key=lambda row: -row.total_order)
        shares = ", ".join(f"{row.quantity} {row.total_order:.0%} ({_interval(row)})" for row in ordered[:_MOST_NAMED])
        lines.append(f"{measure} of {_label(combination, about)}: of the variance {shares}")
    return lines


def _interval(row: IndexRow) -> str:
    if row.total_order_low95 is None or row.total_order_high95 is None:
        return "no interval"
    return f"{_percent(row.total_order_low95)} to {_percent(row.total_order_high95)}"


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
    said = [f"{key}: {', '.join(map(str, values))}" for key, values in results.sweep.over.items()]
    said += [f"{key}: {_in_words(how)}" for key, how in results.sweep.drawn.items()]
    said += [f"damper.{name}: {_in_words(how)}" for name, how in results.sweep.damper.items()]
    blocks.append(Notes(tuple(said)))
    if names:
        blocks.append(Paragraph("Dots are medians, bars hold nine draws of ten."))
    shown = MEASURES[results.sweep.until]
    panels = [_strips([row for row in spread if row.measure == measure], measure) for measure in shown]
    blocks.append(Gallery(tuple(encoded(panel) for panel in panels if panel)))
    rows = tuple(
        (
            _label(row.combination, row.about),
            row.measure,
            number(row.mean),
            number(row.standard_deviation),
            number(row.percent_5),
            number(row.percent_95),
        )
        for row in spread
        if row.measure in shown
    )
    header = ("of", "measure", "mean", "standard deviation", "5 %", "95 %")
    blocks.append(TextTable("Results over the draws", header, rows, folded=len(rows) > _MOST_LINES))
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
    told = "Total order: the share of the variance that stays when everything else is known; bars are 95 % intervals."
    if len(labels) > _MOST_TORNADOES:
        told += f" The first {_MOST_TORNADOES} of {len(labels)}; the table holds all."
    rows = tuple(
        (
            _label(row.combination, row.about),
            row.quantity,
            _percent(row.first_order),
            _percent(row.total_order),
            _interval(row),
        )
        for row in mine
    )
    header = ("of", "quantity", "first order", "total order", "95 % interval")
    table = TextTable(f"Sobol indices of {measure}", header, rows, folded=len(rows) > _MOST_LINES)
    gallery = Gallery(tuple(encoded(panel) for panel in tornadoes))
    return (Section("decides", "What decides", (Paragraph(told), gallery, table)),)


def _failed(results: Results) -> tuple[Section, ...]:
    if not results.failed:
        return ()
    rows = tuple((f"{row.task}", row.differs_in, row.failure) for row in results.failed)
    return (Section("failed", "Without a result", (TextTable("Runs", ("run", "differs in", "why"), rows),)),)


def _in_words(how: Uniform | Normal | Scatter) -> str:
    """How a quantity is drawn."""
    if isinstance(how, Uniform):
        return f"drawn between {how.uniform[0]:g} and {how.uniform[1]:g}"
    if isinstance(how, Normal):
        return f"drawn about {how.normal[0]:g} with a standard deviation of {how.normal[1]:g}"
    return "drawn as uncertain as the tests leave it" if isinstance(how, str) else f"scatters by {how:.3g} of its value"


def _label(combination: str, about: str) -> str:
    """What a result is of, keys of the config by their last word."""
    pairs = (part.partition(" = ") for part in combination.split(", "))
    short = ", ".join(f"{key.rpartition('.')[2]}{equals}{value}" for key, equals, value in pairs)
    return ", ".join(part for part in (short, about) if part) or "all"


def _percent(share: float) -> str:
    """A share that chance makes less than none is none."""
    return f"{max(share, 0.0):.0%}"


def _strips(rows: Sequence[SpreadRow], measure: str) -> Panel | None:
    if not rows:
        return None
    shown = rows[:_MOST_LINES]
    labels = [_short(_label(row.combination, row.about)) for row in shown]
    figure, ax = _lines(labels)
    for place, row in enumerate(shown):
        ax.plot((row.percent_5, row.percent_95), (place, place), color=FINAL, linewidth=5.0, alpha=0.4)
        ax.plot(row.median, place, "o", color=FINAL, markersize=5.0)
    ax.set_xlabel(measure)
    left_out = f" The first {_MOST_LINES} of {len(rows)}." if len(rows) > _MOST_LINES else ""
    return Panel(figure, measure, f"{measure} of every combination, median and nine draws of ten.", left_out.strip())


def _tornado(rows: Sequence[IndexRow], measure: str) -> Panel:
    ordered = sorted(rows, key=lambda row: row.total_order)
    figure, ax = _lines([_short(row.quantity) for row in ordered])
    for place, row in enumerate(ordered):
        ax.barh(place, row.total_order, color=FINAL, height=0.6)
        if row.total_order_low95 is not None and row.total_order_high95 is not None:
            ax.plot((row.total_order_low95, row.total_order_high95), (place, place), color=BASELINE, linewidth=1.5)
    ax.set_xlabel("share of the variance (total order)")
    label = _label(rows[0].combination, rows[0].about)
    return Panel(figure, f"{measure}, {label}", f"Share of the variance of {measure} by quantity.", "")


def _lines(labels: Sequence[str]) -> tuple[Figure, Axes]:
    figure, ax = axes(0.9 + 0.24 * len(labels), labels, key=0)
    ax.set_yticks(range(len(labels)), labels)
    ax.set_ylim(-0.7, len(labels) - 0.3)
    ax.locator_params(axis="x", nbins=4)
    return figure, ax


def _short(label: str) -> str:
    return label if len(label) <= _LONGEST_LABEL else f"...{label[3 - _LONGEST_LABEL :]}"
