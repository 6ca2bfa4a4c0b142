"""The gap between measured and simulated force, record by record and by voltage and velocity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pzd.identification.prepared_record import warm_up
from pzd.quantities import DISPLACEMENT, Quantity
from pzd.record import Array, Record, is_constant, voltage_scale
from pzd.report.context import ReportContext
from pzd.report.drawing import BASELINE, FINAL, MEASURED, Panel, axes, legend, thinned
from pzd.signals.measures import criterion

# ----------------------------------------------------------------------------------------------------


_BINS = 14
"""Classes of velocity in the map."""
_FEWEST = 5
"""A cell with fewer samples stays empty."""
_ROWS = 12
"""The map shows no more rows than this."""

_MOST_VOLTAGES = 3
"""Voltages that are shown, from the lowest to the highest."""


@dataclass(frozen=True, eq=False)
class GapMap:
    """R.m.s. gap by row (voltage, or motion where the voltage says nothing) and velocity."""

    rows: tuple[str, ...]
    edges: Array
    """(n + 1,) edges of the velocity classes [m/s]"""
    before: Array
    """(rows, n) simple model, % of the peak force; NaN where there are too few samples"""
    after: Array
    """(rows, n) final damper"""


def of_record(context: ReportContext, record: Record) -> tuple[float, float]:
    """W_s of a record before and after diagnose, without the samples that depend on how it began."""
    part = begun(record)
    measured = record.force[part]
    before, after = (criterion(measured - force[part], measured) for force in context.simulated(record))
    return before, after


def begun(record: Record) -> slice:
    """The samples of a record that do not depend on how it began."""
    return slice(warm_up(record.displacement), None)


def at_some_voltages(context: ReportContext) -> dict[str, list[Record]]:
    """Records by voltage, those of the lowest, the highest and one between; all together where there is none."""
    scale = voltage_scale(context.sampled)
    still = [r for r in context.sampled if is_constant(r, scale)] or list(context.sampled)
    levels = sorted({context.level(r) or 0.0 for r in still})
    places = np.linspace(0, len(levels) - 1, min(_MOST_VOLTAGES, len(levels)))
    chosen = [levels[round(place)] for place in places]
    return {
        context.voltage(level) if context.controlled else "": [r for r in still if (context.level(r) or 0.0) == level]
        for level in chosen
    }


def gap_map(context: ReportContext) -> GapMap:
    """Where in voltage and velocity the gap lies, over the records of the setting."""
    top = max(float(np.abs(record.velocity).max()) for record in context.sampled)
    peak = max(float(np.abs(record.force).max()) for record in context.sampled)
    edges = np.linspace(-top, top, _BINS + 1)
    groups = _groups(context)
    before, after = np.full((2, len(groups), _BINS), np.nan)
    for i, records in enumerate(groups.values()):
        cells = np.clip(np.digitize(np.concatenate([r.velocity[begun(r)] for r in records]), edges) - 1, 0, _BINS - 1)
        count = np.bincount(cells, minlength=_BINS)
        for grid, which in ((before, 0), (after, 1)):
            gap = np.concatenate([(r.force - context.simulated(r)[which])[begun(r)] for r in records])
            square = np.bincount(cells, weights=gap**2, minlength=_BINS)
            with np.errstate(invalid="ignore", divide="ignore"):
                grid[i] = np.where(count >= _FEWEST, 100.0 / peak * np.sqrt(square / count), np.nan)
    return GapMap(tuple(groups), edges, before, after)


def _groups(context: ReportContext) -> dict[str, list[Record]]:
    """Records by voltage; by motion where all share one; those whose voltage moves stand together."""
    scale = voltage_scale(context.sampled)
    moving = [r for r in context.sampled if not is_constant(r, scale)]
    still = sorted((r for r in context.sampled if is_constant(r, scale)), key=lambda r: context.level(r) or 0.0)
    found: dict[str, list[Record]] = {}
    for record in still:
        found.setdefault(context.voltage(context.level(record)), []).append(record)
    if len(found) < 2:
        found = {}
        for record in still[:_ROWS]:
            found.setdefault(context.motion(record), []).append(record)
    if moving:
        found[f"moving {context.control.name}"] = moving
    return found


# ----------------------------------------------------------------------------------------------------
# Loops of force, measured and simulated, over whatever stands below them.


def loops(context: ReportContext, record: Record, abscissa: Array, quantity: Quantity, title: str) -> Panel:
    """Cycles from the middle of one record: measured force, the simple model, and the final damper.

    Parameters
    ----------
    context : the run
    record : the record
    abscissa : (n,) what the force is drawn over, displacement in mm
    quantity : what that is
    title : what the picture shows

    Returns
    -------
    the panel
    """
    before, after = context.simulated(record)
    part = context.middle(record)
    x, measured, plain, final = thinned(abscissa[part], record.force[part], before[part], after[part])
    figure, ax = axes()
    ax.plot(x, measured / 1000.0, ".", color=MEASURED, markersize=2.4, label="measured")
    ax.plot(x, plain / 1000.0, color=BASELINE, linestyle="--", label=context.model)
    if context.extended:
        ax.plot(x, final / 1000.0, color=FINAL, label="with what was missing")
    unit = "mm" if quantity == DISPLACEMENT else quantity.unit
    ax.set_xlabel(f"{quantity.name} [{unit}]")
    ax.set_ylabel("force [kN]")
    legend(figure)
    name = context.conditions(record)
    curves = f"measured force, the {context.model}" + (" and the extended one" if context.extended else "")
    return Panel(
        figure, f"{title[0].upper()}{title[1:]}, {name}", f"{title}, {name}: {curves}.", f"Record {record.name}."
    )
