"""Compiles the kernels of the ride by riding: `python -m pzd.simulate.precompile`, see `compiled_ahead`.

A module of its own, since what it imports must not be imported by the commands that start it.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from pzd.artefacts import Diagnosed, ForceRow, Table, TableNotes
from pzd.damper.model import BaseRow, Damper
from pzd.simulate.compiled_ahead import lock, mark
from pzd.simulate.config import SimulateConfig


def _smallest_ride() -> None:
    """Ride half a second on a damper of two voltages, by every fidelity."""
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
    config = SimulateConfig(duration_s=0.5, settle_s=0.1)
    simulate(config, Diagnosed.undiagnosed(damper), table, 1, Path())


def _once(folder: Path) -> None:
    """Compile into the folder, unless it was done or another process is at it."""
    from filelock import Timeout

    with suppress(Timeout), lock(folder).acquire(blocking=False):
        if not mark(folder).exists():
            _smallest_ride()
            mark(folder).touch()


if __name__ == "__main__":
    from pzd.compiled import cache_folder

    _once(cache_folder())
