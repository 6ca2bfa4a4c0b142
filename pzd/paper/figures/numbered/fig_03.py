"""Figure 3: the test stand and the power supply, photographs."""

from pzd.paper.figures.numbered import PaperFigure

FIGURE = PaperFigure(
    3,
    "Stand to study the damper, and its power supply",
    "photograph",
    "Photographs in the paper; the stand used here is virtual and is described by configs/paper.yaml.",
)
