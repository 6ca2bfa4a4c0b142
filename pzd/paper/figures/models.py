"""Loops of the Bingham element: as identified from the stand, and with the parameters of the paper's tables."""

from __future__ import annotations

from pzd.artefacts import ParameterRow
from pzd.damper.model import BaseRow
from pzd.paper.figures.canvas import COLOURS, NUMBERS_OF_OTHERS
from pzd.paper.figures.figure import Drawing, PaperFigure
from pzd.paper.figures.planes import Curve, both_planes, element, identified, loop
from pzd.paper.figures.sources import Condition, FigureData, Sine
from pzd.paper.published import LARGE_GAP, TABLES, table_damper


def tabulated(condition: Condition) -> BaseRow:
    """The paper's parameters of a condition.

    Raises
    ------
    LookupError : when no table has it
    """
    for table, (setting, temperature) in TABLES.items():
        if setting == condition.setting and abs(temperature - condition.temperature) <= 2.0:
            for row in table_damper(table):
                if row.voltage_V == condition.voltage:
                    return row
    raise LookupError(f"the paper has no parameters at {condition}")


def modelled(part: str, data: FigureData, labels: dict[str, Condition], sine: Sine, what: str) -> Drawing:
    """The identified element at several conditions, the paper's element beside each.

    Parameters
    ----------
    part : ends the name of the file
    data : the run
    labels : conditions by the name of their curve
    sine : the motion
    what : the picture in words

    Returns
    -------
    the drawing

    Raises
    ------
    LookupError : when a condition was not identified
    """
    curves: list[Curve] = []
    captions: list[str] = []
    for (label, condition), colour in zip(labels.items(), COLOURS, strict=False):
        row = data.row(condition)
        ours, theirs = loop(element(identified(row)), sine), loop(element(tabulated(condition)), sine)
        curves.append(Curve(label, ours, colour=colour))
        curves.append(Curve(f"{label}, paper's parameters", theirs, colour=colour, style=NUMBERS_OF_OTHERS))
        captions.append(
            f"{label}: {ours.peak:.0f} N, with the paper's parameters {theirs.peak:.0f} N; {parameters(row)}"
        )
    figure = both_planes(curves, columns=len(labels))
    return Drawing(part, figure, what, f"{sine}. Peak, " + ". ".join(captions) + ".")


def at_two_temperatures(number: int, voltage: float, in_words: str) -> PaperFigure:
    """Figures 15 and 16: the model at 23 and 43 °C at one voltage.

    Parameters
    ----------
    number : of the figure
    voltage : [V]
    in_words : the voltage as the title says it
    """
    conditions = {f"{warm:g} °C": Condition(LARGE_GAP, voltage, warm) for warm in (23.0, 43.0)}
    what = f"Modelled force on both planes at 23 and 43 °C, {voltage:g} V."
    return PaperFigure(
        number,
        f"Model at 23 and 43 °C {in_words}",
        "model",
        "The Bingham element with the parameters identified from the virtual stand; dashed with those of Tables 2 and "
        "3. The paper states no motion: 2 Hz and 0.03 m are assumed, as in Figures 8 and 9.",
        lambda data: (modelled("model", data, conditions, Sine(2.0, 0.030), what),),
    )


def parameters(row: ParameterRow) -> str:
    """T0, C, k of a row with their 95 % intervals, in words."""
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
