"""T0, C and k of every test fitted alone, over what the tests differ in: there a stand or an oil shows at a glance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pzd.artefacts import ParameterRow
from pzd.identification.condition import identify_condition
from pzd.identification.config import IdentifyConfig
from pzd.quantities import DAMPING, FRICTION, STIFFNESS
from pzd.record import Condition, Record, is_constant, voltage_scale
from pzd.report.blocks import unit_of
from pzd.report.context import ReportContext
from pzd.report.drawing import Panel, Plot, shades

_FEWEST = 4
"""Fewer tests that differ show nothing at a glance."""
_MOST = 60
"""Most tests that are fitted: each takes some hundredths of a second."""
_SAME = 0.02
"""Tests that differ by a smaller share do not differ."""
_SEED = 1
"""Of the evolutionary search, where the fit falls back on it."""


@dataclass(frozen=True)
class LoneTest:
    """One test fitted alone, and what it differs in from others."""

    voltage: float | None
    row: ParameterRow
    over: Mapping[str, float | None]
    """By the label of the axis."""


def draw(context: ReportContext) -> Iterator[Panel]:
    """A picture for each of frequency, amplitude, temperature and order; under the verdict `unexplained` alone."""
    if context.diagnosed.diagnosis.verdict != "unexplained":
        return
    tests = fitted_alone(context)
    for label in tests[0].over if tests else ():
        known = [test for test in tests if test.over[label] is not None]
        values = [test.over[label] or 0.0 for test in known]
        if len(known) >= _FEWEST and max(values) - min(values) > _SAME * max(map(abs, values)):
            yield _panel(context, label, known, values)


def fitted_alone(context: ReportContext) -> list[LoneTest]:
    """Every test at a constant voltage, at most so many of them, fitted alone."""
    scale = voltage_scale(context.records)
    still = [(n, r) for n, r in enumerate(context.records) if is_constant(r, scale)]
    chosen = still[:: -(-len(still) // _MOST) or 1]
    measures = {m.record: m for m in context.identified.measures}
    found = []
    for number, record in chosen:
        measured = measures.get(record.name)
        over = {
            "frequency [Hz]": measured.frequency_Hz if measured else None,
            "amplitude [mm]": 1000.0 * measured.amplitude_m if measured and measured.frequency_Hz else None,
            "temperature [°C]": record.median_temperature(),
            "order of the files": number + 1.0,
        }
        found.append(LoneTest(context.level(record), _alone(record), over))
    return found


def _alone(record: Record) -> ParameterRow:
    condition = Condition(record.setting, record.median_voltage(), record.median_temperature(), (record,))
    return identify_condition(condition, IdentifyConfig(), _SEED)[0]


def _panel(context: ReportContext, label: str, tests: Sequence[LoneTest], values: Sequence[float]) -> Panel:
    from matplotlib.figure import Figure

    levels = sorted({test.voltage for test in tests}, key=lambda v: v or 0.0)
    colours = dict(zip(levels, shades(len(levels)), strict=True))
    figure: Figure = Figure(figsize=(4.5, 4.6))
    plots = figure.subplots(3, 1, sharex=True)
    for ax, quantity in zip(plots, (FRICTION, DAMPING, STIFFNESS), strict=True):
        for level in levels:
            points = [
                (value, getattr(test.row, quantity.column))
                for test, value in zip(tests, values, strict=True)
                if test.voltage == level and getattr(test.row, quantity.column) is not None
            ]
            if points:
                x, y = np.array(points, dtype=np.float64).T
                name = context.voltage(level) if context.controlled and ax is plots[0] else None
                ax.plot(x, y / 1000.0, "o", color=colours[level], markersize=4.0, label=name)
        ax.set_ylabel(f"{quantity.symbol} [k{unit_of(quantity.unit)}]", fontsize=8)
        ax.margins(y=0.15)
    plots[-1].set_xlabel(label)
    if context.controlled and len(levels) > 1:
        figure.legend(loc="upper left", ncols=4, bbox_to_anchor=(0.02, 1.0), columnspacing=1.0, handletextpad=0.1)
    figure.subplots_adjust(left=0.16, right=0.97, top=0.9, bottom=0.11, hspace=0.18)
    over = label.partition(" [")[0]
    alt = f"T0, C and k of {len(tests)} tests, each fitted alone, over the {over}."
    told = "Each point is one test. What follows the axis at one colour is of the stand or the oil, or an effect."
    return Panel(figure, f"Tests fitted alone, over the {over}", alt, told)


PLOT = Plot("tests_alone", "missing", 7, draw)
