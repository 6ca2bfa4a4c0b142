"""Figure 8: measured loops at two temperatures without voltage."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.paper.figures.numbered import Drawing, PaperFigure
from pzd.paper.figures.planes import measured
from pzd.paper.figures.sources import FigureData

LABELS = {"F8-23": "23 °C", "F8-43": "43 °C"}


def draw(data: FigureData) -> Iterator[Drawing]:
    """One picture of both planes."""
    yield measured(data, LABELS, "Measured force over displacement and velocity at 23 and 43 °C, 0 V.")


FIGURE = PaperFigure(
    8,
    "Measured force at 23 and 43 °C without voltage, 2 Hz, 0.03 m, gap 0.25 mm",
    "stand",
    "Records of the calibrated virtual stand: dots are samples of the last three cycles, lines the average cycle.",
    draw,
)
