"""How the figures look, and how they become files that are the same at every run."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from pzd.report.drawing import BASELINE, FINAL, INK, MEASURED, STYLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = (FINAL, "#009e73", "#e69f00", BASELINE)
"""Of Okabe and Ito (2008), in the order of the curves."""
SOFT = "#9aa5b1"
PAPER_STYLE: Mapping[str, object] = {
    **STYLE,
    "savefig.transparent": False,
    "savefig.facecolor": "white",
    "savefig.dpi": 150,
    "font.size": 9.5,
}
NUMBERS_OF_OTHERS = {"linestyle": (0, (4, 2)), "linewidth": 1.1}
"""How curves from the paper's own numbers are drawn."""
DISPLACEMENT, VELOCITY, FORCE = "displacement x [m]", "velocity v [m/s]", "force F [N]"

__all__ = ["BASELINE", "COLOURS", "FINAL", "INK", "MEASURED", "SOFT"]


def panels(width: float = 8.4, height: float = 3.7, ratios: Sequence[float] = (1.0, 1.0)) -> tuple[Figure, list[Axes]]:
    """An empty figure of panels side by side, in inches, lettered (a), (b) where there are several.

    Parameters
    ----------
    width, height : of the whole [in]
    ratios : widths of the panels

    Returns
    -------
    the figure and its axes
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    axes = list(figure.subplots(1, len(ratios), squeeze=False, width_ratios=list(ratios))[0])
    for letter, ax in zip("abcd", axes if len(axes) > 1 else [], strict=False):
        ax.set_title(f"({letter})", loc="left", fontsize=9.5, color=INK)
    return figure, axes


def key(figure: Figure, ax: Axes, columns: int = 4) -> None:
    """What the curves are, above the panels."""
    handles, labels = ax.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", ncols=columns, columnspacing=1.4, handlelength=1.8)


def sheet(width: float, height: float) -> tuple[Figure, Axes]:
    """An empty sheet for a scheme, one unit an inch, without axes."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height))
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    ax.set_xlim(0.0, width)
    ax.set_ylim(0.0, height)
    ax.set_axis_off()
    return figure, ax


def encoded(figure: Figure) -> tuple[bytes, bytes]:
    """A figure as PNG and as SVG, without dates or names of programs.

    Returns
    -------
    both files' bytes, the same for the same figure
    """
    png, svg = io.BytesIO(), io.BytesIO()
    figure.savefig(png, format="png", metadata={"Software": None})
    figure.savefig(svg, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    return png.getvalue(), svg.getvalue()
