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
SHARES = "what is left without each, the others fitted again"
"""What the shares of the changes are."""
TOO_SMALL = "too small to matter"
"""Of an unchanged quantity whose interval leaves its first value out: the force does not show it visibly."""
_WHOLE = 1.005
"""Sum of the shares from which on the terminal says why they are more than 100 %: below it they round to it."""
PASSES = {True: "yes", False: "no", None: "open, for something of it is not known"}
"""Words for whether all quantities lie within their limits."""


def changes_lines(found: Changes, control: Control) -> Iterator[str]:
    """Yield what changed as lines of the terminal."""
    from pzd.artefacts.changes import had_no_value
    from pzd.report.diagnosis_text import next_test_line

    yield f"from {found.from_} to {found.to}: {found.verdict}: {_VERDICTS[found.verdict]}"
    yield f"  {found.reason}"
    for title, rows in (("changed", found.changes), ("unchanged", found.unchanged)):
        if rows:
            yield f"{title}:"
        for row in rows:
            yield from (f"  {line}" for line in _lines(row, control, newly=had_no_value(row, rows)))
        shares = {change.name: change.share for change in found.changes}  # the numbers of one effect have one share
        if title == "changed" and sum(shares.values()) > _WHOLE:
            yield f"  shares: {SHARES}; so they come to more than 100 % together"
    if found.next_test:
        yield next_test_line(found.next_test, control.unit)


def _in_percent(share: float) -> str:
    """Return a growth in percent: whole ones from ten on."""
    return f"{100.0 * share:+.0f} %" if abs(share) >= 0.1 else f"{100.0 * share:+.2g} %"


def _lines(row: Change | Unchanged, control: Control, *, newly: bool) -> Iterator[str]:
    from pzd.artefacts.changes import growth, holds_what_was, values_at
    from pzd.report.columns import TERMINAL

    name = row.name if row.name == row.parameter else f"{row.name} {row.parameter}"
    share = f", {100.0 * row.share:.3g} % of the difference" if hasattr(row, "share") else ""
    nodes = row.at_voltage_V or (None,)
    if share and len(nodes) > 1:
        yield f"{name} at {len(nodes)} control signals together{share}"
    for i, node in enumerate(nodes):
        start, to, low, high = values_at(row, i)
        start = None if newly else start
        at = "" if node is None else f" at {TERMINAL.amount(node, control.unit)}"
        interval = f" ({TERMINAL.amount(low)} to {TERMINAL.amount(high)})" if low is not None else ""
        if share:
            grown = None if start is None or to is None or row.unit == "degC" else growth(start, to)
            by = "" if grown is None else f", by {_in_percent(grown)}"
            told = by + (share if len(nodes) == 1 else ", as it was" if holds_what_was(row, i) else "")
        else:
            told = f", {TOO_SMALL}" if holds_what_was(row, i) is False else ""
        before = "" if start is None else f"{TERMINAL.amount(start, row.unit)} -> "  # newly there, or not known
        yield f"{name}{at}: {before}{TERMINAL.amount(to)}{interval} {row.unit}{told}"


def course_lines(found: Course, control: Control) -> Iterator[str]:
    """Yield each quantity over the states as a table of the terminal."""
    from pzd.report import tables

    yield f"from {found.from_} to {found.to}: {found.verdict}; {found.reason}"
    table = tables.course(found, control)
    yield from (f"{table.title}:", *table.lines("  "))
    if any(row.limits is not None for row in found.over) or found.pass_ is not None:
        yield f"all within the tolerance: {PASSES[found.pass_]}"
