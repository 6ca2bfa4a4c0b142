"""What becomes of the paper's ride when the damper is not ideal: the same car on what each gap can do."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pzd.artefacts import Diagnosed, Diagnosis, Gap, Rides, Rig, Table
from pzd.damper.model import Damper
from pzd.quantities import Control
from pzd.simulate.config import SimulateConfig
from pzd.table.config import TableConfig


@dataclass(frozen=True, eq=False)
class Outing:
    """The rides on one setting of the valve."""

    setting: str | None
    table: Table
    rides: Rides
    least_damping: float
    """Smallest force over speed that any voltage gives at the speeds that the rig reached [N s/m]."""


def undiagnosed(damper: Damper) -> Diagnosed:
    """A damper as it was identified, in the form in which the stages behind diagnose take it."""
    gap = Gap(before=0.0, after=0.0, noise_floor=0.0, standard_error=0.0, held_out=(), hold_out="records")
    nothing = Diagnosis(
        verdict="none",
        reason="not diagnosed: the paper's figures are about its own model",
        effects=(),
        confidence=None,
        gap=gap,
        parameters={},
        ranking=(),
        rivals=(),
        where=(),
        next_test=None,
    )
    return Diagnosed(nothing, damper, damper)


def rides_on(
    damper: Damper,
    setting: str | None,
    rig: Rig,
    simulate: SimulateConfig,
    table: TableConfig,
    control: Control,
) -> Outing:
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
    from pzd.table.stage import tabulate

    alone = undiagnosed(damper)
    made = tabulate(table, rig, alone, control, setting)
    rides = ride(simulate, alone, made, 1, Path())
    slopes = [
        row.force_N / row.velocity_m_per_s
        for row in made.force
        if row.force_N is not None and row.velocity_m_per_s != 0.0 and row.inside == 1
    ]
    return Outing(setting, made, rides, min(slopes))
