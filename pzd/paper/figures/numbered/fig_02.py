"""Figure 2: the damper, a photograph."""

from pzd.paper.figures.numbered import PaperFigure

FIGURE = PaperFigure(
    2, "Piezoelectric damper", "photograph", "A photograph in the paper; nothing here can stand for it."
)
