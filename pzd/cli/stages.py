"""The commands that run stages: all of them, as far as one, or again whenever a file of the config changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from pzd.cli.options import Call, on_config
from pzd.cli.output import complain, exit_code
from pzd.report.diagnosis_text import diagnosis_lines

if TYPE_CHECKING:
    from pzd.runs import Run

InBrowser = Annotated[bool, typer.Option("--open", help="Open the page in the browser.")]

_SUMMARIES = {
    "run": "Run every stage, from rig records to the comfort report.",
    "synthesise": "Record the tests of the virtual rig of the config.",
    "ingest": "Read the rig files of the config, and check them.",
    "identify": "Find the Bingham parameters of every condition.",
    "diagnose": "Find what the model misses, and print the verdict.",
    "table": "Tabulate force over voltage and speed.",
    "simulate": "Compute the rides of the half-car on the damper.",
}


def _page(run: Run, **_: bool) -> list[str]:
    from pzd.pipeline.run_summary import answer_of, page_of

    return [*answer_of(run), f"report: {page_of(run)}"]


def _diagnosis(run: Run, *, verbose: bool) -> list[str]:
    from pzd.pipeline.run_summary import run_summary

    found = run_summary(run)
    if found.diagnosis is None:
        return []
    return diagnosis_lines(found.diagnosis, run.control, every_test=verbose, hypotheses=found.hypotheses)


_AT_THE_END: dict[str, Callable[..., list[str]]] = {"run": _page, "diagnose": _diagnosis}
"""What a command prints once its stages are up to date."""


def _command(name: str, summary: str) -> Callable[..., int]:
    def command(call: Call) -> int:
        marks = call.execute(name, force=call.force)
        if name in _AT_THE_END:
            call.output.say(*_AT_THE_END[name](call.opened.run, verbose=call.output.verbose))
        return exit_code(marks)

    command.__name__, command.__doc__ = name, summary
    return on_config("force", "jobs")(command)


@on_config("jobs")
def watch(call: Call) -> int:
    """Run what is stale, now and whenever the config or a file that it names changes, until Ctrl-C.

    A file that is still being written is waited for; a mistake in the config or in a record is printed, and the next
    change awaited.
    """
    import time

    from pzd.pipeline.command import check_given
    from pzd.pipeline.watching import EVERY_S, WatchedFiles, looks

    check_given(call.config)
    call.output.say(f"watching {call.config} and the files that it names; Ctrl-C ends it")
    for look in looks(WatchedFiles(call.config, call.overrides).state, lambda: time.sleep(EVERY_S)):
        call.output.say(*look.lines)
        if look.settled:
            _run(replace(call))  # a copy reads the config anew
    raise AssertionError("a watch has no end of its own")


def _run(call: Call) -> None:
    """Bring the run up to date, or print what is wrong."""
    from pzd.schema.errors import UserError

    try:
        marks = call.execute("run")
    except UserError as error:
        complain(error.messages)
        return
    call.output.say(*_page(call.opened.run))
    exit_code(marks)


@on_config("force", "jobs")
def report(call: Call, in_browser: InBrowser = False) -> int:
    """Rate the rides by comfort, and write the page."""
    marks = call.execute("report", force=call.force)
    call.output.say(*_page(call.opened.run))
    if in_browser:
        import webbrowser

        from pzd.pipeline.run_summary import page_of
        from pzd.schema.errors import FilesError

        page = page_of(call.opened.run)
        if not webbrowser.open(page.resolve().as_uri()):
            raise FilesError(f"{page}: no browser was found to open it; open the file by hand")
    return exit_code(marks)


COMMANDS = (*(_command(name, summary) for name, summary in _SUMMARIES.items()), report, watch)
