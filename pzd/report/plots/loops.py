"""Loops of measured and simulated force over displacement and over velocity, one picture a record."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.quantities import DISPLACEMENT, FORCE, VELOCITY, Quantity
from pzd.record import Array, Record
from pzd.report.context import ReportContext
from pzd.report.drawing import BASELINE, FINAL, MEASURED, Panel, Plot, axes, legend, thinned


def force_velocity(context: ReportContext) -> Iterator[Panel]:
    """Draw force over velocity of each record shown."""
    for record in context.tests.shown:
        yield _loops(context, record, record.velocity, VELOCITY)


def force_displacement(context: ReportContext) -> Iterator[Panel]:
    """Draw force over displacement of each record shown."""
    for record in context.tests.shown:
        yield _loops(context, record, 1000.0 * record.displacement, DISPLACEMENT)


def _loops(context: ReportContext, record: Record, abscissa: Array, quantity: Quantity) -> Panel:
    """Draw cycles from the middle of one record: measured force, the baseline, and the final damper.

    Parameters
    ----------
    context : the run
    record : the record
    abscissa : (n,) what the force is drawn over, displacement in mm
    quantity : of the abscissa
    """
    baseline, final = context.damper.simulated(record)
    part = context.tests.middle(record)
    x, measured, baseline, final = thinned(abscissa[part], record.force[part], baseline[part], final[part])
    figure, ax = axes(f"{quantity.name} [{'mm' if quantity == DISPLACEMENT else quantity.unit}]", "force [kN]")
    ax.plot(x, measured / 1000.0, ".", color=MEASURED, markersize=2.4, label="measured")
    ax.plot(x, baseline / 1000.0, color=BASELINE, linestyle="--", label=context.damper.baseline_name)
    if context.damper.extended:
        ax.plot(x, final / 1000.0, color=FINAL, label="with what was missing")
    legend(figure)
    title, name = f"{FORCE.name} over {quantity.name}", context.tests.conditions(record)
    extended = " and the extended one" if context.damper.extended else ""
    alt = f"{title}, {name}: measured force, the {context.damper.baseline_name}{extended}."
    return Panel(figure, f"{title[0].upper()}{title[1:]}, {name}", alt, f"Record {record.name}.")


PLOTS = (Plot("force_velocity", "model", 0, force_velocity), Plot("force_displacement", "model", 1, force_displacement))
