"""The command that runs the stages again whenever a file of the config has changed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pzd.cli.options import CORES, RUNS, Config, Jobs, Quiet, Runs, Set, Verbose
from pzd.cli.output import Output, complain

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path


def watch(
    config: Config,
    runs: Runs = RUNS,
    overrides: Set = None,
    jobs: Jobs = CORES,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> int:
    """Run what is stale, now and whenever the config or a file that it names changes, until Ctrl-C.

    A file that is still being written is waited for; a mistake in the config or in a record is told, and the next
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
    """Bring the run up to date, or tell what is wrong."""
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


COMMANDS = (watch,)
