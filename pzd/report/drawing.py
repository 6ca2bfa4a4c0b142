"""Colours, style and layout of plots, and their encoding as text that is the same at every run."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from pzd.artefacts import SummaryRow
from pzd.parallel.processes import parallel_map
from pzd.record import Array
from pzd.report.blocks import Picture, Pictures, shortened
from pzd.report.context import ReportContext

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Place = Literal["answer", "characteristics", "model", "missing", "damper", "passenger", "policies"]
"""Where on the page a plot stands."""

MEASURED = "#4d4d4d"
BASELINE = "#d55e00"
"""Of what something better is compared with: the simple model, the gap before, constant damping."""
FINAL = "#0072b2"
GRID = "#e3e6ea"
AXIS = "#9aa5b1"
MUTED = "#b8c4d0"
"""Of what stands back: candidates that were not adopted, lines that join dots."""
INK = "#1f2933"
BY_FIDELITY = {"ideal": "#56b4e9", "table": "#009e73", "dynamic": "#0072b2"}
"""Colours of controlled rides, of Okabe and Ito (2008), which people with any colour vision tell apart."""
BY_POLICY = {"best_fixed_voltage": "#d55e00", "best_constant_c": "#cc79a7", "passive": "#4d4d4d", "constant": "#e69f00"}
"""Likewise, of the rides that a controlled one is compared with."""
OTHER_POLICY = "#009e73"
"""Of a policy that controls and is not the one under study."""
MAP = "cividis"
"""Colour map that reads the same in grey and with any colour vision."""
_MOST_POINTS = 700
"""Points of a curve: more do not show at the size of a picture, and make the page heavy."""
_FONTS = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"

STYLE: Mapping[str, object] = {
    "svg.hashsalt": "pzd",
    "svg.fonttype": "none",
    "font.family": "DejaVu Sans",
    "font.size": 9.5,
    "axes.edgecolor": AXIS,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.7,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.major.size": 3.0,
    "ytick.major.size": 3.0,
    "text.color": INK,
    "savefig.transparent": True,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.5,
    "lines.solid_capstyle": "round",
    "path.simplify_threshold": 0.3,
}


@dataclass(frozen=True, eq=False)
class Panel:
    """A drawn figure with its words."""

    figure: Figure
    title: str
    alt: str
    caption: str


@dataclass(frozen=True)
class Plot:
    """One kind of picture."""

    name: str
    place: Place
    order: int
    """Among the pictures of its place."""
    draw: Callable[[ReportContext], Iterable[Panel]]
    """Yields no panel where there is nothing to show."""


_WIDTH_IN = 4.5
_LETTER_IN = 0.078
"""Width of a letter of a tick label."""
_SLANT_DEG = 20.0
"""Of names below the horizontal axis, which side by side would overlap."""
_LEGEND_COLUMNS = 4


def axes(
    x: str,
    y: str = "",
    *,
    height: float = 3.1,
    labels: Iterable[str] = ("-0.000",),
    key: int = 1,
    right: float = 0.2,
    slanted: Iterable[str] = (),
) -> tuple[Figure, Axes]:
    """Return an empty figure of one axes, of a size that stays readable on a telephone.

    Parameters
    ----------
    x, y : quantity and unit of each axis
    height : of the whole figure [in]
    labels : of the ticks of the vertical axis; the longest decides where the axes begin
    key : lines of a legend for which room is kept above
    right : margin to the right [in]
    slanted : names in the place of the ticks of the horizontal axis, which end at their place

    Returns
    -------
    the figure and its axes
    """
    from matplotlib.figure import Figure

    names = [shortened(name) for name in slanted]
    longest, first = (_LETTER_IN * len(name) for name in (max(names, key=len, default=""), names[0] if names else ""))
    lower = longest * np.sin(np.radians(_SLANT_DEG))
    figure = Figure(figsize=(_WIDTH_IN, height + lower))
    height += lower
    left = max(0.33 + _LETTER_IN * max(len(shortened(label)) for label in labels), first)
    below, above = 0.5 + lower, 0.1 + 0.21 * key
    box = (left / _WIDTH_IN, below / height, 1.0 - (left + right) / _WIDTH_IN, 1.0 - (below + above) / height)
    drawn = figure.add_axes(box, xlabel=x, ylabel=y)
    if names:
        drawn.set_xticks(np.arange(len(names)), names, rotation=_SLANT_DEG, ha="right", rotation_mode="anchor")
    return figure, drawn


_SHARE_BELOW = 0.32
"""Of the height for both, for a difference that is drawn below."""
_BETWEEN = 0.03
"""Of the height of the figure, between both."""


def axes_with_difference(
    x: str, y: str, difference: str, *, height: float = 3.9, labels: Iterable[str] = ("-0.00",), key: int = 1
) -> tuple[Figure, Axes, Axes]:
    """Return a figure with axes for curves, and below, at the same horizontal scale, axes for their difference.

    Parameters
    ----------
    x, y, difference : quantity and unit of each axis
    height, labels, key : as of `axes`

    Returns
    -------
    the figure, its upper and its lower axes
    """
    figure, upper = axes("", y, height=height, labels=labels, key=key)
    box = upper.get_position()
    below = _SHARE_BELOW * box.height
    upper.set_position((box.x0, box.y0 + below + _BETWEEN, box.width, box.height - below - _BETWEEN))
    lower = figure.add_axes((box.x0, box.y0, box.width, below), sharex=upper, xlabel=x, ylabel=difference)
    upper.tick_params(labelbottom=False)
    lower.margins(y=0.15)
    figure.align_ylabels()
    return figure, upper, lower


def ticks_named(ax: Axes, labels: Sequence[str]) -> None:
    """Name the rows of a plot, one a unit of its vertical axis, however alike their names are."""
    ax.set_yticks(np.arange(len(labels)), [shortened(label) for label in labels])


def legend(figure: Figure, columns: int = 3) -> None:
    """Write the legend above the axes."""
    figure.legend(loc="upper left", ncols=columns, bbox_to_anchor=(0.02, 1.01), columnspacing=1.3, handlelength=1.6)


def legend_lines(labels: int) -> int:
    """Return how many lines a legend of `legend(figure, 4)` takes."""
    return -(-labels // _LEGEND_COLUMNS)


@contextmanager
def styled() -> Iterator[None]:
    """Draw in the style of the report, with matplotlib loaded once for all processes that part within."""
    import matplotlib as mpl
    import matplotlib.backends.backend_svg
    import matplotlib.figure

    with mpl.rc_context(STYLE):  # type: ignore[arg-type]  # the stubs list every key of rcParams one by one
        yield


def pictures(plots: Sequence[Plot], context: ReportContext, jobs: int = 1) -> Pictures:
    """Draw and encode the panels of each plot, `jobs` plots at the same time."""

    def drawn(plot: Plot) -> tuple[Place, tuple[Picture, ...]]:
        return plot.place, tuple(encoded(panel) for panel in plot.draw(context))

    with styled():
        found = parallel_map(drawn, plots, jobs)
    return {place: tuple(panels for where, panels in found if where == place) for place in get_args(Place)}


def encoded(panel: Panel) -> Picture:
    """Encode a panel as an SVG in a data URI, the same bytes for the same figure."""
    buffer = io.StringIO()
    panel.figure.savefig(buffer, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    text = buffer.getvalue()
    text = text[text.index("<svg") :].replace("'DejaVu Sans'", _FONTS)
    data = base64.b64encode(text.encode()).decode()
    return Picture(panel.title, f"data:image/svg+xml;base64,{data}", panel.alt, panel.caption)


def line_of(context: ReportContext, row: SummaryRow) -> tuple[str, bool]:
    """Return the colour of a ride, and whether it is controlled."""
    controlled = context.simulate.is_controlled(row.policy)
    return BY_POLICY.get(row.policy, BY_FIDELITY[row.fidelity] if controlled else OTHER_POLICY), controlled


def thinned(*columns: Array) -> tuple[Array, ...]:
    """Return every n-th sample of arrays of one length, n so large that a curve has few enough points to be drawn."""
    step = max(int(np.ceil(columns[0].size / _MOST_POINTS)), 1)
    return tuple(column[::step] for column in columns)


def shades(count: int) -> list[tuple[float, float, float, float]]:
    """Return `count` colours from dark blue to ochre, in order of lightness."""
    import matplotlib as mpl

    return [mpl.colormaps[MAP](place) for place in np.linspace(0.0, 0.75, count)] if count else []
