"""Compiles the kernels of the ride ahead, in a process of its own: `python -m pzd.simulate.precompile`.

On a new machine this takes as long as all the stages before; a second core does it meanwhile.
"""

from __future__ import annotations

import subprocess
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path
from threading import Thread

from pzd.artefacts import Diagnosed, ForceRow, Table, TableNotes
from pzd.damper.model import BaseRow, Damper
from pzd.simulate.config import SimulateConfig

_MARK = "ride-compiled"
_LOCK = "ride-compiling.lock"


@cache
def in_background() -> None:
    """Start compiling, once at most and unless it was done before; nothing depends on it.

    A thread waits for the process, so that it is reaped; a command that is done earlier does not wait, and
    the process goes on by itself and leaves its kernels for the next.
    """
    from pzd.compiled import cache_folder

    if not (cache_folder() / _MARK).exists():
        Thread(target=_compile, daemon=True).start()


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
    from filelock import FileLock, Timeout

    with suppress(Timeout), FileLock(folder / _LOCK, blocking=False):
        if not (folder / _MARK).exists():
            _smallest_ride()
            (folder / _MARK).touch()


if __name__ == "__main__":
    from pzd.compiled import cache_folder

    _once(cache_folder())
