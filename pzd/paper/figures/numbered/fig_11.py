"""Figure 11: measured and modelled force over time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pzd.paper.figures.canvas import BASELINE, FORCE, MEASURED, key, panels
from pzd.paper.figures.numbered import Drawing, PaperFigure
from pzd.paper.figures.planes import fitted, parameters
from pzd.paper.figures.sources import Condition, FigureData, Sine
from pzd.paper.published import SMALL_GAP

AT, SINE = Condition(SMALL_GAP, 100.0), Sine(1.0, 0.022)
_CYCLES = 3


def draw(data: FigureData) -> Iterator[Drawing]:
    """Three cycles of the record that Figure 4 shows at 100 V, and the identified element in the same motion."""
    test, row = data.test(AT, SINE), data.row(AT)
    force, w_s = fitted(test, row)
    part = test.last(_CYCLES)
    figure, (ax,) = panels(ratios=(1.0,), height=3.2)
    time = test.record.time[part] - test.record.time[part][0]
    ax.plot(time, test.record.force[part], ".", color=MEASURED, markersize=2.0, label="measured")
    ax.plot(time, force[part], color=BASELINE, linewidth=1.1, label="model")
    ax.set_xlabel("time t [s]")
    ax.set_ylabel(FORCE)
    ax.set_xlim(0.0, float(np.ceil(time[-1])))
    key(figure, ax)
    caption = (
        f"{AT}, {SINE}: W_s = {w_s:.2e} over this record, {row.W_s:.2e} over all of the condition; {parameters(row)}."
    )
    yield Drawing("time", figure, "Measured and modelled force over time at 100 V.", caption)


FIGURE = PaperFigure(
    11,
    "Force over time, measured and model",
    "stand",
    "A record of the virtual stand, and the Bingham element with the parameters identified from all records at 100 V.",
    draw,
)
