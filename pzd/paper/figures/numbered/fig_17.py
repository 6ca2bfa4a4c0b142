"""Figure 17: the model of the vehicle."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.paper.figures.canvas import Pen
from pzd.paper.figures.numbered import Drawing, PaperFigure
from pzd.paper.figures.sources import FigureData

_LEFT, _RIGHT, _BODY, _ROAD = 1.2, 6.0, 2.7, 0.75


def draw(data: FigureData) -> Iterator[Drawing]:
    """A body on two springs and two controlled dampers, with the car's own dimensions in the caption."""
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


FIGURE = PaperFigure(17, "Model of the vehicle", "scheme", "Drawn anew from equations (5) to (9).", draw)
