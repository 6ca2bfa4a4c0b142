"""What changed between two states of a damper as lines of text, for the terminal and a notebook."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pzd.artefacts.changes import Change, Changes, Course, Unchanged
    from pzd.quantities import Control

_VERDICTS = {
    "changed": "something of the damper changed",
    "unchanged": "nothing of the damper changed visibly",
    "ambiguous": "several changes fit the difference",
    "unexplained": "a part of the difference has no name",
}


def changes_lines(found: Changes, control: Control) -> Iterator[str]:
    """Yield what changed as lines of the terminal."""
    from pzd.report.diagnosis_text import next_test_line

    yield f"from {found.from_} to {found.to}: {found.verdict}: {_VERDICTS[found.verdict]}"
    yield f"  {found.reason}"
    for title, rows in (("changed", found.changes), ("unchanged", found.unchanged)):
        if rows:
            yield f"{title}:"
        for row in rows:
            yield from (f"  {line}" for line in _lines(row, control))
    if found.next_test:
        yield next_test_line(found.next_test, control.unit)


def _lines(row: Change | Unchanged, control: Control) -> Iterator[str]:
    from pzd.report.columns import TERMINAL

    name = row.name if row.name == row.parameter else f"{row.name} {row.parameter}"
    share = f", {100.0 * row.share:.3g} % of the difference" if hasattr(row, "share") else ""
    nodes = row.at_voltage_V or (None,)
    if share and len(nodes) > 1:
        yield f"{name} at {len(nodes)} control signals together{share}"
    for i, node in enumerate(nodes):
        start, to, low, high = (
            values[i] if isinstance(values, tuple) else values for values in (row.from_, row.to, row.low95, row.high95)
        )
        at = "" if node is None else f" at {TERMINAL.amount(node, control.unit)}"
        interval = f" ({TERMINAL.amount(low)} to {TERMINAL.amount(high)})" if low is not None else ""
        as_it_was = start is not None and low is not None and high is not None and low <= start <= high
        told = (", as it was" if share and as_it_was else "") if len(nodes) > 1 else share
        yield f"{name}{at}: {TERMINAL.amount(start, row.unit)} -> {TERMINAL.amount(to)}{interval} {row.unit}{told}"


def course_lines(found: Course, control: Control) -> Iterator[str]:
    """Yield each quantity over the states as a table of the terminal."""
    from pzd.report import tables

    yield f"from {found.from_} to {found.to}: {found.verdict}; {found.reason}"
    table = tables.course(found, control)
    yield from (f"{table.title}:", *table.lines("  "))
    if found.pass_ is not None:
        yield f"all within the tolerance: {'yes' if found.pass_ else 'no'}"
