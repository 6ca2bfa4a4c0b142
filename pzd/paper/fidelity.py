"""What becomes of the paper's ride when the damper is not ideal: the same car on what each gap can do."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pzd.artefacts import Diagnosed, Rides, Rig, Table
from pzd.damper.model import Damper
from pzd.quantities import Control
from pzd.simulate.config import SimulateConfig
from pzd.table.config import TableConfig


@dataclass(frozen=True, eq=False)
class SettingRides:
    """The rides on one setting of the valve."""

    setting: str | None
    table: Table
    rides: Rides
    least_damping: float
    """Smallest force over speed that any voltage gives at the speeds that the rig reached [N s/m]."""


def rides_on(
    damper: Damper,
    setting: str | None,
    rig: Rig,
    simulate: SimulateConfig,
    table: TableConfig,
    control: Control,
) -> SettingRides:
    """The run's car and roads on the plain damper of one setting of the valve.

    Parameters
    ----------
    damper : identified at this setting
    setting : of the valve
    rig : its records say how fast the damper was tested
    simulate : what is ridden
    table : how the table is made
    control : the control signal

    Returns
    -------
    the table and the rides
    """
    from pzd.simulate.stage import simulate as ride
    from pzd.table.stage import force_table

    alone = Diagnosed.undiagnosed(damper)
    made = force_table(table, rig, alone, control, setting)
    rides = ride(simulate, alone, made, 1, Path())
    slopes = [
        row.force_N / row.velocity_m_per_s
        for row in made.force
        if row.force_N is not None and row.velocity_m_per_s != 0.0 and row.inside == 1
    ]
    return SettingRides(setting, made, rides, min(slopes))
