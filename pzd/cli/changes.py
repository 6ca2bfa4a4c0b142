"""The command that compares two states of a damper."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pzd.cli.options import Call, on_config
from pzd.cli.output import exit_code
from pzd.schema.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pzd.artefacts.changes import Change, Changes, Unchanged
    from pzd.quantities import Control

Second = Annotated[
    Path | None,
    typer.Argument(metavar="SECOND", help="The config of the second state; none for two settings of one config."),
]
From = Annotated[
    str | None, typer.Option("--from", metavar="SETTING", help="The setting of the first state.", show_default=False)
]
To = Annotated[
    str | None, typer.Option("--to", metavar="SETTING", help="The setting of the second state.", show_default=False)
]

_VERDICTS = {
    "changed": "something of the damper changed",
    "unchanged": "nothing of the damper changed visibly",
    "ambiguous": "several changes fit the difference",
    "unexplained": "a part of the difference has no name",
}


@on_config("jobs", "as_json")
def changes(call: Call, second: Second = None, before: From = None, after: To = None) -> int:
    """Say what changed between two states of a damper: two configs, or two settings of one."""
    from pzd.pipeline.command import opened
    from pzd.pipeline.state_comparison import Named, compare_states, comparison_name, write_changes
    from pzd.report.changes_page import changes_page
    from pzd.schema.validate import plain_data, write_json

    if second is None and (before is None or after is None):
        raise ConfigError(
            "pzd changes: two states are needed: a second config, or two settings by --from and --to (got one config)"
        )
    one = call.opened
    other = one if second is None else opened(second, call.runs, call.overrides)
    found = compare_states(Named(one, before), Named(other, after), call.jobs, call.output.say)
    control = other.run.control
    name = comparison_name(found.changes.from_, found.changes.to)
    with other.run.locked("pzd changes"):
        folder = write_changes(
            other.run,
            name,
            {
                "json": lambda path: write_json(path, found.changes, control),
                "html": lambda path: _write_text(path, changes_page(found, control)),
            },
        )
    if call.output.as_json:
        call.output.say_json(plain_data(found.changes, control))
    call.output.say(*changes_lines(found.changes, control), f"page: {folder / name}.html")
    return exit_code(found.undetermined)


def _write_text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")


def changes_lines(found: Changes, control: Control) -> Iterator[str]:
    """Yield what changed as lines of the terminal."""
    yield f"from {found.from_} to {found.to}: {found.verdict}: {_VERDICTS[found.verdict]}"
    yield f"  {found.reason}"
    for title, rows in (("changed", found.changes), ("unchanged", found.unchanged)):
        if rows:
            yield f"{title}:"
        for row in rows:
            yield from (f"  {line}" for line in _lines(row, control))


def _lines(row: Change | Unchanged, control: Control) -> Iterator[str]:
    from pzd.report.columns import TERMINAL

    name = row.name if row.name == row.parameter else f"{row.name} {row.parameter}"
    share = f", {100.0 * row.share:.3g} % of the difference" if hasattr(row, "share") else ""
    nodes = row.at_voltage_V or (None,)
    for i, node in enumerate(nodes):
        start, to, low, high = (
            values[i] if isinstance(values, tuple) else values for values in (row.from_, row.to, row.low95, row.high95)
        )
        at = "" if node is None else f" at {TERMINAL.amount(node, control.unit)}"
        interval = f" ({TERMINAL.amount(low)} to {TERMINAL.amount(high)})" if low is not None else ""
        yield f"{name}{at}: {TERMINAL.amount(start, row.unit)} -> {TERMINAL.amount(to)}{interval} {row.unit}{share}"


COMMANDS = (changes,)
