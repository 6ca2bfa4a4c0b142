"""Figure 14: the model by voltage at the larger gap; caption and text disagree about the motion."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.paper.figures.numbered import Drawing, PaperFigure
from pzd.paper.figures.planes import modelled
from pzd.paper.figures.sources import Condition, FigureData, Sine
from pzd.paper.published import LARGE_GAP

CONDITIONS = {f"{voltage:g} V": Condition(LARGE_GAP, voltage) for voltage in (0.0, 50.0, 100.0, 150.0)}
READINGS = {"by-caption": Sine(1.0, 0.022), "by-text": Sine(2.0, 0.030)}


def draw(data: FigureData) -> Iterator[Drawing]:
    """One picture a reading."""
    for part, sine in READINGS.items():
        what = f"Modelled force on both planes at 0 to 150 V, gap 0.25 mm, {sine}."
        yield modelled(part, data, CONDITIONS, sine, what)


FIGURE = PaperFigure(
    14,
    "Model by voltage, gap 0.25 mm: by the caption 1 Hz, 0.022 m; by the text 2 Hz, 0.03 m",
    "model",
    "The Bingham element with the parameters identified from the virtual stand; dashed with those of Table 2. The "
    "paper contradicts itself about the motion, so both are drawn.",
    draw,
)
