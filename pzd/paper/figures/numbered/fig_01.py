"""Figure 1: schemes of the damper and of its valve."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.paper.figures.canvas import OIL_COLOUR, Pen
from pzd.paper.figures.numbered import Drawing, PaperFigure
from pzd.paper.figures.sources import FigureData


def draw(data: FigureData) -> Iterator[Drawing]:
    """(a) the damper, (b) the valve, with the numbers of the paper."""
    pen = Pen(9.0, 4.0)
    _damper(pen)
    _valve(pen)
    alt = "Cylinder with piston, duct and piezoelectric valve; the valve's piston on the piezo stack closes the gap."
    caption = (
        "(a) 1 cylinder, 2 piston, 3 duct, 4 gap in the valve, 5 piezo stack, 6 adjusting screw. (b) 1 valve, "
        "5 stack, 7 piston of the valve, 8 and 9 direction of flow. Voltage lengthens the stack, the gap narrows, the "
        "force rises."
    )
    yield Drawing("scheme", pen.figure, alt, caption)


def _damper(pen: Pen) -> None:
    pen.text(0.35, 3.7, "(a)")
    pen.box(0.6, 0.7, 2.6, 0.9, OIL_COLOUR)
    pen.box(1.7, 0.7, 0.25, 0.9)
    pen.line((1.95, 1.15), (4.0, 1.15), 2.5)
    pen.arrow((3.6, 0.85), (4.1, 0.85))
    pen.arrow((3.5, 0.85), (3.0, 0.85))
    for x in (0.85, 2.95):
        pen.box(x - 0.08, 1.6, 0.16, 0.6, OIL_COLOUR)
    pen.box(0.77, 2.2, 0.9, 0.16, OIL_COLOUR)
    pen.box(2.13, 2.2, 0.9, 0.16, OIL_COLOUR)
    pen.box(1.62, 2.0, 0.56, 0.56)
    pen.box(1.83, 2.0, 0.14, 0.3, OIL_COLOUR)
    pen.box(1.72, 2.56, 0.36, 0.75, "#f6e3c5")
    pen.box(1.82, 3.31, 0.16, 0.3)
    for number, at, to in (
        ("1", (0.3, 1.9), (0.6, 1.5)),
        ("2", (1.5, 0.35), (1.78, 0.75)),
        ("3", (0.5, 2.6), (1.0, 2.3)),
        ("4", (1.2, 1.85), (1.85, 2.1)),
        ("5", (2.6, 3.0), (2.05, 2.95)),
        ("6", (2.6, 3.6), (1.95, 3.5)),
    ):
        pen.label(number, at, to)


def _valve(pen: Pen) -> None:
    pen.text(4.75, 3.7, "(b)")
    pen.box(5.0, 0.6, 3.4, 1.5)
    pen.box(5.0, 1.0, 1.2, 0.4, OIL_COLOUR)
    pen.box(7.2, 1.0, 1.2, 0.4, OIL_COLOUR)
    pen.box(6.2, 1.0, 1.0, 0.16, OIL_COLOUR)
    pen.box(6.35, 1.16, 0.7, 1.2)
    pen.box(6.45, 2.36, 0.5, 1.1, "#f6e3c5")
    pen.line((6.3, 3.46), (7.1, 3.46), 3.0)
    pen.arrow((5.2, 1.2), (5.9, 1.2))
    pen.arrow((7.5, 1.2), (8.2, 1.2))
    pen.arrow((7.25, 3.2), (7.25, 2.5))
    pen.text(7.75, 2.85, "voltage")
    for number, at, to in (
        ("1", (4.8, 2.4), (5.1, 1.9)),
        ("5", (5.9, 3.1), (6.45, 2.95)),
        ("7", (5.9, 2.4), (6.4, 1.8)),
        ("8", (5.5, 0.35), (5.55, 1.15)),
        ("9", (7.9, 0.35), (7.85, 1.15)),
    ):
        pen.label(number, at, to)
    pen.text(6.7, 0.8, "gap")


FIGURE = PaperFigure(
    1, "Schemes of the damper and of its valve", "scheme", "Drawn anew after the description in section 2.", draw
)
