"""The commands put together, and how each way of ending becomes an exit code."""

from __future__ import annotations

import difflib
import os
import re
import sys
from collections.abc import Callable, Sequence
from typing import Annotated, NoReturn

import typer

from pzd.cli import campaigns, changes, export, look, peers, rate, stages, start
from pzd.cli.interrupt import (
    INTERRUPTED,
    end_at_once_when_interrupted,
    end_soon_after_interrupt,
    raise_when_interrupted,
    say_interrupted,
)
from pzd.cli.output import DONE, OWN_FAULT, complain, own_fault, silence
from pzd.schema.errors import ConfigError, FilesError, UserError

_USAGE_ERROR: type[Exception] = next(kind for kind in typer.BadParameter.__mro__ if kind.__name__ == "ClickException")
"""Base class of typer's errors of usage: that of click, or typer's copy of it."""

app = typer.Typer(
    name="pzd",
    help="Turn the records of a damper test rig into a model of the damper and a comfort report.",
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    add_completion=True,
    no_args_is_help=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
_MODULES = (stages, peers, changes, look, rate, export, campaigns, start)
_COMMANDS: tuple[Callable[..., int], ...] = tuple(command for module in _MODULES for command in module.COMMANDS)
for _command in _COMMANDS:
    app.command()(_command)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"pzd {version('pzd')}")
        raise typer.Exit


Version = Annotated[
    bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
]


@app.callback(invoke_without_command=True)
def _bare(context: typer.Context, version: Version = False) -> None:
    """Turn the records of a damper test rig into a model of the damper and a comfort report."""
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


def main() -> NoReturn:
    """Run the command line and exit by the codes of the contract."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    end_soon_after_interrupt()
    try:
        raise_when_interrupted()
        code = status(sys.argv[1:])
        end_at_once_when_interrupted()
    except KeyboardInterrupt:  # right before or behind the command, or a second one
        say_interrupted()
        code = INTERRUPTED
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        silence(sys.stdout)
    if code == INTERRUPTED:
        os._exit(code)  # Python would end by the signal where it struck inside of `exec`, as dataclasses are made
    sys.exit(code)


def status(arguments: Sequence[str]) -> int:
    """Run one command.

    Parameters
    ----------
    arguments : what stands behind ``pzd``

    Returns
    -------
    0 done, 1 our own fault, 2 config or usage, 3 data, 4 not to be trusted, 5 files, 130 interrupted
    """
    try:
        code: int = app(list(arguments), prog_name="pzd", standalone_mode=False) or DONE
    except (KeyboardInterrupt, typer.Abort):
        code = INTERRUPTED
    except BrokenPipeError:
        silence(sys.stdout)
        return DONE
    except Exception as error:  # noqa: BLE001  # every ending has its exit code
        return _failed(error, arguments)
    if code == INTERRUPTED:  # typer may make an exit of its own of it
        say_interrupted()
    return code


def _failed(error: Exception, arguments: Sequence[str]) -> int:
    if isinstance(error, UserError):
        complain(error.messages)
        return error.exit_code
    if isinstance(error, _USAGE_ERROR):
        complain([_usage(error, arguments)])
        return ConfigError.exit_code
    if isinstance(error, OSError) and error.errno is not None:
        complain([f"{error.filename or 'system'}: {error.strerror}"])
        return FilesError.exit_code
    complain([own_fault(error)])
    return OWN_FAULT


def _usage(error: Exception, arguments: Sequence[str]) -> str:
    """Return one line about wrong usage, with the nearest command."""
    names = [one.__name__ for one in _COMMANDS]
    given = next((word for word in arguments if word in names), None)
    context = getattr(error, "ctx", None)
    command = context.command_path if context else f"pzd {given}" if given else "pzd"
    message = " ".join(str(getattr(error, "format_message", error.__str__)()).split())
    unknown = re.search(r"No such command '([^']*)'", message)
    if unknown:
        near = difflib.get_close_matches(unknown[1], names, 1)
        hint = f"; did you mean {near[0]}?" if near else ""
        message = f"no such command{hint} (got {unknown[1]})"
    misplaced = re.fullmatch(r"No such option: (-\S+).*", message)
    if misplaced and command == "pzd" and given:
        message = f"options of a command stand behind it: pzd {given} ... {misplaced[1]}"
        command = f"pzd {given}"
    return f"{command}: {message.rstrip('.')}; see {command} --help"
