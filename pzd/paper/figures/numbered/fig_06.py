"""Figure 6: measured loops by frequency without voltage."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.paper.figures.numbered import Drawing, PaperFigure
from pzd.paper.figures.planes import measured
from pzd.paper.figures.sources import FigureData

LABELS = {"F6-1": "1 Hz", "F6-2": "2 Hz"}


def draw(data: FigureData) -> Iterator[Drawing]:
    """One picture of both planes."""
    yield measured(data, LABELS, "Measured force over displacement and velocity at 1 and 2 Hz.")


FIGURE = PaperFigure(
    6,
    "Measured force at 1 and 2 Hz without voltage, 0.03 m, gap 0.25 mm",
    "stand",
    "Records of the calibrated virtual stand: dots are samples of the last three cycles, lines the average cycle.",
    draw,
)
