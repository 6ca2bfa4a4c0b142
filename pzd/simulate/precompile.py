"""Compiles the kernels of the ride by riding, in a process of its own, see `compiled_ahead`.

A module of its own, since what it imports must not be imported by the commands that start it.
"""

from __future__ import annotations

from contextlib import ExitStack, suppress
from pathlib import Path

from pzd.artefacts import Diagnosed, ForceRow, Table, TableNotes
from pzd.damper.model import BaseRow, Damper
from pzd.simulate.compiled_ahead import Kernels, lock, mark
from pzd.simulate.config import SimulateConfig


def _smallest_ride(kernels: Kernels) -> None:
    """Ride half a second on a damper of two voltages, by every fidelity, or by a predictive control."""
    from pzd.damper.compose import steady_force
    from pzd.simulate.stage import simulate

    rows = tuple(BaseRow(voltage_V=u, T0_N=300.0 + u, C_Ns_per_m=2700.0, k_N_per_m=2e5) for u in (0.0, 100.0))
    damper = Damper(base=rows)
    forces = tuple(
        ForceRow(temperature_degC=None, voltage_V=u, velocity_m_per_s=v, force_N=force, inside=1)
        for u in (0.0, 100.0)
        for v in (-1.0, -0.0, 0.0, 1.0)
        for force in (float(steady_force(damper, u, None, v)),)
    )
    table = Table(forces, (), TableNotes(outside="model", reached_m_per_s=1.0, lost=(), not_monotone=()))
    policies = ("comfort_predictive",) if kernels == "prediction" else None
    config = SimulateConfig(duration_s=0.5, settle_s=0.1, policies=policies)
    simulate(config, Diagnosed.undiagnosed(damper), table, 1, Path())


def _once(folder: Path, kernels: tuple[Kernels, ...] = ("ride",)) -> None:
    """Compile into the folder, unless it was done or another process is at it.

    All locks are taken first, so that a ride waits for what has not begun yet as well, and each is given back as soon
    as its kernels are there: other rides do not wait for those of a predictive control.
    """
    from filelock import Timeout

    with ExitStack() as rest, suppress(Timeout):
        held = [rest.enter_context(lock(folder, each).acquire(blocking=False)) for each in kernels]
        for each, taken in zip(kernels, held, strict=True):
            if not mark(folder, each).exists():
                _smallest_ride(each)
                mark(folder, each).touch()
            taken.release()


def compile_ahead(kernels: tuple[Kernels, ...]) -> None:
    """Compile kernels into the cache of this user."""
    from pzd.compiled import cache_folder

    _once(cache_folder(), kernels)
