"""Force over velocity for every voltage of the table."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pzd.report.blocks import amount, number
from pzd.report.context import ReportContext, static_force_at, static_force_in_words
from pzd.report.drawing import Panel, Plot, axes, legend, shades


def draw(context: ReportContext) -> Iterator[Panel]:
    """Solid within what the rig reached, dashed where the model goes on by itself."""
    temperatures = sorted({row.temperature_degC for row in context.table.force}, key=lambda t: t or 0.0)
    if not temperatures:
        return
    rows = [row for row in context.table.force if row.temperature_degC == temperatures[0] and row.force_N is not None]
    voltages = sorted({row.voltage_V for row in rows}, key=lambda v: v or 0.0)
    figure, ax = axes(key=(len(voltages) + 3) // 4 if context.controlled else 0)
    for voltage, colour in zip(voltages, shades(len(voltages)), strict=True):
        points = np.array([(r.velocity_m_per_s, r.force_N, r.inside) for r in rows if r.voltage_V == voltage])
        points[:, 1] += static_force_at(context, voltage)
        inside = np.where(points[:, 2] > 0, points[:, 1], np.nan) / 1000.0
        ax.plot(points[:, 0], points[:, 1] / 1000.0, color=colour, linewidth=1.0, linestyle=":")
        ax.plot(points[:, 0], inside, color=colour, label=None if voltage is None else context.voltage(voltage))
    ax.locator_params(axis="x", nbins=6)
    ax.set_xlabel("velocity [m/s]")
    ax.set_ylabel("force [kN]")
    if context.controlled:
        legend(figure, 4)
    at = f" at {amount(temperatures[0], 'degC')}" if temperatures[0] is not None else ""
    reached = context.table.notes.reached_m_per_s
    each = f" for {len(voltages)} values of the {context.control.name}" if context.controlled else ""
    alt = f"Force of the damper over velocity{each}{at}."
    said = f"Dotted: beyond the {number(reached)} m/s that the rig reached."
    if rest := static_force_in_words(context, voltages):
        said = f"With the {rest} at rest that the table (4-table) leaves out. {said}"
    yield Panel(figure, f"Force of the damper{at}", alt, said)


PLOT = Plot("characteristic", "damper", 1, draw)
