"""What the command line prints: lines or JSON to stdout, complaints to stderr, progress to a terminal."""

from __future__ import annotations

import logging
import os
import re
import shutil
import sys
import tempfile
import traceback
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

# --- Exit codes other than those of errors of the user, which stand with these errors ---

DONE = 0
OWN_FAULT = 1
UNTRUSTED = 4


if TYPE_CHECKING:
    from pzd.parallel.processes import Progress

_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
"""Characters that a terminal obeys instead of showing them, and those that turn the direction of the text behind."""
_BAR = 24
"""Width of the progress bar in characters."""


class Output:
    """Prints as much as the user wants to see: lines, or with `--json` nothing on stdout but one JSON document."""

    def __init__(self, *, verbose: bool, quiet: bool = False, as_json: bool = False) -> None:
        self.as_json, self.silent = as_json, quiet
        self.quiet, self.verbose = quiet or as_json, verbose and not quiet and not as_json
        logger = logging.getLogger("pzd")
        handler = _Handler(self)
        logger.handlers = [handler]
        logger.setLevel(logging.DEBUG if verbose else logging.INFO)
        logging.captureWarnings(capture=True)
        logging.getLogger("py.warnings").handlers = [handler if verbose else logging.NullHandler()]

    def say(self, *lines: str) -> None:
        """Print lines to stdout, unless the user wants none or nobody listens any more."""
        if not self.quiet:
            clear_progress()
            for line in lines:
                _print(line, sys.stdout)

    def say_json(self, data: Any) -> None:
        """Print plain data as JSON to stdout."""
        from pzd.schema.validate import json_text

        if not self.silent:
            _print(harmless(json_text(data), json=True), sys.stdout)

    def progress(self, event: Progress) -> None:
        """Show how far a stage has come: a line each where the user wants to see all, else a bar on a terminal."""
        if self.verbose:
            self.say(f"  {event}")
        elif not self.quiet and sys.stderr.isatty():
            _draw(event)


class _Handler(logging.Handler):
    """Shows what the stages log: warnings as complaints, the rest where asked for."""

    def __init__(self, output: Output) -> None:
        super().__init__()
        self.output = output

    def emit(self, record: logging.LogRecord) -> None:
        """Show one message: a remark in passing on a terminal, where no more is wanted."""
        if record.levelno >= logging.WARNING:
            complain([record.getMessage()])
        elif self.output.verbose:
            self.output.say(f"  {record.getMessage()}")
        elif not self.output.quiet and sys.stderr.isatty():
            _show_in_passing(record.getMessage())


def _draw(event: Progress) -> None:
    filled = _BAR * event.done // max(event.whole, 1)
    _show_in_passing(f"[{'#' * filled}{'.' * (_BAR - filled)}] {event}")


def _show_in_passing(text: str) -> None:
    """Show a text in the last line of the terminal until something else is said."""
    sys.stderr.write(f"\r\x1b[K{harmless(text)[: shutil.get_terminal_size().columns - 1]}")
    sys.stderr.flush()


def clear_progress() -> None:
    """Take the progress bar away."""
    if sys.stderr.isatty():
        sys.stderr.write("\r\x1b[K")
        sys.stderr.flush()


def complain(lines: Iterable[str]) -> None:
    """Print plain lines to stderr."""
    clear_progress()
    for line in lines:
        _print(line, sys.stderr)


def exit_code(marks: Iterable[str]) -> int:
    """Complain of every result that is not to be trusted, and return the exit code of the command."""
    lines = [f"not to be trusted: {mark}" for mark in marks]
    complain(lines)
    return UNTRUSTED if lines else DONE


def harmless(text: str, *, json: bool = False) -> str:
    """Return text with its control characters written out: a header of a rig file may hold those of a terminal.

    Parameters
    ----------
    text : what is to be printed; line ends and tabs stay
    json : whether they are written as JSON does
    """

    def written(found: re.Match[str]) -> str:
        code = ord(found[0])
        return f"\\u{code:04x}" if json or code > 0xFF else f"\\x{code:02x}"

    return _CONTROL.sub(written, text)


def _print(line: str, stream: TextIO) -> None:
    try:
        stream.write(f"{harmless(line)}\n")
        stream.flush()
    except BrokenPipeError:
        silence(stream)


def silence(stream: TextIO) -> None:
    """Send what else is printed to a stream nowhere: whoever read it has gone."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


def own_fault(error: BaseException) -> str:
    """Return one line about an error of ours; write its traceback to a file, and show it with -v."""
    text = "".join(traceback.format_exception(error))
    if logging.getLogger("pzd").isEnabledFor(logging.DEBUG):
        complain(text.splitlines())
    summary = " ".join(f"{type(error).__name__}: {error}".split())
    return f"pzd: this is a fault of pzd, not yours: {summary} ({_filed(text)})"


def _filed(text: str) -> str:
    try:
        handle, name = tempfile.mkstemp(prefix="pzd-traceback-", suffix=".txt")
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
    except OSError as error:
        return f"the traceback could not be written: {error.strerror}; -v shows it"
    return f"traceback in {Path(name)}; -v shows it"
