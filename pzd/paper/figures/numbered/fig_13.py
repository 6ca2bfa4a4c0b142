"""Figure 13: the model by voltage at the smaller gap."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.paper.figures.numbered import Drawing, PaperFigure
from pzd.paper.figures.planes import modelled
from pzd.paper.figures.sources import Condition, FigureData, Sine
from pzd.paper.published import SMALL_GAP

CONDITIONS = {f"{voltage:g} V": Condition(SMALL_GAP, voltage) for voltage in (0.0, 100.0, 150.0)}


def draw(data: FigureData) -> Iterator[Drawing]:
    """One picture of both planes."""
    what = "Modelled force on both planes at 0, 100 and 150 V, gap 0.15 mm."
    yield modelled("model", data, CONDITIONS, Sine(1.0, 0.022), what)


FIGURE = PaperFigure(
    13,
    "Model by voltage, 1 Hz, 0.022 m, gap 0.15 mm",
    "model",
    "The Bingham element with the parameters identified from the virtual stand; dashed with those of Table 1.",
    draw,
)
