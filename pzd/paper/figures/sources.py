"""The sources of the figures: the artefacts of a run, tests and parameters found in them, and rides on its dampers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pzd.artefacts import Diagnosed, Identified, MeasureRow, ParameterRow, Rides, Rig, SummaryRow, Table, base_of
from pzd.artefacts.rig import Conditions, matching
from pzd.config import RunConfig, setting_in_use
from pzd.damper.model import Damper
from pzd.force_table.config import TableConfig
from pzd.paper.published import Loop
from pzd.quantities import Control
from pzd.record import Array, Record
from pzd.runs import Run
from pzd.simulate.config import SimulateConfig

# --- The paper's ride on the damper of one setting ---


@dataclass(frozen=True, eq=False)
class SettingRides:
    """The rides on one setting of the valve."""

    setting: str | None
    table: Table
    rides: Rides
    least_damping: float
    """Smallest force over speed that any voltage gives at the speeds that the rig reached [N s/m]."""


def rides_on(
    damper: Damper, setting: str | None, rig: Rig, simulate: SimulateConfig, table: TableConfig, control: Control
) -> SettingRides:
    """Ride the run's car and roads on the baseline damper of one setting of the valve.

    Parameters
    ----------
    damper : identified at this setting
    setting : of the valve
    rig : its records say how fast the damper was tested
    simulate : the rides
    table : how the table is made
    control : the control signal
    """
    from pzd.force_table.stage import force_table
    from pzd.simulate.stage import simulate as ride

    alone = Diagnosed.undiagnosed(damper)
    made = force_table(table, rig, alone, control, setting)
    rides = ride(simulate, alone, made, 1, Path())
    slopes = [
        row.force_N / row.velocity_m_per_s
        for row in made.force
        if row.force_N is not None and row.velocity_m_per_s != 0.0 and row.inside == 1
    ]
    return SettingRides(setting, made, rides, min(slopes))


# --- Tests, conditions and parameters of the run ---


@dataclass(frozen=True, eq=False)
class RigTest:
    """One test of the rig with its measures."""

    record: Record
    measure: MeasureRow

    def cycle(self) -> Loop:
        """Return the average cycle, closed.

        Raises
        ------
        LookupError : when the record does not repeat
        """
        from pzd.signals.cycles import cycles

        record = self.record
        run = cycles(record.time, record.displacement)
        if run is None:
            raise LookupError(f"{record.name} does not repeat")
        x, v, force = (run.mean(record.time, c) for c in (record.displacement, record.velocity, record.force))
        points = np.append(np.arange(x.size), 0)
        return Loop(x[points], v[points], force[points], np.linspace(0.0, run.period, points.size))

    def last(self, count: int) -> slice:
        """Return the samples of the last cycles."""
        period = 1.0 / (self.measure.frequency_Hz or 1.0)
        return slice(int(np.searchsorted(self.record.time, self.record.time[-1] - count * period)), None)

    def loop(self, count: int, force: Array) -> Loop:
        """Return an (n,) force [N] in the motion of the test, over its last cycles."""
        part, record = self.last(count), self.record
        return Loop(record.displacement[part], record.velocity[part], force[part], record.time[part])


@dataclass(frozen=True, eq=False)
class FigureData:
    """A run as far as its parameters, and rides on its baseline damper."""

    rig: Rig
    identified: Identified
    rides_of_setting: SettingRides
    """Table of the baseline damper in the chosen setting, and the ideal rides."""
    simulate: SimulateConfig
    tabulate: TableConfig
    control: Control
    setting: str | None

    @classmethod
    def of(cls, run: Run, config: RunConfig) -> FigureData:
        """Read a run that is up to date as far as its parameters, and ride on the paper's own Bingham model."""
        rig, identified = run.read(Rig), run.read(Identified)
        setting = setting_in_use(config.setting, [entry.setting for entry in rig.entries])
        ideal = config.simulate.model_copy(update={"policies": ("constant", "comfort"), "fidelities": ("ideal",)})
        rides_of_setting = rides_on(base_of(identified.rows, setting), setting, rig, ideal, config.table, run.control)
        return cls(rig, identified, rides_of_setting, config.simulate, config.table, run.control, setting)

    def test(self, conditions: Conditions) -> RigTest:
        """Return the test of some conditions, its sine among them.

        Raises
        ------
        LookupError : when the rig has none
        """
        found = matching(self.identified.measures, conditions)
        if not found:
            raise LookupError(f"the rig has no test at {conditions}")
        return RigTest(next(record for record in self.rig.records if record.name == found[0].record), found[0])

    def row(self, conditions: Conditions) -> ParameterRow:
        """Return the identified parameters of a condition of the damper.

        Raises
        ------
        LookupError : when there are none
        """
        found = matching(self.identified.rows, conditions)
        if not found:
            raise LookupError(f"the rig has no tests at {conditions}")
        return found[0]

    def ride(self, frequency: float, policy: str, fidelity: str) -> SummaryRow:
        """Return the summary of a ride over a sine.

        Raises
        ------
        LookupError : when the run has none
        """
        wanted = f"sine-{frequency:g}Hz-{policy}-{fidelity}"
        for row in self.rides_of_setting.rides.summary:
            if row.case == wanted:
                return row
        raise LookupError(f"the run has no ride {wanted}")
