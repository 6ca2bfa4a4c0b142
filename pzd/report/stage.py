"""The report stage: comfort of every ride, expected numbers, and the page."""

from __future__ import annotations

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
    """Rate every ride by the standards asked for, compare expected numbers, and write one page on the whole run.

    Without rides the page is on the damper alone, and there is no comfort to rate.

    Parameters
    ----------
    config : editions, and what the page shows
    simulate : the ride that was driven
    rig, identified, diagnosed, table, rides : artefacts of the stages before
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
    # imported when the stage runs: `pzd check` needs its signature alone
    from pzd.report.context import ReportContext
    from pzd.report.page import page, told
    from pzd.report.rig_tests import setting_in_use

    used = setting_in_use(identified, setting)
    artefacts = (rig, identified, diagnosed, table, rides)
    context = ReportContext.of(config, simulate, *artefacts, control, used, folder)
    return Report(context.rated.comfort, page(context, jobs), reference=context.expected, answer=told(context))
