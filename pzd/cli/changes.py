"""The command that compares two states of a damper."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pzd.cli.options import Call, on_config
from pzd.cli.output import exit_code
from pzd.schema.errors import ConfigError

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
Over = Annotated[
    str | None,
    typer.Option(
        "--over",
        metavar="SETTING,...",
        help="Follow each quantity over several settings, or over the `cycles` of the tests.",
        show_default=False,
    ),
]


@on_config("jobs", "as_json")
def changes(call: Call, second: Second = None, before: From = None, after: To = None, over: Over = None) -> int:
    """Say what changed between two states of a damper: two configs, or two settings of one."""
    if over is not None:
        if second is not None or before is not None or after is not None:
            raise ConfigError("pzd changes: --over names all states; leave the second config, --from and --to out")
        return _followed(call, over)
    return _compared(call, second, before, after)


def _followed(call: Call, over: str) -> int:
    from pzd.pipeline.state_comparison import FOLDER, comparison_name, follow_states, write_comparison
    from pzd.report.changes_page import course_page
    from pzd.report.changes_text import course_lines
    from pzd.schema.validate import plain_data, write_json

    run = call.opened.run
    found = follow_states(call.opened, over, call.jobs, call.output.say)
    name = comparison_name(found.course.from_, found.course.to)
    with run.locked("pzd changes"):
        folder = write_comparison(
            run,
            FOLDER,
            name,
            {
                "json": lambda path: write_json(path, found.course, run.control),
                "html": lambda path: _write_text(path, course_page(found, run.control)),
            },
        )
    if call.output.as_json:
        call.output.say_json(plain_data(found.course, run.control))
    call.output.say(*course_lines(found.course, run.control), f"page: {folder / name}.html")
    return exit_code(found.undetermined)


def _compared(call: Call, second: Path | None, before: str | None, after: str | None) -> int:
    from pzd.pipeline.command import opened
    from pzd.pipeline.state_comparison import FOLDER, Named, compare_states, comparison_name, write_comparison
    from pzd.report.changes_page import changes_page
    from pzd.report.changes_text import changes_lines
    from pzd.schema.validate import plain_data, write_json

    if second is None and (before is None or after is None):
        got = "--from alone" if before else "--to alone" if after else "one config"
        raise ConfigError(
            f"pzd changes: two states are needed: a second config, or two settings by --from and --to (got {got})"
        )
    one = call.opened
    other = one if second is None else opened(second, call.runs, call.overrides)
    found = compare_states(Named(one, before), Named(other, after), call.jobs, call.output.say)
    control = other.run.control
    name = comparison_name(found.changes.from_, found.changes.to)
    with other.run.locked("pzd changes"):
        folder = write_comparison(
            other.run,
            FOLDER,
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


COMMANDS = (changes,)
