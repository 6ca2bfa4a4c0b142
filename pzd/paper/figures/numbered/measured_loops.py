"""Figures 4, 5, 6, 8 and 9: measured loops on both planes, by voltage, frequency and temperature."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

from pzd.paper.figures.canvas import Curve, both_planes
from pzd.paper.figures.numbered import Drawing, PaperFigure
from pzd.paper.figures.sources import FigureData
from pzd.paper.published import published

_RECORDS = (
    "Records of the calibrated virtual stand: dots are samples of the last three cycles, lines the average cycle."
)


def measured(data: FigureData, labels: Mapping[str, str], what: str) -> Iterator[Drawing]:
    """Draw the average cycles of the tests that published peak forces were measured in, their peaks beside the paper's.

    Parameters
    ----------
    data : the run
    labels : name of the curve by id of the published number
    what : is measured, in words

    Raises
    ------
    LookupError : when the rig lacks one of the tests
    """
    curves, captions = [], []
    for name, label in labels.items():
        row = published()[name]
        test = data.test(row.conditions)
        curves.append(Curve(label, test.cycle(), test))
        captions.append(f"{label}: {test.measure.peak_force_N:.0f} N, paper {row.number:.0f} N")
    alt = f"Measured force over displacement and velocity at {what}."
    yield Drawing("measured", both_planes(curves), alt, "Peak of the average cycle, " + "; ".join(captions) + ".")


def _figure(number: int, title: str, unit: str, values: tuple[int, ...], what: str, remark: str = "") -> PaperFigure:
    """Return the figure of the tests whose published peaks end with those values, which name the curves."""
    labels = {f"F{number}-{value}": f"{value} {unit}" for value in values}
    return PaperFigure(number, title, "stand", _RECORDS + remark, partial(measured, labels=labels, what=what))


FIGURES = (
    _figure(4, "Measured force by voltage, 1 Hz, 0.022 m, gap 0.15 mm", "V", (0, 100, 150), "0, 100 and 150 V"),
    _figure(
        5,
        "Measured force by voltage, 2 Hz, 0.03 m, gap 0.25 mm",
        "V",
        (0, 50, 100, 150),
        "0, 50, 100 and 150 V",
        remark=" The text prints 227 N at 100 V, read as 2270 N.",
    ),
    _figure(6, "Measured force at 1 and 2 Hz without voltage, 0.03 m, gap 0.25 mm", "Hz", (1, 2), "1 and 2 Hz"),
    _figure(
        8,
        "Measured force at 23 and 43 °C without voltage, 2 Hz, 0.03 m, gap 0.25 mm",
        "°C",
        (23, 43),
        "23 and 43 °C, 0 V",
    ),
    _figure(
        9, "Measured force at 23 and 43 °C at 150 V, 2 Hz, 0.03 m, gap 0.25 mm", "°C", (23, 43), "23 and 43 °C, 150 V"
    ),
)
