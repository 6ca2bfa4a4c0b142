"""Figure 20: a damper for a commercial vehicle, a photograph."""

from pzd.paper.figures.numbered import PaperFigure

FIGURE = PaperFigure(
    20, "PZ damper, Ford Transit", "photograph", "A photograph in the paper; nothing here can stand for it."
)
