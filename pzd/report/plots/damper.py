"""The final damper: its parameters over the voltage, and its force over velocity from the table."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pzd.artefacts import ParameterRow
from pzd.artefacts.csv_rows import Estimate
from pzd.damper.model import BaseRow
from pzd.quantities import DAMPING, FRICTION, STIFFNESS
from pzd.report.blocks import amount, number, unit_of
from pzd.report.context import ReportContext
from pzd.report.drawing import Panel, Plot, axes, legend, legend_lines, shades


def parameters(context: ReportContext) -> Iterator[Panel]:
    """Draw T0, C and k over the voltage, one panel each; nothing where there are fewer than two voltages."""
    final = context.damper.final_parameters
    voltages = [row.voltage_V for row in final if row.voltage_V is not None]
    if len(set(voltages)) < 2:
        return
    temperatures = sorted({row.temperature_degC for row in final}, key=lambda t: t or 0.0)
    for quantity in (FRICTION, DAMPING, STIFFNESS):
        figure, ax = axes(2.6, key=int(len(temperatures) > 1))
        for temperature, colour in zip(temperatures, shades(len(temperatures)), strict=True):
            known = sorted(
                (row.voltage_V, *_with_whiskers(row, quantity.column))
                for row in final
                if row.temperature_degC == temperature
                and row.voltage_V is not None
                and getattr(row, quantity.column) is not None
            )
            if known:
                x, y, below, above = zip(*known, strict=True)
                label = amount(temperature, "degC") if temperature is not None else None
                ax.errorbar(x, y, yerr=(below, above), fmt="o-", color=colour, capsize=3.0, markersize=4.0, label=label)
        ax.set_xlabel(f"{context.control.name} [{context.control.unit}]")
        ax.set_ylabel(f"{quantity.symbol} [k{unit_of(quantity.unit)}]")
        margin = 0.05 * (max(voltages) - min(voltages))
        ax.set_xlim(min(voltages) - margin, max(voltages) + margin)
        ax.margins(y=0.15)
        if len(temperatures) > 1:
            legend(figure, 4)
        title = f"{quantity.symbol}: {quantity.meaning.removesuffix(' of the Bingham element')}"
        alt = f"{title}, over the {context.control.name}, with 95 % intervals."
        yield Panel(figure, title, alt, "Whiskers: 95 % intervals.")


def _with_whiskers(row: ParameterRow | BaseRow, column: str) -> tuple[float, float, float]:
    """Return a value and the lengths of its whiskers, in thousands; whiskers of length 0 without an interval."""
    estimate = Estimate.of(row, column)
    value = float(getattr(row, column))
    below = max(value - estimate.low95, 0.0) if estimate.low95 is not None else 0.0
    above = max(estimate.high95 - value, 0.0) if estimate.high95 is not None else 0.0
    return value / 1000.0, below / 1000.0, above / 1000.0


def force(context: ReportContext) -> Iterator[Panel]:
    """Draw force over velocity for every voltage: solid within what the rig reached, dotted beyond."""
    temperatures = sorted({row.temperature_degC for row in context.table.force}, key=lambda t: t or 0.0)
    if not temperatures:
        return
    rows = [row for row in context.table.force if row.temperature_degC == temperatures[0] and row.force_N is not None]
    voltages = sorted({row.voltage_V for row in rows}, key=lambda v: v or 0.0)
    figure, ax = axes(key=legend_lines(len(voltages)) if context.controlled else 0)
    for voltage, colour in zip(voltages, shades(len(voltages)), strict=True):
        points = np.array([(r.velocity_m_per_s, r.force_N, r.inside) for r in rows if r.voltage_V == voltage])
        points[:, 1] += context.damper.static_force(voltage)
        inside = np.where(points[:, 2] > 0, points[:, 1], np.nan) / 1000.0
        ax.plot(points[:, 0], points[:, 1] / 1000.0, color=colour, linewidth=1.0, linestyle=":")
        ax.plot(points[:, 0], inside, color=colour, label=None if voltage is None else context.voltage(voltage))
    ax.locator_params(axis="x", nbins=6)
    ax.set_xlabel("velocity [m/s]")
    ax.set_ylabel("force [kN]")
    if context.controlled:
        legend(figure, 4)
    at = f" at {amount(temperatures[0], 'degC')}" if temperatures[0] is not None else ""
    each = f" for {len(voltages)} values of the {context.control.name}" if context.controlled else ""
    alt = f"Force of the damper over velocity{each}{at}."
    caption = f"Dotted: beyond the {number(context.table.notes.reached_m_per_s)} m/s that the rig reached."
    if static := context.damper.static_force_in_words(voltages):
        caption = f"With the {static} at rest that the table (4-table) leaves out. {caption}"
    yield Panel(figure, f"Force of the damper{at}", alt, caption)


PLOTS = (Plot("parameters", "damper", 0, parameters), Plot("force", "damper", 1, force))
