"""Starts a process that compiles the kernels of the ride, `pzd.simulate.precompile`, while the stages before run.

On a new machine this takes as long as all the stages before; a second core does it meanwhile. The two are modules of
their own because of what they import: this one is imported by every command that rides, and imports neither numba nor
the ride; the other one imports both and is run in the new process alone.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
from functools import cache
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING

from pzd.parallel.processes import own_python

if TYPE_CHECKING:
    from filelock import FileLock

LOCK = "ride-compiling.lock"


def mark(folder: Path) -> Path:
    """Return the file in a folder of kernels that marks those of this copy of pzd as compiled.

    Numba keeps them by path and time of their sources, so that those of another copy of the same text are no use.
    """
    from pzd.compiled import sources

    kept_by = ((os.fspath(path), path.stat().st_mtime_ns) for path in sources())
    return folder / f"ride-compiled-{hashlib.sha256(repr(list(kept_by)).encode()).hexdigest()[:16]}"


def lock(folder: Path) -> FileLock:
    """Return the lock of a folder, one for all threads of a process: what compiles does not wait for itself."""
    from filelock import FileLock

    return FileLock(folder / LOCK, thread_local=False, is_singleton=True)


@cache
def in_background() -> None:
    """Start compiling, once at most and unless it was done before; nothing depends on it.

    A thread waits for the process, so that it is reaped; a command that is done earlier does not wait, and
    the process goes on by itself and leaves its kernels for the next.
    """
    from pzd.compiled import cache_folder

    if not mark(cache_folder()).exists():
        Thread(target=_compile, daemon=True).start()


@cache
def wait() -> None:
    """Wait for the process that compiles the kernels of the ride, if there is one: twice would take as long again."""
    from pzd.compiled import cache_folder

    folder = cache_folder()
    if not mark(folder).exists():
        with lock(folder):
            pass


def _compile() -> None:
    quiet = subprocess.DEVNULL
    command = own_python("from runpy import run_module; run_module('pzd.simulate.precompile', run_name='__main__')")
    subprocess.run(command, stdin=quiet, stdout=quiet, stderr=quiet, check=False)  # noqa: S603  # our own module
