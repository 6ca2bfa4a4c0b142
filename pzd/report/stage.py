"""The report stage: comfort of every ride, and the page."""

from __future__ import annotations

import logging
from pathlib import Path

from pzd.artefacts import Diagnosed, Identified, Report, Rides, Rig, Table
from pzd.quantities import Control
from pzd.report.config import ReportConfig
from pzd.simulate.config import SimulateConfig


def report(
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
    jobs: int = 1,
) -> Report:
    """Rate every ride by the standards asked for, write one page on the whole run, and compare expected numbers.

    Parameters
    ----------
    config : editions, and what the page shows
    simulate : the ride that was driven
    rig, identified, diagnosed, table, rides : what the stages before made
    control : the control signal of the valve
    setting : of the rig's settings, the one in use
    folder : of the config, from which the path of expected numbers counts
    jobs : pictures drawn at the same time

    Returns
    -------
    the comfort rows, the page, and the numbers beside those expected where the config names any

    Raises
    ------
    ConfigError : when there is no such file of expected numbers
    DataError : when it is at fault, with every place
    """
    from pzd.report.context import ReportContext
    from pzd.report.page import page
    from pzd.report.reference import compared, file_of, read_reference
    from pzd.report.ride_comfort import assess, rated
    from pzd.report.run_numbers import RunNumbers

    expected = read_reference(file_of(config.reference, folder), control) if config.reference else None
    log = logging.getLogger(__name__)
    finished = rated(rides)
    comfort = tuple(row for ride in finished for row in assess(ride, config))
    if finished:
        log.info("%d comfort values of %d rides", len(comfort), len(finished))
    found = compared(expected, RunNumbers(identified, rides, comfort, simulate, control)) if expected else None
    context = ReportContext(
        config=config,
        simulate=simulate,
        rig=rig,
        identified=identified,
        diagnosed=diagnosed,
        table=table,
        rides=rides,
        rated=finished,
        comfort=comfort,
        control=control,
        setting=setting,
        expected=found,
    )
    return Report(comfort=comfort, page=page(context, jobs), reference=found)


def report_without_car(
    config: ReportConfig,
    rig: Rig,
    identified: Identified,
    diagnosed: Diagnosed,
    table: Table,
    control: Control,
    setting: str | None,
    folder: Path,
    jobs: int = 1,
) -> Report:
    """Write one page on the damper alone, where `car: false` leaves the rides out; there is no comfort to rate.

    Parameters
    ----------
    config : what the page shows
    rig, identified, diagnosed, table : what the stages before made
    control : the control signal of the valve
    setting : of the rig's settings, the one in use
    folder : of the config, from which the path of expected numbers counts
    jobs : pictures drawn at the same time

    Returns
    -------
    the page, and the numbers beside those expected where the config names any

    Raises
    ------
    ConfigError : when there is no such file of expected numbers
    DataError : when it is at fault, with every place
    """
    none = Rides()
    return report(config, SimulateConfig(), rig, identified, diagnosed, table, none, control, setting, folder, jobs)
