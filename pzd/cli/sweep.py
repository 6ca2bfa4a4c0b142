"""The command that runs a config many times."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from pzd.cli.exits import DONE, UNTRUSTED
from pzd.cli.options import CORES, RUNS, Config, Force, Jobs, Quiet, Runs, Set, Verbose
from pzd.cli.output import Output, complain

if TYPE_CHECKING:
    from pzd.sweep.campaign import SweepRuns

Status = Annotated[bool, typer.Option("--status", help="Print how far it is, and run nothing.")]


def sweep(
    config: Config,
    status: Status = False,
    runs: Runs = RUNS,
    overrides: Set = None,
    force: Force = False,
    jobs: Jobs = CORES,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> int:
    """Run every combination of values and every random draw of the block `sweep`, and say what decides.

    What is finished stays: a sweep that was stopped goes on where it was.
    """
    from pzd.pipeline.command import execute, opened
    from pzd.sweep.campaign import SweepRuns
    from pzd.sweep.task import BaseRun

    output = Output(quiet=quiet, verbose=verbose)
    given = opened(config, runs, overrides or ())
    campaign = SweepRuns.of(BaseRun(config, runs, tuple(overrides or ())), output.progress)
    if status:
        output.say(*_status(campaign))
        return DONE
    with given.placed():
        shared = campaign.last_shared_stage()
    marks = execute(given, shared, force=False, jobs=jobs, say=output.say, progress=output.progress) if shared else ()
    with given.run.locked("pzd sweep"), given.placed():
        if shared in ("diagnose", "table"):
            campaign.check()
        found = campaign.run(jobs, afresh=force)
        output.say(*campaign.gather(found, config.stem))
    failed = sum(outcome.failure is not None for outcome in found)
    complain(f"not to be trusted: {mark}" for mark in marks)
    complain([f"not to be trusted: {failed} of {len(found)} runs came to no result"] if failed else [])
    return UNTRUSTED if marks or failed else DONE


def _status(campaign: SweepRuns) -> list[str]:
    found = campaign.finished()
    failed = [outcome for outcome in found if outcome.failure is not None]
    lines = [f"{len(found)} of {len(campaign.tasks)} runs done, {len(failed)} of them without a result"]
    each = campaign.seconds_a_chunk()
    left = len(campaign.tasks) - len(found)
    if left and found and each is not None:
        lines.append(f"about {each * left / campaign.sweep.chunk / 60.0:.1f} minutes left at the pace so far")
    return lines


COMMANDS = (sweep,)
