"""The command that hides effects in virtual rigs and scores what the diagnosis names."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

from pzd.cli.exits import DONE, UNTRUSTED
from pzd.cli.options import CORES, RUNS, Config, Force, Jobs, Quiet, Runs, Set, Verbose
from pzd.cli.output import Output, complain

if TYPE_CHECKING:
    from pathlib import Path

    from pzd.blind.config import BlindConfig
    from pzd.blind.hide import BenchmarkSetup
    from pzd.config import RunConfig

FOLDER = "blind"
"""Where the benchmark lies beside the stages of the run."""


def blind(
    config: Config,
    runs: Runs = RUNS,
    overrides: Set = None,
    force: Force = False,
    jobs: Jobs = CORES,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> int:
    """Hide effects in virtual rigs, diagnose them, score the verdicts."""
    from pzd.blind.benchmark import Benchmark, folder_of
    from pzd.blind.diagnosis import Methods
    from pzd.blind.summary import write
    from pzd.parallel.pools import Where
    from pzd.pipeline.command import opened

    output = Output(quiet=quiet, verbose=verbose)
    given = opened(config, runs, overrides or ())
    setup, whole = _setup(given.config), given.config
    places = folder_of(given.run.folder / FOLDER, setup.blind)
    methods = Methods(whole.identify, whole.diagnose, whole.rig.limits, setup.control, whole.seed)
    with given.run.locked("pzd blind"):
        made_from = _made_from(whole)
        with given.placed():
            _entered(setup.blind, made_from, config.parent)
        where = Where(setup.blind, FOLDER, config.parent, places.folder / "slurm")
        benchmark = Benchmark(setup, methods, places, made_from, where, output.progress)
        cases = benchmark.run(jobs, afresh=force)
        tuning, generator = setup.blind.tuning, setup.blind.generator
        by_campaign = setup.blind.by_campaign
        lines = write(cases, places.folder, setup.control, tuning=tuning, generator=generator, by_campaign=by_campaign)
    output.say(*lines, f"tables and picture: {places.folder}")
    complain(f"not to be trusted: case {name} could not be drawn: {why}" for name, why in benchmark.undrawn.items())
    return UNTRUSTED if benchmark.undrawn else DONE


def _setup(config: RunConfig) -> BenchmarkSetup:
    """What every case starts from.

    Raises
    ------
    ConfigError : when the config has no `blind` block, or not one virtual stand
    """
    from pzd.blind.hide import BenchmarkSetup
    from pzd.schema.errors import ConfigError

    if config.blind is None:
        raise ConfigError("blind: the config has no such block; configs/blind.yaml is an example")
    if config.rig.virtual is None or len(config.rig.virtual) != 1:
        raise ConfigError("rig.virtual: pzd blind needs one virtual stand, whose damper the cases start from")
    return BenchmarkSetup(config.blind, config.rig.virtual[0], config.diagnose.nuisance, config.control.signal())


def _entered(blind: BlindConfig, made_from: str, folder: Path) -> None:
    """Enter a scored run into the ledger, where the config names one."""
    from datetime import UTC, datetime

    from pzd.blind.ledger import ScoredSeed, enter

    if blind.ledger is None or blind.tuning:
        return
    day = datetime.now(UTC).date().isoformat()
    run = ScoredSeed(seed=blind.seed, generator=blind.generator, made_from=made_from, cases=blind.cases, date=day)
    enter(folder / blind.ledger, run)


def _made_from(config: RunConfig) -> str:
    """Hash of the config's blocks and of the code that a case depends on."""
    from pzd.parallel.config import HOW
    from pzd.pipeline.sources import code_hash

    of_the_run = {"blind": {"cases", "keep_files", "ledger", "tuned_on", "tuning", *HOW}}
    blocks = config.model_dump_json(
        include={"seed", "control", "rig", "identify", "diagnose", "blind"}, exclude=of_the_run
    )
    return hashlib.sha256(f"{blocks}{code_hash('pzd.blind.benchmark')}".encode()).hexdigest()[:16]


COMMANDS = (blind,)
