"""Figures 2, 3 and 20: photographs, which cannot be drawn."""

from pzd.paper.figures.numbered import PaperFigure

_ALONE = "A photograph in the paper; nothing here can stand for it."

FIGURES = (
    PaperFigure(2, "Piezoelectric damper", "photograph", _ALONE),
    PaperFigure(
        3,
        "Stand to study the damper, and its power supply",
        "photograph",
        "Photographs in the paper; the stand used here is virtual and is described by configs/paper.yaml.",
    ),
    PaperFigure(20, "PZ damper, Ford Transit", "photograph", _ALONE),
)
