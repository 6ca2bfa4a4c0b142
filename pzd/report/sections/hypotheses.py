"""Which shape what is left has, where the verdict is `unexplained`: hypotheses, beside the picture of the best."""

from __future__ import annotations

from pzd.artefacts import Hypotheses, HypothesisRow
from pzd.report.blocks import Block, Paragraph, TextTable
from pzd.report.wording import DASH, amount, interval, number, percent, unit_of


def blocks(found: Hypotheses) -> tuple[Block, ...]:
    """A sentence and a table; nothing where none was looked for."""
    if not found.sought:
        return ()
    if not found.rows:
        return (Paragraph("No shape of what is left predicts tests kept back better beyond two standard errors."),)
    best = found.alone[0]
    return (
        Paragraph(
            f"A hypothesis on what is left: c {best.shape}, {best.physics}. It would close {percent(best.closes)} of "
            "the gap on tests kept back. It is adopted nowhere: what has this shape may be something else."
        ),
        TextTable(
            "Shapes of what is left, each by itself, and below beside the best",
            ("shape", "coefficient (95 % interval)", "searched", "gap closed", "standard errors", "physics"),
            tuple(_cells(row) for row in found.rows),
        ),
    )


def _cells(row: HypothesisRow) -> tuple[str, ...]:
    value = interval(row.coefficient, row.coefficient_low95, row.coefficient_high95)
    second = f"; {number(row.second_coefficient)} with the cosine" if row.second_coefficient is not None else ""
    searched = DASH
    if row.parameter is not None:
        searched = f"{row.parameter} = {amount(row.parameter_value, row.parameter_unit or '')}"
    return (
        f"c {row.shape}" if row.beside is None else f"c {row.shape}, beside {row.beside}",
        f"{value}{second} {unit_of(row.unit)}".rstrip(),
        searched,
        percent(row.closes),
        number(row.standard_errors, 2),
        f"{row.physics} ({row.library})" if row.library else row.physics,
    )
