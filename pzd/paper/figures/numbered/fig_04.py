"""Figure 4: measured loops by voltage at the smaller gap."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.paper.figures.numbered import Drawing, PaperFigure
from pzd.paper.figures.planes import measured
from pzd.paper.figures.sources import FigureData

LABELS = {"F4-0": "0 V", "F4-100": "100 V", "F4-150": "150 V"}


def draw(data: FigureData) -> Iterator[Drawing]:
    """One picture of both planes."""
    yield measured(data, LABELS, "Measured force over displacement and velocity at 0, 100 and 150 V.")


FIGURE = PaperFigure(
    4,
    "Measured force by voltage, 1 Hz, 0.022 m, gap 0.15 mm",
    "stand",
    "Records of the calibrated virtual stand: dots are samples of the last three cycles, lines the average cycle.",
    draw,
)
