"""Figures 1, 10 and 17: schemes of the damper, of its model and of the vehicle, drawn anew."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.paper.figures.canvas import OIL_COLOUR, Pen, Point
from pzd.paper.figures.numbered import Drawing, PaperFigure
from pzd.paper.figures.sources import FigureData

# --- Figure 1 ---


def damper_and_valve(data: FigureData) -> Iterator[Drawing]:
    """Draw (a) the damper and (b) its valve, with the numbers of the paper."""
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
    labels: dict[str, tuple[Point, Point]] = {
        "1": ((0.3, 1.9), (0.6, 1.5)),
        "2": ((1.5, 0.35), (1.78, 0.75)),
        "3": ((0.5, 2.6), (1.0, 2.3)),
        "4": ((1.2, 1.85), (1.85, 2.1)),
        "5": ((2.6, 3.0), (2.05, 2.95)),
        "6": ((2.6, 3.6), (1.95, 3.5)),
    }
    pen.labels(labels)


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
    labels: dict[str, tuple[Point, Point]] = {
        "1": ((4.8, 2.4), (5.1, 1.9)),
        "5": ((5.9, 3.1), (6.45, 2.95)),
        "7": ((5.9, 2.4), (6.4, 1.8)),
        "8": ((5.5, 0.35), (5.55, 1.15)),
        "9": ((7.9, 0.35), (7.85, 1.15)),
    }
    pen.labels(labels)
    pen.text(6.7, 0.8, "gap")


# --- Figure 10 ---


def rheological_model(data: FigureData) -> Iterator[Drawing]:
    """Draw dry friction in parallel with a dashpot, both in series with a spring."""
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


# --- Figure 17 ---


_LEFT, _RIGHT, _BODY, _ROAD = 1.2, 6.0, 2.7, 0.75
"""Places of both axles, and heights of the body and of the road, on the sheet [in]."""


def half_car(data: FigureData) -> Iterator[Drawing]:
    """Draw a body on two springs and two controlled dampers, with the car's own dimensions in the caption."""
    car = data.simulate.car.car()
    pen = Pen(7.4, 4.2)
    centre = _LEFT + (_RIGHT - _LEFT) * car.distances[0] / car.wheelbase
    comfort = centre + (_RIGHT - _LEFT) * car.comfort_point / car.wheelbase
    pen.box(_LEFT - 0.35, _BODY, _RIGHT - _LEFT + 0.7, 0.42)
    for number, x in ((1, _LEFT), (2, _RIGHT)):
        pen.spring((x - 0.3, _ROAD), (x - 0.3, _BODY))
        pen.dashpot((x + 0.3, _ROAD), (x + 0.3, _BODY), controlled=True)
        pen.line((x - 0.5, _ROAD), (x + 0.5, _ROAD))
        pen.text(x - 0.68, 1.7, f"$S_{number}$")
        pen.text(x + 0.78, 1.7, f"$T_{number}$")
        pen.arrow((x, 0.3), (x, _ROAD))
        pen.text(x + 0.25, 0.42, rf"$\xi_{number}$")
    pen.dot(centre, _BODY + 0.21)
    pen.text(centre + 0.05, _BODY - 0.22, r"$m,\ J_y$")
    pen.arrow((centre, _BODY + 0.21), (centre, _BODY + 0.95))
    pen.text(centre + 0.2, _BODY + 0.85, "$z$")
    pen.turn(centre, _BODY + 0.21, 0.3)
    pen.text(centre + 0.52, _BODY + 0.6, r"$\Phi_y$")
    pen.dot(comfort, _BODY + 0.21)
    pen.arrow((comfort, _BODY + 0.21), (comfort, _BODY + 0.85))
    pen.text(comfort - 0.22, _BODY + 0.8, "$a_K$")
    pen.text(comfort, _BODY - 0.22, "$K$")
    for start, end, height, name in (
        (_LEFT, centre, 3.95, "$a_1$"),
        (centre, _RIGHT, 3.95, "$a_2$"),
        (centre, comfort, 2.15, "$x_K$"),
    ):
        pen.measure(start, end, height, name)
    alt = "Half-car: a body on two springs and two controlled dampers over a road, with point K."
    caption = (
        f"Drawn to the proportions of the car of the run: a1 = {car.distances[0]:g} m, a2 = {car.distances[1]:g} m, "
        f"x_K = {car.comfort_point:g} m, m = {car.mass:g} kg, J_y = {car.pitch_inertia:g} kg m². "
        "The paper leaves a1, a2, J_y and x_K out."
    )
    yield Drawing("scheme", pen.figure, alt, caption)


FIGURES = (
    PaperFigure(
        1,
        "Schemes of the damper and of its valve",
        "scheme",
        "Drawn anew after the description in section 2.",
        damper_and_valve,
    ),
    PaperFigure(
        10, "Rheological scheme of the damper", "scheme", "Drawn anew from equations (1) to (3).", rheological_model
    ),
    PaperFigure(17, "Model of the vehicle", "scheme", "Drawn anew from equations (5) to (9).", half_car),
)
