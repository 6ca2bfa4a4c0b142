"""The commands that run stages: all of them, or as far as one."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from pzd.cli.exits import DONE, UNTRUSTED
from pzd.cli.options import CORES, RUNS, Config, Force, Jobs, Quiet, Runs, Set, Verbose
from pzd.cli.output import Output, complain

if TYPE_CHECKING:
    from pzd.runs import Run

_COMMANDS = {
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
    from pzd.cli.diagnosis import diagnosis_lines
    from pzd.pipeline.run_summary import run_summary

    found = run_summary(run)
    if found.diagnosis is None:
        return []
    return diagnosis_lines(found.diagnosis, run.control, every_test=verbose, hypotheses=found.hypotheses)


_AT_THE_END: dict[str, Callable[..., list[str]]] = {"run": _page, "report": _page, "diagnose": _diagnosis}
"""What a command says once its stages are up to date."""


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
        complain(f"not to be trusted: {mark}" for mark in marks)
        return UNTRUSTED if marks else DONE

    command.__name__, command.__doc__ = name, summary
    return command


COMMANDS = tuple(_command(name, summary) for name, summary in _COMMANDS.items())
