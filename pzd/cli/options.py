"""Options that several commands share, and what a command on a config is given of them."""

from __future__ import annotations

import inspect
import os
import shlex
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pzd.cli.output import Output

if TYPE_CHECKING:
    from pzd.pipeline.command import Opened

RUNS = Path("runs")


def _jobs(given: str) -> int:
    """Return the value of --jobs.

    Raises
    ------
    BadParameter : when it is no whole number above 0
    """
    if not str(given).isdecimal() or int(given) < 1:
        raise typer.BadParameter(f"must be a whole number, 1 or more (got {given})")
    return int(given)


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
Jobs = Annotated[
    int, typer.Option("--jobs", metavar="N", parser=_jobs, help="Threads or processes that a stage may use.")
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, for other programs.")]
Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="Print nothing but errors.")]
Verbose = Annotated[bool, typer.Option("-v", "--verbose", help="Print what the stages report, and tracebacks.")]

CORES = os.cpu_count() or 1


@dataclass(frozen=True)
class Call:
    """What a command on a config was given."""

    config: Path
    runs: Path
    overrides: tuple[str, ...]
    output: Output
    force: bool = False
    jobs: int = CORES

    @cached_property
    def opened(self) -> Opened:
        """The config and its run, read when first asked for."""
        from pzd.pipeline.command import opened

        return opened(self.config, self.runs, self.overrides)

    def execute(self, target: str, *, force: bool = False) -> tuple[str, ...]:
        """Bring the run up to date as far as a stage, and return why its results are not to be trusted."""
        from pzd.pipeline.command import execute

        output = self.output
        return execute(self.opened, target, force=force, jobs=self.jobs, say=output.say, progress=output.progress)

    def command_line(self, name: str) -> str:
        """Return what to type for another command on the same config, with the same results folder and values."""
        options = ["--runs", str(self.runs)] if self.runs != RUNS else []
        values = (word for one in self.overrides for word in ("--set", one))
        return shlex.join(["pzd", name, str(self.config), *options, *values])


_SHARED: dict[str, tuple[Any, Any]] = {
    "runs": (Runs, RUNS),
    "overrides": (Set, None),
    "force": (Force, False),
    "jobs": (Jobs, CORES),
    "as_json": (Json, False),
    "quiet": (Quiet, False),
    "verbose": (Verbose, False),
}
"""Annotation and default of each shared option, in the order of the help."""
_OF_SOME = {"force", "jobs", "as_json"}
"""Those that a command has only where it asks for them."""


def on_config(*asked: str) -> Callable[[Callable[..., int]], Callable[..., int]]:
    """Make a command of a function that takes a `Call`, and behind it options of its own.

    Parameters
    ----------
    asked : which of `force`, `jobs` and `as_json` the command has
    """

    def decorated(function: Callable[..., int]) -> Callable[..., int]:
        _, *own = inspect.signature(function, eval_str=True).parameters.values()

        @wraps(function)
        def command(*, quiet: bool, verbose: bool, as_json: bool = False, **given: Any) -> int:
            its_own = {option.name: given.pop(option.name) for option in own}
            given["overrides"] = tuple(given["overrides"] or ())
            output = Output(quiet=quiet, verbose=verbose, as_json=as_json)
            return function(Call(output=output, **given), **its_own)

        keyword = inspect.Parameter.KEYWORD_ONLY
        options = [inspect.Parameter("config", keyword, annotation=Config), *(one.replace(kind=keyword) for one in own)]
        for name, (annotation, default) in _SHARED.items():
            if name not in _OF_SOME or name in asked:
                options.append(inspect.Parameter(name, keyword, annotation=annotation, default=default))
        command.__signature__ = inspect.Signature(options)  # type: ignore[attr-defined]  # typer reads the options off it
        return command

    return decorated
