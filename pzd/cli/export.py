"""The commands that write a run for others: its damper for other tools, and the figures of the paper."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from pzd.cli.output import (
    RUNS,
    Config,
    Jobs,
    Json,
    Output,
    Quiet,
    Runs,
    Set,
    Verbose,
    command_line,
    exit_code,
)
from pzd.export.formats import formats


def _once(given: Sequence[str]) -> list[str]:
    """Return the value of --to.

    Raises
    ------
    BadParameter : when there are several
    """
    if len(given) > 1:
        raise typer.BadParameter(f"takes one format, and so one command each (got {', '.join(given)})")
    return list(given)


To = Annotated[
    list[str],  # a list, for of a single value given twice the last would be taken in silence
    typer.Option(
        "--to",
        metavar="FORMAT",
        callback=_once,
        help="; ".join(f"{name}: {one.meaning}" for name, one in formats().items()) + ".",
        show_default=False,
    ),
]
Out = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR", help="Folder of the files; by default `export` in the folder of the run."),
]


def export(
    config: Config,
    to: To,
    out: Out = None,
    runs: Runs = RUNS,
    overrides: Set = None,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> int:
    """Write the damper of a run in the form that another tool takes."""
    from pzd.pipeline.command import opened
    from pzd.pipeline.exporting import LAST, exported

    output = Output(quiet=quiet, verbose=verbose)
    remedy = command_line(LAST, config, runs, overrides or ())
    (form,) = to
    written = exported(opened(config, runs, overrides or ()), form, out, remedy)
    if as_json:
        files = [path.as_posix() for path in written.files]
        output.say_json({"format": form, "files": files, "not_to_be_trusted": written.marks})
    else:
        output.say(*(f"export: {path}" for path in written.files))
    return exit_code(written.marks)


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
    return exit_code(marks)


COMMANDS = (export, figures)
