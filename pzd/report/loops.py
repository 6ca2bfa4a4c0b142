"""Loops of force, measured and simulated, over whatever stands below them."""

from __future__ import annotations

from pzd.quantities import DISPLACEMENT, Quantity
from pzd.record import Array, Record
from pzd.report.context import ReportContext
from pzd.report.drawing import BASELINE, FINAL, MEASURED, Panel, axes, legend, thinned


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
