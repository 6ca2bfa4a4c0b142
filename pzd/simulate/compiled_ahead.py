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
from typing import TYPE_CHECKING, Literal

from pzd.parallel.processes import own_python

if TYPE_CHECKING:
    from filelock import FileLock

Kernels = Literal["ride", "prediction"]
"""Those of every ride, and those that a predictive control needs besides."""


def mark(folder: Path, kernels: Kernels = "ride") -> Path:
    """Return the file in a folder of kernels that marks those of this copy of pzd as compiled.

    Numba keeps them by path and time of their sources, so that those of another copy of the same text are no use.
    """
    from pzd.compiled import sources

    kept_by = ((os.fspath(path), path.stat().st_mtime_ns) for path in sources())
    return folder / f"{kernels}-compiled-{hashlib.sha256(repr(list(kept_by)).encode()).hexdigest()[:16]}"


def lock(folder: Path, kernels: Kernels = "ride") -> FileLock:
    """Return the lock of a folder, one for all threads of a process: what compiles does not wait for itself."""
    from filelock import FileLock

    return FileLock(folder / f"{kernels}-compiling.lock", thread_local=False, is_singleton=True)


@cache
def in_background(kernels: tuple[Kernels, ...] = ("ride",)) -> None:
    """Start compiling, once at most and unless it was done before; nothing depends on it.

    A thread waits for the process, so that it is reaped; a command that is done earlier does not wait, and
    the process goes on by itself and leaves its kernels for the next.
    """
    from pzd.compiled import cache_folder

    if not all(mark(cache_folder(), each).exists() for each in kernels):
        Thread(target=_compile, args=(kernels,), daemon=True).start()


@cache
def wait(kernels: Kernels = "ride") -> None:
    """Wait for the process that compiles these kernels, if there is one: twice would take as long again."""
    from pzd.compiled import cache_folder

    folder = cache_folder()
    if not mark(folder, kernels).exists():
        with lock(folder, kernels):
            pass


def _compile(kernels: tuple[Kernels, ...]) -> None:
    quiet = subprocess.DEVNULL
    command = own_python(f"from pzd.simulate.precompile import compile_ahead; compile_ahead({kernels!r})")
    subprocess.run(command, stdin=quiet, stdout=quiet, stderr=quiet, check=False)  # noqa: S603  # our own module
