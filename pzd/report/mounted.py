"""The report stage where the dampers are known without a rig: what is mounted, how it rides, where the body stands."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pzd.artefacts import Diagnosed, Identified, MountedDamper, MountedDampers, Report, Rides, Rig, damper_without_force
from pzd.force_table.lookup import Lookup
from pzd.quantities import Control
from pzd.report.blocks import (
    Block,
    Card,
    Gallery,
    Notes,
    Opening,
    Paragraph,
    Section,
    TextTable,
    amount,
    percent,
    typewritten,
)
from pzd.report.columns import Column, Table
from pzd.report.config import ReportConfig
from pzd.report.context import ReportContext
from pzd.report.drawing import pictures
from pzd.report.page import render
from pzd.report.plots import library
from pzd.report.sections import passenger, trust
from pzd.simulate.config import SimulateConfig
from pzd.simulate.study.plan import assumed

SHOWN_SPEEDS = (0.05, 0.13, 0.26, 0.39, 0.52, 1.04)
"""Speeds at which the force is told [m/s]: those of the usual tests of a damper on a dynamometer."""
_MUCH = 0.01
"""Share of a ride beyond the points of a curve from which on the page says so."""
_PICTURES = ("force", "acceleration", "comfort_scale", "exposure_chart", "trade_off", "best_policy")
"""Of the page's pictures those that need no records."""


def report_mounted(
    config: ReportConfig,
    simulate: SimulateConfig,
    mounted: MountedDampers,
    rides: Rides,
    control: Control,
    folder: Path,
    jobs: int = 1,
) -> Report:
    """Rate every ride by the standards asked for, compare expected numbers, and write one page.

    Parameters
    ----------
    config : editions, and what the page shows
    simulate : the ride that was driven
    mounted, rides : artefacts of the stages before
    control : the control signal
    folder : of the config, from which the path of expected numbers counts
    jobs : pictures drawn at the same time

    Raises
    ------
    ConfigError : when there is no such file of expected numbers
    DataError : when it is at fault, with every place
    """
    first = mounted.axles[0]
    diagnosed = Diagnosed.undiagnosed(first.damper or damper_without_force(first.table))
    artefacts = (Rig((), ()), Identified((), ()), diagnosed, first.table, rides)
    context = ReportContext.of(config, simulate, *artefacts, control, None, folder)
    words = (typewritten(_answer(mounted)),)
    return Report(context.rated.comfort, _page(context, mounted, jobs), reference=context.expected, answer=words)


def _page(context: ReportContext, mounted: MountedDampers, jobs: int) -> str:
    plots = tuple(plot for name, plot in library().items() if name in _PICTURES and name != "force")
    drawn = pictures(plots, context, jobs)
    sections = (
        _mounted(context, mounted, jobs),
        *([passenger.render(context, drawn)] if context.ridden else []),
        *([_positions(context)] if context.ridden and context.rides.rides else []),
        *trust.render_expected(context),
        _limits(context, mounted),
    )
    title = "Dampers and comfort report" if context.ridden else "Damper report"
    about = tuple((name, str(value)) for name, value in context.config.about.items())
    opening = Opening(_answer(mounted), tuple(picture for row in drawn["answer"] for picture in row), about)
    ride = context.simulate.by_tables() if mounted.by_curve else context.simulate
    lines = assumed(ride, mounted.effects, mounted.controlled) if context.ridden else ()
    return render(title, tuple(_cards(context, mounted)), lines, sections, opening=opening)


def _axles(mounted: MountedDampers) -> Iterator[tuple[str, MountedDamper]]:
    """Yield the dampers with the words for their place in the car."""
    for name, axle in mounted.named_axles:
        yield (f"at the {name} axle" if name else "at both axles"), axle


def _answer(mounted: MountedDampers) -> str:
    parts = [f"{axle.notes.source} {where}" for where, axle in _axles(mounted)]
    return f"Dampers known without a rig: {' and '.join(parts)}."


def _cards(context: ReportContext, mounted: MountedDampers) -> Iterator[Card]:
    for where, axle in _axles(mounted):
        speed = min(SHOWN_SPEEDS, key=lambda v: abs(v - axle.table.notes.reached_m_per_s))
        rows = _forces(axle, (speed,))
        forces = [
            f"{amount(row.rebound, 'N')} in rebound, {amount(row.compression, 'N')} in compression" for row in rows
        ]
        shown = " to ".join(dict.fromkeys((forces[0], forces[-1])))
        yield Card(f"What is the damper {where}?", shown, f"At {amount(speed, 'm/s')}, from {axle.notes.source}.")
    for road in context.rated.roads[:1]:
        ride = context.rated.most_realistic(road)[0]
        level = amount(context.rated.a_w(ride), "m/s2")
        yield Card("What does the passenger feel?", f"a_w {level}", f"{road}, {context.rated.label(ride)}.")


# --- What is mounted ---


@dataclass(frozen=True)
class _ForceRow:
    """Force at one speed and value of the control signal."""

    voltage_V: float | None
    speed: float
    rebound: float
    compression: float
    within: bool


def _forces(axle: MountedDamper, speeds: Sequence[float]) -> list[_ForceRow]:
    temperature = axle.table.force[0].temperature_degC
    lookup = Lookup.of(axle.table, temperature)
    known = {(row.voltage_V, row.velocity_m_per_s): row.inside for row in axle.table.force}
    reached = [v for (_, v), inside in known.items() if inside]
    fastest = min(max(reached), -min(reached))
    controlled = axle.table.force[0].voltage_V is not None
    return [
        _ForceRow(
            float(U) if controlled else None,
            speed,
            float(lookup.force(U, np.array(speed))),
            float(-lookup.force(U, np.array(-speed))),
            speed <= fastest,
        )
        for U in lookup.voltages
        for speed in speeds
    ]


def _mounted(context: ReportContext, mounted: MountedDampers, jobs: int) -> Section:
    blocks: list[Block] = [
        Paragraph(
            "Rebound (extension) is positive. Between its points a curve is monotone where they are; beyond the last "
            "one it goes on along the last straight line, which counts as outside of it."
        )
    ]
    for where, axle in _axles(mounted):
        blocks += [
            Paragraph(f"The damper {where}: {axle.notes.source}."),
            Notes(axle.notes.read),
            _force_table(context, where, axle),
        ]
        drawn = pictures((library()["force"],), replace(context, table=axle.table), jobs)
        panels = tuple(
            replace(picture, title=f"Force of the damper {where}", caption="Dotted: beyond the points of the curve.")
            for row in drawn["damper"]
            for picture in row
        )
        blocks.append(Gallery(panels))
    return Section("mounted", "What is mounted", tuple(blocks))


def _force_table(context: ReportContext, where: str, axle: MountedDamper) -> TextTable:
    signal = Column("voltage_V", context.control.name, context.control.unit, lambda row: row.voltage_V, optional=True)
    columns = (
        signal,
        Column("speed", "speed", "m/s"),
        Column("rebound", "rebound", "N"),
        Column("compression", "compression", "N"),
        Column("ratio", "rebound over compression", value=lambda row: row.rebound / row.compression or None),
        Column("within", "known", value=lambda row: "measured" if row.within else "beyond the curve"),
    )
    return Table(f"Force of the damper {where}", columns, _forces(axle, SHOWN_SPEEDS)).block()


# --- Where the body stands while it rides ---


@dataclass(frozen=True)
class _Position:
    """Mean position of the body over the window of a ride."""

    case: str
    height: float
    front: float
    rear: float


def _positions(context: ReportContext) -> Section:
    windows = {row.case: row for row in context.rides.ridden}
    rows = []
    for ride in context.rides.rides:
        time = ride.columns["time_s"]
        within = (time >= windows[ride.case].from_s) & (time <= windows[ride.case].to_s)
        means = [float(np.mean(ride.columns[name][within])) for name in ("z_m", "deflection_1_m", "deflection_2_m")]
        rows.append(_Position(ride.case, *means))
    columns = (
        Column("case", "ride"),
        Column("height", "height of the body", "mm", factor=1000.0),
        Column("front", "extension, axle 1", "mm", factor=1000.0),
        Column("rear", "extension, axle 2", "mm", factor=1000.0),
    )
    words = (
        "Mean position while it rides, counted from where the car stands. A damper that is harder in rebound than in "
        "compression pulls the body down, and one mounted the other way round lifts it: where the sign of a curve was "
        "taken the wrong way, this position is wrong with it, and little else shows it."
    )
    table = Table("Mean position", columns, rows).block()
    return Section("position", "Where the body rides", (Paragraph(words), table))


# --- How far to trust it ---


def _limits(context: ReportContext, mounted: MountedDampers) -> Section:
    return Section("limits", "How far to trust it", (Notes(tuple(_limits_of(context, mounted)), "care"),))


def _limits_of(context: ReportContext, mounted: MountedDampers) -> Iterator[str]:
    if mounted.by_curve:
        yield (
            "a curve knows neither an oil spring nor a valve nor any effect of frequency: its damper answers at once, "
            "and the rides are by the tables (fidelity table) whatever the config asks for"
        )
    yield "nothing was identified or diagnosed: the curve is taken as it stands, without an interval"
    beyond = [row for row in context.rides.summary if row.outside_table > _MUCH]
    if beyond:
        worst = max(beyond, key=lambda row: row.outside_table)
        yield f"{worst.case} is beyond the points of a curve for {percent(worst.outside_table)} of its time"
    for where, axle in _axles(mounted):
        yield from (f"the damper {where}: {mark}" for mark in (*axle.notes.marks, *axle.table.notes.not_monotone))
    if context.ridden:
        yield "vibration is judged in the vertical direction at point K only, without a seat"
