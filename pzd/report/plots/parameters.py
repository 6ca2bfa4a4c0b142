"""T0, C and k of the final damper over the voltage, with their intervals."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.artefacts import ParameterRow
from pzd.artefacts.csv_rows import Estimate
from pzd.damper.model import BaseRow
from pzd.quantities import DAMPING, FRICTION, STIFFNESS
from pzd.report.blocks import amount, unit_of
from pzd.report.context import ReportContext
from pzd.report.drawing import Panel, Plot, axes, legend, shades


def draw(context: ReportContext) -> Iterator[Panel]:
    """One panel a parameter; nothing where there are fewer than two voltages."""
    if len({row.voltage_V for row in context.final if row.voltage_V is not None}) < 2:
        return
    temperatures = sorted({row.temperature_degC for row in context.final}, key=lambda t: t or 0.0)
    voltages = [row.voltage_V for row in context.final if row.voltage_V is not None]
    for quantity in (FRICTION, DAMPING, STIFFNESS):
        figure, ax = axes(2.6, key=int(len(temperatures) > 1))
        for temperature, colour in zip(temperatures, shades(len(temperatures)), strict=True):
            rows = [row for row in context.final if row.temperature_degC == temperature]
            known = sorted(
                (row.voltage_V, *_bounds(row, quantity.column))
                for row in rows
                if row.voltage_V is not None and getattr(row, quantity.column) is not None
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
        name = quantity.meaning.removesuffix(" of the Bingham element")
        title = f"{quantity.symbol}: {name}"
        yield Panel(
            figure,
            title,
            f"{title}, over the {context.control.name}, with 95 % intervals.",
            "Whiskers: 95 % intervals.",
        )


def _bounds(row: ParameterRow | BaseRow, column: str) -> tuple[float, float, float]:
    """Value and lengths of its whiskers, in thousands."""
    estimate = Estimate.of(row, column)
    value = float(getattr(row, column))
    below = max(value - estimate.low95, 0.0) if estimate.low95 is not None else 0.0
    above = max(estimate.high95 - value, 0.0) if estimate.high95 is not None else 0.0
    return value / 1000.0, below / 1000.0, above / 1000.0


PLOT = Plot("parameters", "damper", 0, draw)
