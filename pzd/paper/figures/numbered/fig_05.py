"""Figure 5: measured loops by voltage at the larger gap."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.paper.figures.numbered import Drawing, PaperFigure
from pzd.paper.figures.planes import measured
from pzd.paper.figures.sources import FigureData

LABELS = {"F5-0": "0 V", "F5-50": "50 V", "F5-100": "100 V", "F5-150": "150 V"}


def draw(data: FigureData) -> Iterator[Drawing]:
    """One picture of both planes."""
    yield measured(data, LABELS, "Measured force over displacement and velocity at 0, 50, 100 and 150 V.")


FIGURE = PaperFigure(
    5,
    "Measured force by voltage, 2 Hz, 0.03 m, gap 0.25 mm",
    "stand",
    "Records of the calibrated virtual stand: dots are samples of the last three cycles, lines the average cycle. "
    "The text prints 227 N at 100 V, read as 2270 N.",
    draw,
)
