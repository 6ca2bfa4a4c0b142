"""What each policy makes of a road: comfort against the load of the wheels."""

from __future__ import annotations

from collections.abc import Sequence

from pzd.artefacts import SummaryRow
from pzd.report.context import REALISTIC, ReportContext
from pzd.simulate.policies import policies

_FEWEST = 2
"""With fewer policies that control there is nothing to choose between; `Comparison` says what the one is worth."""


def of_road(context: ReportContext, road: str) -> tuple[SummaryRow, ...]:
    """The rides of all policies over a road, the most comfortable first.

    At the fidelity nearest to a real car at which two policies or more control; nothing where there is none.
    """
    for fidelity in REALISTIC:
        rows = [row for row in context.cases(road) if row.fidelity == fidelity]
        if sum(policies()[row.policy].controlled for row in rows) >= _FEWEST:
            return tuple(sorted(rows, key=context.a_w))
    return ()


def unbeaten(context: ReportContext, rows: Sequence[SummaryRow]) -> tuple[SummaryRow, ...]:
    """The rides than which none is more comfortable with less wheel load, in the order given."""

    def beats(one: SummaryRow, other: SummaryRow) -> bool:
        return context.a_w(one) < context.a_w(other) and one.rms_wheel_load_N < other.rms_wheel_load_N

    return tuple(row for row in rows if not any(beats(other, row) for other in rows))


def name_of(policy: str) -> str:
    """A policy as it is called on the page."""
    return policy.replace("_", " ")
