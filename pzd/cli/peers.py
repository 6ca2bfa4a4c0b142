"""The command that compares the adopted damper with published models."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pzd.cli.output import (
    CORES,
    RUNS,
    Config,
    Jobs,
    Json,
    Output,
    Quiet,
    Runs,
    Set,
    Verbose,
    exit_code,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pzd.artefacts.diagnosis import PeerComparison
    from pzd.quantities import Control


def peers(
    config: Config,
    runs: Runs = RUNS,
    overrides: Set = None,
    jobs: Jobs = CORES,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> int:
    """Set the damper handed on beside published models, on tests and voltages that no fit has seen."""
    from pzd.artefacts import Diagnosed, Identified, Rig
    from pzd.artefacts.diagnosis import PeerComparison
    from pzd.diagnosis.peer_comparison import compare_with_peers
    from pzd.pipeline.command import execute, opened
    from pzd.pipeline.dependencies import setting_of
    from pzd.schema.validate import plain_data

    output = Output(quiet=quiet, verbose=verbose)
    given = opened(config, runs, overrides or ())
    run, stages = given.run, Output(quiet=quiet or as_json, verbose=verbose)
    marks = execute(given, "diagnose", force=False, jobs=jobs, say=stages.say, progress=stages.progress)
    with given.placed(), run.locked("pzd peers"):
        found = compare_with_peers(
            run.read(Rig, jobs), run.read(Identified), run.read(Diagnosed), setting_of(given.config, run)
        )
        run.write_extra(PeerComparison.folder, lambda folder: found.write(folder, run.control))
    if as_json:
        output.say_json(plain_data({**vars(found), "not_to_be_trusted": marks}, run.control))
    else:
        output.say(*comparison_lines(found, run.control))
        output.say(f"tables: {run.folder / PeerComparison.folder}")
    return exit_code(marks)


def comparison_lines(found: PeerComparison, control: Control) -> Iterator[str]:
    """Yield the tables: every held-out test, these by control signal and in all, held-out voltages, and parameters.

    Parameters
    ----------
    found : the comparison
    control : the control signal, for its name and unit
    """
    from pzd.report import tables

    *compared, parameters = tables.peers(found, control)
    for table in compared:
        yield from (f"{table.title}:", *table.lines("  "), "")
    yield from (f"{parameters.title}:", *parameters.lines("  "))
    if found.moving:
        yield f"not compared, for the control signal moves: {', '.join(found.moving)}"


COMMANDS = (peers,)
