"""Figures 11 to 16: the model beside the measurement, and by voltage and temperature.

The model is the Bingham element, as identified from the virtual stand and with the parameters of the paper's tables.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np

from pzd.artefacts import ParameterRow
from pzd.artefacts.rig import Conditions
from pzd.damper.model import BaseRow, Damper
from pzd.paper.figures.canvas import (
    BASELINE,
    COLOURS,
    FORCE,
    MEASURED,
    NUMBERS_OF_OTHERS,
    Curve,
    both_planes,
    key,
    panels,
)
from pzd.paper.figures.numbered import Drawing, PaperFigure
from pzd.paper.figures.sources import FigureData, RigTest
from pzd.paper.published import LARGE_GAP, SMALL_GAP, TABLES, Loop, loop_of, table_damper
from pzd.record import Array
from pzd.signals.measures import criterion

_POINTS = 1000
"""Of a drawn cycle: fewer than one a pixel would show."""


# --- Parameters and the element ---


def identified(row: ParameterRow) -> BaseRow:
    """Return the identified parameters of a condition.

    Raises
    ------
    LookupError : when one of them is undetermined
    """
    if row.T0_N is None or row.C_Ns_per_m is None or row.k_N_per_m is None:
        raise LookupError(f"{row.setting}, {row.voltage_V} V: {row.status}")
    return BaseRow(voltage_V=row.voltage_V, T0_N=row.T0_N, C_Ns_per_m=row.C_Ns_per_m, k_N_per_m=row.k_N_per_m)


def tabulated(condition: Conditions) -> BaseRow:
    """Return the paper's parameters of a condition.

    Raises
    ------
    LookupError : when no table has it
    """
    for table, (setting, temperature) in TABLES.items():
        if setting == condition.setting and abs(temperature - (condition.temperature_degC or 0.0)) <= 2.0:
            for row in table_damper(table):
                if row.voltage_V == condition.voltage_V:
                    return row
    raise LookupError(f"the paper has no parameters at {condition}")


def element(row: BaseRow) -> Damper:
    """Return the Bingham element with the parameters of one row, whatever the voltage."""
    return Damper(base=(row.model_copy(update={"voltage_V": None, "temperature_degC": None}),))


def loop(row: BaseRow, sine: Conditions) -> Loop:
    """Compute the settled cycle of the element in a sine."""
    return loop_of(element(row), sine.frequency_Hz or 0.0, sine.amplitude_m or 0.0, samples=_POINTS)


def parameters(row: ParameterRow) -> str:
    """Return T0, C, k of a row with their 95 % intervals, in words."""
    intervals = [
        f"{name} {value:.4g} ({low:.4g} to {high:.4g}) {unit}"
        for name, value, low, high, unit in (
            ("T0", row.T0_N, row.T0_N_low95, row.T0_N_high95, "N"),
            ("C", row.C_Ns_per_m, row.C_Ns_per_m_low95, row.C_Ns_per_m_high95, "N s/m"),
            ("k", row.k_N_per_m, row.k_N_per_m_low95, row.k_N_per_m_high95, "N/m"),
        )
        if value is not None and low is not None and high is not None
    ]
    return ", ".join(intervals)


# --- Figures 11 and 12: the test of Figure 4 at 100 V ---


_TEST = Conditions(SMALL_GAP, 100.0, 22.0, 1.0, 0.022)


def fitted(test: RigTest, row: ParameterRow) -> tuple[Array, float]:
    """Simulate the identified element in the motion of a test.

    Parameters
    ----------
    test : a test of the rig
    row : the parameters of its condition

    Returns
    -------
    (n,) force [N], and W_s over all but the first cycle

    Raises
    ------
    LookupError : when a parameter is undetermined
    """
    from pzd.damper.compose import respond
    from pzd.damper.motion import Motion

    force = respond(element(identified(row)), Motion.of(test.record))
    period = 1.0 / (test.measure.frequency_Hz or 1.0)
    settled = test.record.time >= test.record.time[0] + period
    return force, criterion((test.record.force - force)[settled], test.record.force[settled])


def over_time(data: FigureData) -> Iterator[Drawing]:
    """Draw the last three cycles of the record, and the identified element in the same motion."""
    test, row = data.test(_TEST), data.row(_TEST)
    force, w_s = fitted(test, row)
    part = test.last(3)
    figure, (ax,) = panels(ratios=(1.0,), height=3.2)
    time = test.record.time[part] - test.record.time[part][0]
    ax.plot(time, test.record.force[part], ".", color=MEASURED, markersize=2.0, label="measured")
    ax.plot(time, force[part], color=BASELINE, linewidth=1.1, label="model")
    ax.set_xlabel("time t [s]")
    ax.set_ylabel(FORCE)
    ax.set_xlim(0.0, float(np.ceil(time[-1])))
    key(figure, ax)
    caption = f"{_TEST}: W_s = {w_s:.2e} over this record, {row.W_s:.2e} over all of the condition; {parameters(row)}."
    yield Drawing("time", figure, "Measured and modelled force over time at 100 V.", caption)


def on_both_planes(data: FigureData) -> Iterator[Drawing]:
    """Draw both planes of the same test, measured and modelled."""
    test, row = data.test(_TEST), data.row(_TEST)
    force, w_s = fitted(test, row)
    cycle, modelled = test.cycle(), test.loop(1, force)
    curves = [
        Curve("measured", cycle, test, MEASURED),
        Curve("model", modelled, colour=BASELINE, style={"linestyle": "--", "linewidth": 1.3}),
    ]
    caption = f"{_TEST}: W_s = {w_s:.2e}; peak measured {cycle.peak:.0f} N, model {modelled.peak:.0f} N."
    yield Drawing("planes", both_planes(curves), "Measured and modelled force on both planes at 100 V.", caption)


# --- Figures 13 to 16: the model alone ---


def modelled(
    data: FigureData, conditions: Mapping[str, Conditions], sines: Mapping[str, Conditions], what: str
) -> Iterator[Drawing]:
    """Draw the identified element at several conditions, the paper's element beside each.

    Parameters
    ----------
    data : the run
    conditions : by the name of their curve
    sines : motions, one a picture, by what ends the name of its file
    what : is shown, in words

    Raises
    ------
    LookupError : when a condition was not identified
    """
    for part, sine in sines.items():
        curves: list[Curve] = []
        captions: list[str] = []
        for (label, condition), colour in zip(conditions.items(), COLOURS, strict=False):
            row = data.row(condition)
            ours, papers = loop(identified(row), sine), loop(tabulated(condition), sine)
            curves.append(Curve(label, ours, colour=colour))
            curves.append(Curve(f"{label}, paper's parameters", papers, colour=colour, style=NUMBERS_OF_OTHERS))
            captions.append(
                f"{label}: {ours.peak:.0f} N, with the paper's parameters {papers.peak:.0f} N; {parameters(row)}"
            )
        figure = both_planes(curves, columns=len(conditions))
        motion = f", {sine}" if len(sines) > 1 else ""
        alt, caption = (
            f"Modelled force on both planes at {what}{motion}.",
            f"{sine}. Peak, " + ". ".join(captions) + ".",
        )
        yield Drawing(part, figure, alt, caption)


_ELEMENT = "The Bingham element with the parameters identified from the virtual stand; dashed with"
_SLOW = Conditions(frequency_Hz=1.0, amplitude_m=0.022)
_FAST = Conditions(frequency_Hz=2.0, amplitude_m=0.030)
"""Motions of the tests of Figure 4 and of Figure 5."""


def _by_voltage(setting: str, *voltages: float) -> dict[str, Conditions]:
    return {f"{voltage:g} V": Conditions(setting, voltage, 22.0) for voltage in voltages}


def _at_two_temperatures(number: int, voltage: float, in_words: str) -> PaperFigure:
    """Return the model at 23 and 43 °C at one voltage [V], which the title gives in words."""
    conditions = {f"{warm:g} °C": Conditions(LARGE_GAP, voltage, warm) for warm in (23.0, 43.0)}
    what = f"23 and 43 °C, {voltage:g} V"
    return PaperFigure(
        number,
        f"Model at 23 and 43 °C {in_words}",
        "model",
        f"{_ELEMENT} those of Tables 2 and 3. The paper states no motion: 2 Hz and 0.03 m are assumed, as in Figures 8 "
        "and 9.",
        partial(modelled, conditions=conditions, sines={"model": _FAST}, what=what),
    )


FIGURES = (
    PaperFigure(
        11,
        "Force over time, measured and model",
        "stand",
        "A record of the virtual stand, and the Bingham element with the parameters identified from all records at "
        "100 V.",
        over_time,
    ),
    PaperFigure(
        12,
        "Measured and modelled force on both planes, 1 Hz, 0.022 m",
        "stand",
        "The record and the element of Figure 11.",
        on_both_planes,
    ),
    PaperFigure(
        13,
        "Model by voltage, 1 Hz, 0.022 m, gap 0.15 mm",
        "model",
        f"{_ELEMENT} those of Table 1.",
        partial(
            modelled,
            conditions=_by_voltage(SMALL_GAP, 0.0, 100.0, 150.0),
            sines={"model": _SLOW},
            what="0, 100 and 150 V, gap 0.15 mm",
        ),
    ),
    PaperFigure(
        14,
        "Model by voltage, gap 0.25 mm: by the caption 1 Hz, 0.022 m; by the text 2 Hz, 0.03 m",
        "model",
        f"{_ELEMENT} those of Table 2. The paper contradicts itself about the motion, so both are drawn.",
        partial(
            modelled,
            conditions=_by_voltage(LARGE_GAP, 0.0, 50.0, 100.0, 150.0),
            sines={"by-caption": _SLOW, "by-text": _FAST},
            what="0 to 150 V, gap 0.25 mm",
        ),
    ),
    _at_two_temperatures(15, 0.0, "without voltage"),
    _at_two_temperatures(16, 150.0, "at 150 V"),
)
