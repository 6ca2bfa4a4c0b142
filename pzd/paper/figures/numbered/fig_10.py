"""Figure 10: the rheological scheme of the damper."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.paper.figures.canvas import Pen
from pzd.paper.figures.numbered import Drawing, PaperFigure
from pzd.paper.figures.sources import FigureData


def draw(data: FigureData) -> Iterator[Drawing]:
    """Dry friction beside a dashpot, in line with a spring."""
    pen = Pen(6.4, 2.5)
    pen.wall(0.6, 0.5, 2.0)
    pen.line((0.6, 1.25), (1.1, 1.25))
    pen.line((1.1, 0.7), (1.1, 1.8))
    pen.friction((1.1, 1.8), (3.0, 1.8))
    pen.dashpot((1.1, 0.7), (3.0, 0.7))
    pen.line((3.0, 0.7), (3.0, 1.8))
    pen.spring((3.0, 1.25), (4.9, 1.25))
    pen.arrow((4.9, 1.25), (5.8, 1.25))
    pen.text(2.05, 2.08, "$T_0$")
    pen.text(2.05, 0.25, "$C$")
    pen.text(3.95, 1.6, "$k$")
    pen.text(5.45, 1.45, "$F$")
    for x, name in ((3.0, "$y$"), (4.9, "$x$")):
        pen.line((x, 2.05), (x, 2.3))
        pen.arrow((x, 2.2), (x + 0.45, 2.2))
        pen.text(x + 0.58, 2.2, name)
    alt = "Dry friction T0 beside a dashpot C, both in line with a spring k."
    caption = "F = k (x - y), C dy/dt + T0 sign(dy/dt) = F: equations (1) to (3)."
    yield Drawing("scheme", pen.figure, alt, caption)


FIGURE = PaperFigure(10, "Rheological scheme of the damper", "scheme", "Drawn anew from equations (1) to (3).", draw)
