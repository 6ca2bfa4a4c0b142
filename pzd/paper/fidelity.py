"""What becomes of the paper's ride when the damper is not ideal: the same car on what each gap can do."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pzd.artefacts import Diagnosed, Rides, Rig
from pzd.damper.model import Damper
from pzd.quantities import Control
from pzd.simulate.config import SimulateConfig
from pzd.table.config import TableConfig


@dataclass(frozen=True, eq=False)
class Gap:
    """The rides on one setting of the valve."""

    setting: str
    rides: Rides
    least_damping: float
    """Smallest force over speed that any voltage gives at the speeds that the rig reached [N s/m]."""


def rides_on(
    damper: Damper,
    setting: str,
    rig: Rig,
    diagnosed: Diagnosed,
    simulate: SimulateConfig,
    table: TableConfig,
    control: Control,
) -> Gap:
    """Control by the table, dynamically, and the damper without voltage, on one setting of the valve.

    Parameters
    ----------
    damper : identified at this setting
    setting : of the valve
    rig : its records say how fast the damper was tested
    diagnosed : of the run, whose damper is exchanged
    simulate : car and roads of the run
    table : how the table is made
    control : the control signal

    Returns
    -------
    rides over the run's roads with the policies `comfort` and `passive`, `table` and `dynamic`
    """
    from pzd.simulate.stage import simulate as ride
    from pzd.table.stage import tabulate

    alone = Diagnosed(diagnosed.diagnosis, damper, damper)
    made = tabulate(table, rig, alone, control, setting)
    config = simulate.model_copy(update={"policies": ("comfort", "passive"), "fidelities": ("table", "dynamic")})
    rides = ride(config, alone, made, 1, Path())
    slopes = [
        row.force_N / row.velocity_m_per_s
        for row in made.force
        if row.force_N is not None and row.velocity_m_per_s != 0.0 and row.inside == 1
    ]
    return Gap(setting, rides, min(slopes))
