"""The commands that write a run for others: its damper for other tools, and the figures of the paper."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from pzd.cli.options import Call, on_config
from pzd.cli.output import exit_code
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


Certify = Annotated[
    bool,
    typer.Option(
        "--certify",
        help="Run what is exported beside pzd on the records of the run, and write the certificate with it: how far "
        "the forces are apart at most, where, and the versions.",
    ),
]

ToDrive = Annotated[
    str | None,
    typer.Option(
        "--waveform",
        metavar="BLOCK",
        help="What drives the stand with --to drive, as under `tests` of a virtual stand: "
        "'{kind: sine, frequency_Hz: 2, amplitude_m: 0.01}'; by default the test that diagnose asks for next.",
        show_default=False,
    ),
]


@on_config("as_json")
def export(call: Call, to: To, out: Out = None, certify: Certify = False, waveform: ToDrive = None) -> int:
    """Write the damper of a run in the form that another tool takes."""
    from pzd.pipeline.exporting import LAST, exported

    (form,) = to
    written = exported(call.opened, form, out, call.command_line(LAST), certify, waveform)
    if call.output.as_json:
        files = [path.as_posix() for path in written.files]
        call.output.say_json({"format": form, "files": files, "not_to_be_trusted": written.marks})
    call.output.say(*(f"export: {path}" for path in written.files))
    return exit_code(written.marks)


@on_config("jobs")
def figures(call: Call) -> int:
    """Draw the figures of the paper, and their index."""
    from pzd.paper.figures.draw import FOLDER, drawn
    from pzd.paper.figures.sources import FigureData

    marks, run = call.execute("identify"), call.opened.run
    figure_set = drawn(FigureData.of(run, call.opened.config), call.output.say)
    with run.locked("pzd figures"):
        run.write_extra(FOLDER, figure_set.write)
    call.output.say(f"figures: {run.folder / FOLDER / 'index.html'}")
    return exit_code(marks)


COMMANDS = (export, figures)
