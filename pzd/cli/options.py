"""The options that commands share, each with its help."""

from __future__ import annotations

import os
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

Config = Annotated[
    Path, typer.Argument(metavar="CONFIG", help="The YAML file that describes the run.", show_default=False)
]
Runs = Annotated[Path, typer.Option("--runs", metavar="DIR", help="Folder of the results.")]
Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="a.b=VALUE",
        help="Set a value of the config, items of lists by index; can be given again.",
        show_default=False,
    ),
]
Force = Annotated[bool, typer.Option("--force", help="Run the stage even if it is fresh; with run, every stage.")]
Jobs = Annotated[int, typer.Option("--jobs", metavar="N", min=1, help="Threads or processes that a stage may use.")]
CORES = os.cpu_count() or 1
Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="Print nothing but errors.")]
Verbose = Annotated[bool, typer.Option("-v", "--verbose", help="Print what the stages report, and tracebacks.")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, for other programs.")]

RUNS = Path("runs")


def command_line(name: str, config: Path, runs: Path, overrides: Sequence[str]) -> str:
    """What to type for another command on the same config, with the same results folder and values."""
    options = ["--runs", str(runs)] if runs != RUNS else []
    return shlex.join(["pzd", name, str(config), *options, *(word for one in overrides for word in ("--set", one))])
