"""Compiles the kernels of the ride ahead, in a process of its own: `python -m pzd.simulate.precompile`.

On a new machine this takes as long as all the stages before; a second core does it meanwhile.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING

from pzd.artefacts import Diagnosed, ForceRow, Table, TableNotes
from pzd.damper.model import BaseRow, Damper
from pzd.simulate.config import SimulateConfig

if TYPE_CHECKING:
    from filelock import FileLock

_LOCK = "ride-compiling.lock"


def mark(folder: Path) -> Path:
    """The file in a folder of kernels that says that those of this copy of pzd are compiled.

    Numba keeps them by path and time of their sources, so that those of another copy of the same text are no use.
    """
    from pzd.compiled import sources

    kept_by = ((os.fspath(path), path.stat().st_mtime_ns) for path in sources())
    return folder / f"ride-compiled-{hashlib.sha256(repr(list(kept_by)).encode()).hexdigest()[:16]}"


def _lock(folder: Path) -> FileLock:
    """One for all threads of a process: the ride that compiles does not wait for itself."""
    from filelock import FileLock

    return FileLock(folder / _LOCK, thread_local=False, is_singleton=True)


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
        with _lock(folder):
            pass


def _compile() -> None:
    quiet = subprocess.DEVNULL
    command = [sys.executable, "-m", __name__]
    subprocess.run(command, stdin=quiet, stdout=quiet, stderr=quiet, check=False)  # noqa: S603  # our own module


def _smallest_ride() -> None:
    """Ride half a second on a damper of two voltages, by every fidelity."""
    from pzd.simulate.stage import simulate

    rows = tuple(BaseRow(voltage_V=u, T0_N=300.0 + u, C_Ns_per_m=2700.0, k_N_per_m=2e5) for u in (0.0, 100.0))
    damper = Damper(base=rows)
    forces = tuple(
        ForceRow(temperature_degC=None, voltage_V=r.voltage_V, velocity_m_per_s=v, force_N=_steady(r, v), inside=1)
        for r in rows
        for v in (-1.0, -0.0, 0.0, 1.0)
    )
    table = Table(forces, (), TableNotes(outside="model", reached_m_per_s=1.0, lost=(), not_monotone=()))
    config = SimulateConfig(duration_s=0.5, settle_s=0.1)
    simulate(config, Diagnosed.undiagnosed(damper), table, 1, Path())


def _steady(row: BaseRow, velocity: float) -> float:
    from math import copysign

    return copysign(row.T0_N + row.C_Ns_per_m * abs(velocity), velocity)


def _once(folder: Path) -> None:
    """Compile into the folder, unless it was done or another process is at it."""
    from filelock import Timeout

    with suppress(Timeout), _lock(folder).acquire(blocking=False):
        if not mark(folder).exists():
            _smallest_ride()
            mark(folder).touch()


if __name__ == "__main__":
    import gc

    from pzd.compiled import cache_folder

    gc.disable()  # a short process: to look for garbage in what a compiler makes takes an eighth of its time
    _once(cache_folder())
