"""Figure 12: measured and modelled loops."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.paper.figures.canvas import BASELINE, MEASURED
from pzd.paper.figures.numbered import Drawing, PaperFigure
from pzd.paper.figures.planes import Curve, both_planes, fitted, over_last_cycle
from pzd.paper.figures.sources import Condition, FigureData, Sine
from pzd.paper.published import SMALL_GAP

AT, SINE = Condition(SMALL_GAP, 100.0), Sine(1.0, 0.022)


def draw(data: FigureData) -> Iterator[Drawing]:
    """Both planes of the test of Figure 11."""
    test, row = data.test(AT, SINE), data.row(AT)
    force, w_s = fitted(test, row)
    cycle = test.cycle()
    curves = [
        Curve("measured", cycle, test, MEASURED),
        Curve("model", over_last_cycle(test, force), colour=BASELINE, style={"linestyle": "--", "linewidth": 1.3}),
    ]
    caption = f"{AT}, {SINE}: W_s = {w_s:.2e}; peak measured {cycle.peak:.0f} N, model {curves[1].loop.peak:.0f} N."
    yield Drawing("planes", both_planes(curves), "Measured and modelled force on both planes at 100 V.", caption)


FIGURE = PaperFigure(
    12,
    "Measured and modelled force on both planes, 1 Hz, 0.022 m",
    "stand",
    "The record and the element of Figure 11.",
    draw,
)
