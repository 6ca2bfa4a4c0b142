"""The report stage: comfort of every ride, and the page."""

from __future__ import annotations

import logging

from pzd.artefacts import Diagnosed, Identified, Report, Rides, Rig, Table
from pzd.quantities import Control
from pzd.report.config import ReportConfig
from pzd.simulate.config import SimulateConfig


def report(
    report: ReportConfig,
    simulate: SimulateConfig,
    rig: Rig,
    identified: Identified,
    diagnosed: Diagnosed,
    table: Table,
    rides: Rides,
    control: Control,
    setting: str | None,
    jobs: int = 1,
) -> Report:
    """Rate every ride by the standards asked for, and tell the whole story on one page.

    Parameters
    ----------
    report : editions, and what the page shows
    simulate : the ride that was driven
    rig, identified, diagnosed, table, rides : what the stages before made
    control : the control signal of the valve
    setting : of the rig's settings, the one in use
    jobs : pictures drawn at the same time

    Returns
    -------
    the comfort rows, the page, and the paper's numbers where the config asks for them
    """
    from pzd.report.context import ReportContext
    from pzd.report.page import page
    from pzd.report.published import published_rows
    from pzd.report.ride_comfort import assess, settled
    from pzd.simulate.roads.sine import Sine

    log = logging.getLogger(__name__)
    fundamentals = {road.name: road.frequency_Hz for road in simulate.roads if isinstance(road, Sine)}
    rows = {row.case: row for row in rides.summary}
    finished = tuple(
        settled(ride, rows[ride.case], simulate.settle_s, fundamentals.get(rows[ride.case].road))
        for ride in rides.rides
    )
    comfort = tuple(row for ride in finished for row in assess(ride, report))
    log.info("%d comfort values of %d rides", len(comfort), len(finished))
    context = ReportContext(
        config=report,
        simulate=simulate,
        rig=rig,
        identified=identified,
        diagnosed=diagnosed,
        table=table,
        rides=rides,
        settled=finished,
        comfort=comfort,
        control=control,
        setting=setting,
    )
    published = published_rows(simulate, identified, rides, comfort) if report.published else None
    return Report(comfort=comfort, page=page(context, jobs), published=published)
