"""The numbers of several runs as one table: a line a number, a column a run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from pzd.cli.layout import interval, number

if TYPE_CHECKING:
    from pzd.pipeline.run_summary import RunSummary

Column = dict[str, str]


def comparison(runs: Sequence[RunSummary]) -> list[list[str]]:
    """Rows of text; a dash where a run has no such number."""
    columns = [_parameters(run) | _diagnosis(run) | _rides(run) | _comfort(run) for run in runs]
    names = list(dict.fromkeys(name for column in columns for name in column))
    head = ["", *(str(run.folder) for run in runs)]
    return [head, *([name, *(column.get(name, "-") for column in columns)] for name in names)]


def _parameters(run: RunSummary) -> Column:
    column: Column = {}
    for row in run.parameters:
        place = [
            row.setting or "",
            *_with_unit(row.voltage_V, run.control.unit),
            *_with_unit(row.temperature_degC, "degC"),
        ]
        where = ", ".join(part for part in place if part) or "all records"
        column[f"T0 [N], {where}"] = interval(row.T0_N, row.T0_N_low95, row.T0_N_high95)
        column[f"C [N s/m], {where}"] = interval(row.C_Ns_per_m, row.C_Ns_per_m_low95, row.C_Ns_per_m_high95)
        column[f"k [N/m], {where}"] = interval(row.k_N_per_m, row.k_N_per_m_low95, row.k_N_per_m_high95)
        column[f"W_s, {where}"] = number(row.W_s)
    return column


def _with_unit(value: float | None, unit: str) -> list[str]:
    return [] if value is None else [f"{number(value)} {unit}"]


def _diagnosis(run: RunSummary) -> Column:
    found = run.diagnosis
    if found is None:
        return {}
    return {
        "verdict": found.verdict,
        "effects": ", ".join(found.effects) or "-",
        "confidence": number(found.confidence),
        "gap before": number(found.gap.before if found.gap else None),
        "gap after": number(found.gap.after if found.gap else None),
    }


def _rides(run: RunSummary) -> Column:
    column: Column = {}
    for row in run.summary:
        column[f"{row.case}: peak |a_K| at {row.point} [m/s2]"] = number(row.peak_abs_aK_m_per_s2)
        column[f"{row.case}: rms a_K at {row.point} [m/s2]"] = number(row.rms_aK_m_per_s2)
    return column


def _comfort(run: RunSummary) -> Column:
    return {
        f"{row.case}: {row.measure} at {row.point} [{row.unit}], {row.edition}": number(row.value)
        for row in run.comfort
    }
