"""The commands that run stages: all of them, as far as one, or again whenever a file of the config changes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from pzd.cli.look import diagnosis_lines
from pzd.cli.output import (
    CORES,
    RUNS,
    Config,
    Force,
    Jobs,
    Output,
    Quiet,
    Runs,
    Set,
    Verbose,
    complain,
    exit_code,
)

if TYPE_CHECKING:
    from pathlib import Path

    from pzd.runs import Run

_SUMMARIES = {
    "run": "Run every stage, from rig records to the comfort report.",
    "synthesise": "Record the tests of the virtual rig of the config.",
    "ingest": "Read the rig files of the config, and check them.",
    "identify": "Find the Bingham parameters of every condition.",
    "diagnose": "Find what the model misses, and print the verdict.",
    "table": "Tabulate force over voltage and speed.",
    "simulate": "Compute the rides of the half-car on the damper.",
    "report": "Rate the rides by comfort, and write the page.",
}


def _page(run: Run, **_: bool) -> list[str]:
    from pzd.pipeline.run_summary import page_of

    return [f"report: {page_of(run)}"]


def _diagnosis(run: Run, *, verbose: bool) -> list[str]:
    from pzd.pipeline.run_summary import run_summary

    found = run_summary(run)
    if found.diagnosis is None:
        return []
    return diagnosis_lines(found.diagnosis, run.control, every_test=verbose, hypotheses=found.hypotheses)


_AT_THE_END: dict[str, Callable[..., list[str]]] = {"run": _page, "report": _page, "diagnose": _diagnosis}
"""What a command prints once its stages are up to date."""


def _command(name: str, summary: str) -> Callable[..., int]:
    def command(
        config: Config,
        runs: Runs = RUNS,
        overrides: Set = None,
        force: Force = False,
        jobs: Jobs = CORES,
        quiet: Quiet = False,
        verbose: Verbose = False,
    ) -> int:
        from pzd.pipeline.command import execute, opened

        output = Output(quiet=quiet, verbose=verbose)
        given = opened(config, runs, overrides or ())
        marks = execute(given, name, force=force, jobs=jobs, say=output.say, progress=output.progress)
        if name in _AT_THE_END:
            output.say(*_AT_THE_END[name](given.run, verbose=verbose))
        return exit_code(marks)

    command.__name__, command.__doc__ = name, summary
    return command


def watch(
    config: Config,
    runs: Runs = RUNS,
    overrides: Set = None,
    jobs: Jobs = CORES,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> int:
    """Run what is stale, now and whenever the config or a file that it names changes, until Ctrl-C.

    A file that is still being written is waited for; a mistake in the config or in a record is printed, and the next
    change awaited.
    """
    import time

    from pzd.pipeline.command import check_given
    from pzd.pipeline.watching import EVERY_S, WatchedFiles, looks

    output = Output(quiet=quiet, verbose=verbose)
    check_given(config)
    output.say(f"watching {config} and the files that it names; Ctrl-C ends it")
    for look in looks(WatchedFiles(config, overrides or ()).state, lambda: time.sleep(EVERY_S)):
        output.say(*look.lines)
        if look.settled:
            _run(config, runs, overrides or (), jobs, output)
    raise AssertionError("a watch has no end of its own")


def _run(config: Path, runs: Path, overrides: Sequence[str], jobs: int, output: Output) -> None:
    """Bring the run up to date, or print what is wrong."""
    from pzd.pipeline.command import execute, opened
    from pzd.pipeline.run_summary import page_of
    from pzd.schema.errors import UserError

    try:
        given = opened(config, runs, overrides)
        marks = execute(given, "run", force=False, jobs=jobs, say=output.say, progress=output.progress)
    except UserError as error:
        complain(error.messages)
        return
    output.say(f"report: {page_of(given.run)}")
    complain(f"not to be trusted: {mark}" for mark in marks)


COMMANDS = (*(_command(name, summary) for name, summary in _SUMMARIES.items()), watch)
