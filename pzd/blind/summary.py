"""What the benchmark says: tables, a picture, and each target beside its figure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pzd.blind.case import Scored
from pzd.blind.confusion import confusion, draw, write_table
from pzd.blind.rates import CalibrationRow, RateRow, calibration_rows, rate_rows
from pzd.blind.targets import Line, campaign_lines, independent_lines, lines
from pzd.quantities import Control
from pzd.schema.csvfile import write_rows
from pzd.schema.jsonfile import write_json


def write(
    cases: Sequence[Scored],
    folder: Path,
    control: Control,
    *,
    tuning: bool,
    generator: str = "own",
    by_campaign: bool = False,
) -> list[str]:
    """Write tables and picture beside the scored cases.

    Parameters
    ----------
    cases : all that are scored
    folder : takes rates.csv, calibration.csv, confusion.csv, confusion.png and summary.json
    control : the control signal
    tuning : whether the seed is one that thresholds were tuned on
    generator : where the cases come from, `own` or `independent`
    by_campaign : whether each campaign gets rates of its own as well

    Returns
    -------
    the lines to print
    """
    folder.mkdir(parents=True, exist_ok=True)
    write_rows(folder / "rates.csv", RateRow, rate_rows(cases), control)
    write_rows(folder / "calibration.csv", CalibrationRow, calibration_rows(cases), control)
    matrix = confusion(cases)
    write_table(matrix, folder / "confusion.csv")
    draw(matrix, folder / "confusion.png")
    said = lines(cases) if generator == "own" else independent_lines(cases)
    if by_campaign:
        said = [*said, *campaign_lines(cases)]
    write_json(folder / "summary.json", said, control)
    head = f"{len(cases)} cases"
    if tuning:
        head += "; thresholds were tuned on this seed, so these figures are no result"
    return [head, *(_printed(line) for line in said), *_failures(cases), _cost(cases)]


def _printed(line: Line) -> str:
    figure = f"{line.about}: {line.figure}"
    if line.value is None:
        return f"{figure:68} {line.count:>18} {line.target and f'({line.target})':>14}  {line.met}"
    value = f"{100 * line.value:5.1f} %"
    spread = "" if line.low95 is None else f"{100 * line.low95:5.1f}-{100 * (line.high95 or 0.0):.1f}"
    target = f"({line.target})" if line.target else ""
    return f"{figure:68} {value} {spread:>11} of {line.count:<5} {target:>12}  {line.met}"


def _failures(cases: Sequence[Scored]) -> list[str]:
    found = Counter(case.failure for case in cases if case.failure)
    return [f"failed {count} times: {failure}" for failure, count in found.most_common(3)]


def _cost(cases: Sequence[Scored]) -> str:
    seconds = [case.diagnose_seconds for case in cases]
    middle, late, most = np.percentile(seconds, [50, 95, 100])
    memory = max(case.peak_memory_MB for case in cases)
    return (
        f"diagnose took {middle:.1f} s (median), {late:.1f} s (95th percentile), {most:.1f} s (most); "
        f"memory {memory:.0f} MB at most"
    )
