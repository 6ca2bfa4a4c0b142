"""The command that draws the figures of the paper from a run."""

from __future__ import annotations

from pzd.cli.exits import DONE, UNTRUSTED
from pzd.cli.options import RUNS, Config, Jobs, Quiet, Runs, Set, Verbose
from pzd.cli.output import Output, complain


def figures(
    config: Config,
    runs: Runs = RUNS,
    overrides: Set = None,
    jobs: Jobs = 1,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> int:
    """Draw the figures of the paper, and their index."""
    from pzd.paper.figures.draw import FOLDER, drawn
    from pzd.paper.figures.sources import FigureData
    from pzd.pipeline.command import execute, opened

    output = Output(quiet=quiet, verbose=verbose)
    given = opened(config, runs, overrides or ())
    marks = execute(given, "identify", force=False, jobs=jobs, say=output.say, progress=output.progress)
    figure_set = drawn(FigureData.of(given.run, given.config), output.say)
    with given.run.locked("pzd figures"):
        given.run.write_extra(FOLDER, figure_set.write)
    output.say(f"figures: {given.run.folder / FOLDER / 'index.html'}")
    complain(f"not to be trusted: {mark}" for mark in marks)
    return UNTRUSTED if marks else DONE


COMMANDS = (figures,)
