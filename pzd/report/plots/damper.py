"""The damper in curves: as measured without any model, its parameters over the voltage, and its force over velocity."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from typing import TypeVar

import numpy as np

from pzd.artefacts.csv_rows import Estimate
from pzd.artefacts.identified import ContinuousVelocityRow, ParameterRow, PeakVelocityRow
from pzd.damper.model import BaseRow
from pzd.quantities import BINGHAM
from pzd.report.blocks import amount, number, unit_of
from pzd.report.context import ReportContext
from pzd.report.drawing import AXIS, Panel, Plot, axes, legend, legend_lines, shades

# --- As measured: peak-velocity plot (PVP) and continuous-velocity plot (CVP) ---

_MARKERS = {"sine": "o", "constant velocity": "s", "other swing": "D"}
_MARKERS_IN_WORDS = {
    "sine": "circles: sines",
    "constant velocity": "squares: constant velocity",
    "other swing": "diamonds: other",
}

Row = TypeVar("Row", PeakVelocityRow, ContinuousVelocityRow)


def peak_velocity(context: ReportContext) -> Iterator[Panel]:
    """Draw force at the peak speed of every test, rebound above and compression below; lines join a condition."""
    rows = context.tests.characteristics.peak_velocity
    if not rows:
        return
    groups = _by_label(context, rows)
    labelled = any(groups)
    figure, ax = axes("peak speed [m/s]", "force [kN]", key=legend_lines(len(groups)) if labelled else 0)
    for (label, mine), colour in zip(groups.items(), shades(len(groups)), strict=True):
        ax.plot([], [], color=colour, label=label or None)
        ordered = sorted(mine, key=lambda row: (str(row.condition), row.speed))
        for _, tests_of_condition in groupby(ordered, key=lambda row: row.condition):
            tests = list(tests_of_condition)
            for points in (_points(tests, "rebound"), _points(tests, "compression")):
                ax.plot([v for v, _, _ in points], [f for _, f, _ in points], color=colour, linewidth=1.0)
                for v, f, kind in points:
                    ax.plot(v, f, _MARKERS[kind], color=colour, markersize=4.0)
    ax.axhline(0.0, color=AXIS, linewidth=0.8)
    ax.set_xlim(left=0.0)
    if labelled:
        legend(figure, 4)
    by = f", one colour each for {', '.join(groups)}" if labelled else ""
    marks = "; ".join(text for kind, text in _MARKERS_IN_WORDS.items() if any(row.kind == kind for row in rows))
    yield Panel(
        figure,
        "Peak-velocity plot (PVP)",
        f"Force over peak speed of {len(rows)} tests, rebound above zero and compression below{by}.",
        f"Rebound (extension) above, compression below; {marks}.",
    )


def _points(tests: Sequence[PeakVelocityRow], direction: str) -> list[tuple[float, float, str]]:
    """Return speed [m/s], force [kN] and kind of the tests that have this direction."""
    cells = [(getattr(r, f"{direction}_velocity_m_per_s"), getattr(r, f"{direction}_force_N"), r.kind) for r in tests]
    return [(abs(v), force / 1000.0, kind) for v, force, kind in cells if v is not None and force is not None]


def continuous_velocity(context: ReportContext) -> Iterator[Panel]:
    """Draw force over velocity through one settled cycle: the fastest test of each voltage, or of each setting."""
    groups = _by_label(context, context.tests.characteristics.continuous_velocity)
    if not groups:
        return
    labelled = any(groups)
    figure, ax = axes("velocity [m/s]", "force [kN]", key=legend_lines(len(groups)) if labelled else 0)
    cycles = [_fastest_test(rows) for rows in groups.values()]
    for label, cycle, colour in zip(groups, cycles, shades(len(groups)), strict=True):
        closed = [*cycle, cycle[0]]
        speeds, forces = [r.velocity_m_per_s for r in closed], [r.force_N / 1000.0 for r in closed]
        ax.plot(speeds, forces, color=colour, linewidth=1.2, label=label or None)
    ax.locator_params(axis="x", nbins=6)
    if labelled:
        legend(figure, 4)
    tests = sorted({f"{amount(r[0].frequency_Hz, 'Hz')}, {number(1000.0 * r[0].amplitude_m)} mm" for r in cycles})
    each = f"one test each for {', '.join(groups)}" if labelled else f"test {cycles[0][0].record}"
    listed = f" ({tests[0]})" if len(tests) == 1 else ""
    yield Panel(
        figure,
        "Continuous-velocity plot (CVP)",
        f"Loops of force over velocity through one average settled cycle, {each}.",
        f"The fastest test of each{listed}; rebound to the right." if labelled else f"Its fastest test{listed}.",
    )


def _fastest_test(rows: Sequence[ContinuousVelocityRow]) -> list[ContinuousVelocityRow]:
    """Return the cycle of the test with the largest speed, in its order."""
    top = max(rows, key=lambda row: abs(row.velocity_m_per_s))
    same = (top.condition, top.record, top.frequency_Hz, top.amplitude_m)
    return [row for row in rows if (row.condition, row.record, row.frequency_Hz, row.amplitude_m) == same]


def _by_label(context: ReportContext, rows: Sequence[Row]) -> Mapping[str, list[Row]]:
    """Group rows by the label of their colour: control value, lowest first, else setting; "" where neither differs."""
    controlled = any(row.voltage_V is not None for row in rows)
    found: dict[str, list[Row]] = {}
    for row in sorted(rows, key=lambda row: (row.voltage_V or 0.0, row.setting or "")):
        label = context.voltage(context.tests.nearest_level(row.voltage_V)) if controlled else row.setting or ""
        found.setdefault(label, []).append(row)
    return found


# --- The final damper ---


def parameters(context: ReportContext) -> Iterator[Panel]:
    """Draw T0, C and k over the voltage, one panel each; nothing where there are fewer than two voltages."""
    final = context.damper.final_parameters
    voltages = [row.voltage_V for row in final if row.voltage_V is not None]
    if len(set(voltages)) < 2:
        return
    temperatures = sorted({row.temperature_degC for row in final}, key=lambda t: t or 0.0)
    for quantity in BINGHAM:
        labels = f"{context.control.name} [{context.control.unit}]", f"{quantity.symbol} [k{unit_of(quantity.unit)}]"
        figure, ax = axes(*labels, height=2.6, key=int(len(temperatures) > 1))
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
    figure, ax = axes("velocity [m/s]", "force [kN]", key=legend_lines(len(voltages)) if context.controlled else 0)
    for voltage, colour in zip(voltages, shades(len(voltages)), strict=True):
        points = np.array([(r.velocity_m_per_s, r.force_N, r.inside) for r in rows if r.voltage_V == voltage])
        points[:, 1] += context.damper.static_force(voltage)
        inside = np.where(points[:, 2] > 0, points[:, 1], np.nan) / 1000.0
        ax.plot(points[:, 0], points[:, 1] / 1000.0, color=colour, linewidth=1.0, linestyle=":")
        ax.plot(points[:, 0], inside, color=colour, label=None if voltage is None else context.voltage(voltage))
    ax.locator_params(axis="x", nbins=6)
    if context.controlled:
        legend(figure, 4)
    at = f" at {amount(temperatures[0], 'degC')}" if temperatures[0] is not None else ""
    each = f" for {len(voltages)} values of the {context.control.name}" if context.controlled else ""
    alt = f"Force of the damper over velocity{each}{at}."
    caption = f"Dotted: beyond the {number(context.table.notes.reached_m_per_s)} m/s that the rig reached."
    if static := context.damper.static_force_in_words(voltages):
        caption = f"With the {static} at rest that the table (4-table) leaves out. {caption}"
    yield Panel(figure, f"Force of the damper{at}", alt, caption)


PLOTS = (
    Plot("peak_velocity", "characteristics", 0, peak_velocity),
    Plot("continuous_velocity", "characteristics", 1, continuous_velocity),
    Plot("parameters", "damper", 0, parameters),
    Plot("force", "damper", 1, force),
)
