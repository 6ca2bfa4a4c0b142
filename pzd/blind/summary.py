"""What the benchmark says: tables, a picture, and each target beside its figure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pzd.blind.case import Scored
from pzd.blind.rates import CalibrationRow, RateRow, calibration_rows, rate_rows
from pzd.quantities import Control
from pzd.schema.csvfile import write_rows


def write(cases: Sequence[Scored], folder: Path, control: Control, *, tuning: bool) -> list[str]:
    """Write the tables and the picture; the lines to print."""
    rows = rate_rows(cases)
    write_rows(folder / "rates.csv", RateRow, rows, control)
    write_rows(folder / "calibration.csv", CalibrationRow, calibration_rows(cases), control)
    lines = [
        f"{r.campaign:14} {r.kind:8} noise {r.force_noise:10} gap {r.visible_gap_percent:9} n {r.cases:4} right {r.right:.2f} "
        f"amb {r.ambiguous_with_truth:.2f} wrong {r.wrong_name:.2f} among {r.truth_among:.2f} none {r.none:.2f} unexpl {r.unexplained:.2f}"
        for r in rows
    ]
    lines += [
        f"{c.id} {c.campaign:13} {c.hidden:30} gap {100 * c.visible_gap:.2f} noise {c.force_noise} -> {c.verdict} {'+'.join(c.effects)} "
        f"rivals {','.join(c.rivals)} conf {c.confidence} cut {c.gap_cut} {c.seconds:.1f} s {c.diagnose_seconds:.1f} {c.failure or ''}"
        for c in cases
    ]
    return lines
