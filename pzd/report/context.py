"""What the report is made from: the artefacts of the run, and what sections and plots both need of them."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from pathlib import Path

from pzd.artefacts import Diagnosed, Identified, ReferenceRow, Rides, Rig, Table
from pzd.quantities import Control
from pzd.report.blocks import amount
from pzd.report.config import ReportConfig
from pzd.report.damper_models import DamperModels
from pzd.report.reference import compared, file_of, read_reference
from pzd.report.ride_comfort import RatedRides, assess, rated
from pzd.report.rig_tests import RigTests
from pzd.report.run_numbers import RunNumbers
from pzd.simulate.config import SimulateConfig


@dataclass(frozen=True, eq=False)
class ReportContext:
    """The artefacts of a run, and the three views of them: its tests, its dampers, its rated rides."""

    config: ReportConfig
    simulate: SimulateConfig
    rig: Rig
    identified: Identified
    diagnosed: Diagnosed
    table: Table
    rides: Rides
    control: Control
    setting: str | None
    """The setting that diagnose and everything behind it used."""
    tests: RigTests
    damper: DamperModels
    rated: RatedRides
    expected: tuple[ReferenceRow, ...] | None = None
    """The expected numbers beside those of the run; None where the config names none."""

    @classmethod
    def of(
        cls,
        config: ReportConfig,
        simulate: SimulateConfig,
        rig: Rig,
        identified: Identified,
        diagnosed: Diagnosed,
        table: Table,
        rides: Rides,
        control: Control,
        setting: str | None,
        folder: Path,
    ) -> ReportContext:
        """Rate the rides of a run and set its numbers beside those expected; see `pzd.report.stage.report`.

        Raises
        ------
        ConfigError : when there is no such file of expected numbers
        DataError : when it is at fault, with every place
        """
        expected = read_reference(file_of(config.reference, folder), control) if config.reference else None
        ratings = rated(rides)
        comfort = tuple(row for ride in ratings for row in assess(ride, config))
        if ratings:
            logging.getLogger(__name__).info("%d comfort values of %d rides", len(comfort), len(ratings))
        reference = compared(expected, RunNumbers(identified, rides, comfort, simulate, control)) if expected else None
        tests = RigTests(rig, identified, control, setting, config.records_shown)
        dampers = DamperModels(diagnosed, tuple(row for row in identified.rows if row.setting == setting))
        rides_rated = RatedRides(ratings, comfort, simulate, control)
        artefacts = (rig, identified, diagnosed, table, rides)
        return cls(config, simulate, *artefacts, control, setting, tests, dampers, rides_rated, reference)

    @property
    def controlled(self) -> bool:
        """Whether there is a control signal; where none is, the page does not speak of one."""
        return self.tests.controlled or any(row.voltage_V is not None for row in self.table.force)

    @property
    def ridden(self) -> bool:
        """Whether the damper was ridden in a car."""
        return bool(self.rides.summary)

    def voltage(self, value: float | None) -> str:
        """Return a value of the control signal with its unit, a dash where there is none."""
        return amount(value, self.control.unit)
