"""The commands of many runs: a sweep over values and draws, and the blind benchmark of the diagnosis."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Annotated

import typer

from pzd.cli.options import Call, on_config
from pzd.cli.output import DONE, exit_code

if TYPE_CHECKING:
    from pathlib import Path

    from pzd.blind.config import BlindConfig
    from pzd.blind.hide import BenchmarkSetup
    from pzd.config import RunConfig
    from pzd.sweep.campaign import SweepRuns

# --- pzd sweep ---

Status = Annotated[bool, typer.Option("--status", help="Print how far it is, and run nothing.")]


@on_config("force", "jobs")
def sweep(call: Call, status: Status = False) -> int:
    """Run every combination of values and every random draw of the block `sweep`, and say what decides.

    What is finished stays: a sweep that was stopped goes on where it was.
    """
    from pzd.schema.errors import ConfigError
    from pzd.sweep.campaign import SweepRuns
    from pzd.sweep.task import BaseRun

    given, output = call.opened, call.output
    if given.config.damper is not None:
        raise ConfigError("damper: pzd sweep needs a rig in its place; run the config by itself")
    campaign = SweepRuns.of(BaseRun(call.config, call.runs, call.overrides), output.progress)
    if status:
        output.say(*_status(campaign))
        return DONE
    with given.placed():
        shared = campaign.last_shared_stage()
    marks = call.execute(shared) if shared else ()
    with given.run.locked("pzd sweep"), given.placed():
        if shared in ("diagnose", "table"):
            campaign.check()
        found = campaign.run(call.jobs, afresh=call.force)
        output.say(*campaign.gather(found, call.config.stem))
    failed = sum(outcome.failure is not None for outcome in found)
    return exit_code([*marks, *([f"{failed} of {len(found)} runs came to no result"] if failed else [])])


def _status(campaign: SweepRuns) -> list[str]:
    found = campaign.finished()
    failed = [outcome for outcome in found if outcome.failure is not None]
    lines = [f"{len(found)} of {len(campaign.tasks)} runs done, {len(failed)} of them without a result"]
    each = campaign.seconds_a_chunk()
    left = len(campaign.tasks) - len(found)
    if left and found and each is not None:
        lines.append(f"about {each * left / campaign.sweep.chunk / 60.0:.1f} minutes left at the pace so far")
    return lines


# --- pzd blind ---

FOLDER = "blind"
"""Where the benchmark lies beside the stages of the run."""


@on_config("force", "jobs")
def blind(call: Call) -> int:
    """Hide effects in virtual rigs, diagnose them, score the verdicts."""
    from pzd.blind.benchmark import Benchmark, Methods, folder_of
    from pzd.blind.summary import write
    from pzd.parallel.engines import Where
    from pzd.runs.disk import refuse_links_below

    given, base = call.opened, call.config.parent
    setup, whole = _setup(given.config), given.config
    places = folder_of(given.run.folder / FOLDER, setup.blind)
    methods = Methods(whole.identify, whole.diagnose, whole.measured_rig.limits, setup.control, whole.seed)
    with given.run.locked("pzd blind"):
        refuse_links_below(places.folder)
        made_from = _made_from(whole)
        with given.placed():
            _entered(setup.blind, made_from, base)
        where = Where(setup.blind, FOLDER, base, places.folder / "slurm")
        benchmark = Benchmark(setup, methods, places, made_from, where, call.output.progress)
        cases = benchmark.run(call.jobs, afresh=call.force)
        lines = write(cases, places.folder, setup.control, setup.blind)
    call.output.say(*lines, f"tables and picture: {places.folder}")
    return exit_code(f"case {name} could not be drawn: {why}" for name, why in benchmark.undrawn.items())


def _setup(config: RunConfig) -> BenchmarkSetup:
    """Return the stand, damper and settings that every case starts from.

    Raises
    ------
    ConfigError : when the config has no `blind` block, or not one virtual stand
    """
    from pzd.blind.hide import BenchmarkSetup
    from pzd.schema.errors import ConfigError

    if config.blind is None:
        raise ConfigError("blind: the config has no such block; configs/blind.yaml is an example")
    if config.measured_rig.virtual is None or len(config.measured_rig.virtual) != 1:
        raise ConfigError("rig.virtual: pzd blind needs one virtual stand, whose damper the cases start from")
    return BenchmarkSetup(
        config.blind, config.measured_rig.virtual[0], config.diagnose.nuisance, config.control.signal()
    )


def _entered(blind: BlindConfig, made_from: str, folder: Path) -> None:
    """Enter a scored run into the ledger, where the config names one."""
    from datetime import UTC, datetime

    from pzd.blind.benchmark import ScoredSeed, enter

    if blind.ledger is None or blind.tuning:
        return
    day = datetime.now(UTC).date().isoformat()
    run = ScoredSeed(seed=blind.seed, generator=blind.generator, made_from=made_from, cases=blind.cases, date=day)
    enter(folder / blind.ledger, run)


def _made_from(config: RunConfig) -> str:
    """Return a hash of the config's blocks and of the code that a case depends on."""
    from pzd.parallel.config import HOW
    from pzd.pipeline.dependencies import code_hash

    of_the_run = {"blind": {"cases", "keep_files", "ledger", "tuned_on", "tuning", *HOW}}
    blocks = config.model_dump_json(
        include={"seed", "control", "rig", "identify", "diagnose", "blind"}, exclude=of_the_run
    )
    return hashlib.sha256(f"{blocks}{code_hash('pzd.blind.benchmark')}".encode()).hexdigest()[:16]


COMMANDS = (sweep, blind)
