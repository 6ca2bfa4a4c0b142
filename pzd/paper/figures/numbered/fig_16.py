"""Figure 16: the model at two temperatures at 150 V."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.paper.figures.sources import Condition, FigureData, Sine
from pzd.paper.figures.figure import Drawing, PaperFigure
from pzd.paper.figures.models import modelled
from pzd.paper.published import LARGE_GAP

CONDITIONS = {"23 °C": Condition(LARGE_GAP, 150.0, 23.0), "43 °C": Condition(LARGE_GAP, 150.0, 43.0)}


def draw(data: FigureData) -> Iterator[Drawing]:
    """One picture of both planes."""
    what = "Modelled force on both planes at 23 and 43 °C, 150 V."
    yield modelled("model", data, CONDITIONS, Sine(2.0, 0.030), what)


FIGURE = PaperFigure(
    16,
    "Model at 23 and 43 °C at 150 V",
    "model",
    "The Bingham element with the parameters identified from the virtual stand; dashed with those of Tables 2 and 3. "
    "The paper states no motion: 2 Hz and 0.03 m are assumed, as in Figures 8 and 9.",
    draw,
)
