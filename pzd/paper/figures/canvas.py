"""Panels, loops on both planes, and a pen for schemes; figures become files that are the same at every run."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from pzd.paper.figures.sources import RigTest
from pzd.paper.published import Loop
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
    """Return an empty figure of panels side by side, lettered (a), (b) where there are several, and its axes.

    Parameters
    ----------
    width, height : of the whole [in]
    ratios : widths of the panels
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    axes = list(figure.subplots(1, len(ratios), squeeze=False, width_ratios=list(ratios))[0])
    for letter, ax in zip("abcd", axes if len(axes) > 1 else [], strict=False):
        ax.set_title(f"({letter})", loc="left", fontsize=9.5, color=INK)
    return figure, axes


def key(figure: Figure, ax: Axes, columns: int = 4) -> None:
    """Add the key of the curves above the panels."""
    handles, labels = ax.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", ncols=columns, columnspacing=1.4, handlelength=1.8)


def encoded(figure: Figure) -> tuple[bytes, bytes]:
    """Return a figure as PNG and as SVG, the same bytes for the same figure: without dates or names of programs."""
    png, svg = io.BytesIO(), io.BytesIO()
    figure.savefig(png, format="png", metadata={"Software": None})
    figure.savefig(svg, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    return png.getvalue(), svg.getvalue()


# --- Loops on both planes ---


@dataclass(frozen=True, eq=False)
class Curve:
    """One loop with its name; the samples behind it where it was measured."""

    label: str
    loop: Loop
    test: RigTest | None = None
    colour: str | None = None
    style: dict[str, Any] | None = None


def both_planes(curves: Sequence[Curve], columns: int = 4) -> Figure:
    """Draw (a) force over displacement and (b) force over velocity.

    Parameters
    ----------
    curves : loops by name, a colour each
    columns : of the key
    """
    figure, (left, right) = panels()
    for curve, usual in zip(curves, COLOURS * 3, strict=False):
        colour, style = curve.colour or usual, curve.style or {}
        for ax, name in ((left, "displacement"), (right, "velocity")):
            if curve.test is not None:
                record, part = curve.test.record, curve.test.last(3)
                ax.plot(getattr(record, name)[part][::5], record.force[part][::5], ".", color=colour, markersize=1.2,
                        alpha=0.5)  # fmt: skip
            ax.plot(getattr(curve.loop, name), curve.loop.force, color=colour, label=curve.label, **style)
    for ax, label in ((left, DISPLACEMENT), (right, VELOCITY)):
        ax.set_xlabel(label)
        ax.set_ylabel(FORCE)
    key(figure, left, columns)
    return figure


# --- A pen for schemes: springs, dashpots, walls, arrows ---


OIL_COLOUR = "#cfe3f1"
_HALF = 0.16
"""Half the width of springs and dashpots [in]."""
_COILS = 6

Point = tuple[float, float]


class Pen:
    """Draws on a sheet whose unit is the inch."""

    def __init__(self, width: float, height: float) -> None:
        from matplotlib.figure import Figure

        self.figure = Figure(figsize=(width, height))
        self._ax = self.figure.add_axes((0.0, 0.0, 1.0, 1.0))
        self._ax.set_xlim(0.0, width)
        self._ax.set_ylim(0.0, height)
        self._ax.set_axis_off()

    def line(self, start: Point, end: Point, width: float = 1.3) -> None:
        """Draw a straight line."""
        self._ax.plot((start[0], end[0]), (start[1], end[1]), color=INK, linewidth=width, solid_capstyle="butt")

    def text(self, x: float, y: float, words: str) -> None:
        """Write words centred at a place."""
        self._ax.text(x, y, words, ha="center", va="center", fontsize=11)

    def dot(self, x: float, y: float) -> None:
        """Draw a point."""
        self._ax.plot(x, y, "o", color=INK, markersize=5.0)

    def box(self, x: float, y: float, width: float, height: float, colour: str = "#e4e7eb") -> None:
        """Draw a filled rectangle from its lower left corner."""
        from matplotlib.patches import Rectangle

        self._ax.add_patch(Rectangle((x, y), width, height, facecolor=colour, edgecolor=INK, linewidth=1.1))

    def arrow(self, start: Point, end: Point) -> None:
        """Draw an arrow."""
        self._ax.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": INK, "shrinkA": 0, "shrinkB": 0})

    def turn(self, x: float, y: float, radius: float) -> None:
        """Draw an arrow that turns counterclockwise about a place."""
        angle = np.linspace(np.pi * 0.25, np.pi * 0.9, 30)
        self._ax.plot(x + radius * np.cos(angle), y + radius * np.sin(angle), color=INK, linewidth=1.1)
        self.arrow(
            (x + radius * float(np.cos(angle[-2])), y + radius * float(np.sin(angle[-2]))),
            (x + radius * float(np.cos(angle[-1])) - 0.01, y + radius * float(np.sin(angle[-1])) - 0.06),
        )

    def measure(self, start: float, end: float, height: float, name: str) -> None:
        """Draw a dimension between two places at one height."""
        style = {"arrowstyle": "<|-|>", "color": SOFT, "shrinkA": 0, "shrinkB": 0}
        self._ax.annotate("", (end, height), (start, height), arrowprops=style)
        for x in (start, end):
            self._ax.plot((x, x), (height - 0.12, height + 0.12), color=SOFT, linewidth=0.9)
        self.text(0.5 * (start + end), height - 0.2, name)

    def labels(self, numbers: Mapping[str, tuple[Point, Point]]) -> None:
        """Draw numbers, each at a place and with a line to what it names."""
        box = {"boxstyle": "circle,pad=0.2", "facecolor": "white", "edgecolor": SOFT}
        for number, (at, to) in numbers.items():
            self._ax.plot((at[0], to[0]), (at[1], to[1]), color=SOFT, linewidth=0.9)
            self._ax.text(*at, number, ha="center", va="center", fontsize=9, bbox=box)

    def wall(self, x: float, low: float, high: float) -> None:
        """Draw a wall with its hatching to the left."""
        self.line((x, low), (x, high), 1.8)
        for y in np.arange(low, high + 1e-9, 0.15):
            self.line((x, float(y)), (x - 0.14, float(y) - 0.14), 0.8)

    def spring(self, start: Point, end: Point) -> None:
        """Draw a coil spring between two places."""
        along = np.concatenate(([0.0], np.linspace(0.25, 0.75, 2 * _COILS + 1), [1.0]))
        across = np.concatenate(([0.0, 0.0], [_HALF * (-1.0) ** n for n in range(2 * _COILS - 1)], [0.0, 0.0]))
        self._path(start, end, along, across)

    def dashpot(self, start: Point, end: Point, *, controlled: bool = False) -> None:
        """Draw a dashpot between two places; an arrow across it where it is controlled."""
        self._path(start, end, np.array([0.0, 0.4]), np.zeros(2))
        self._path(start, end, np.array([0.68, 0.4, 0.4, 0.68]), _HALF * np.array([-1.0, -1.0, 1.0, 1.0]))
        self._path(start, end, np.array([0.55, 0.55]), 0.8 * _HALF * np.array([-1.0, 1.0]))
        self._path(start, end, np.array([0.55, 1.0]), np.zeros(2))
        if controlled:
            x, y = 0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1])
            self.arrow((x - 0.3, y - 0.35), (x + 0.32, y + 0.4))

    def friction(self, start: Point, end: Point) -> None:
        """Draw dry friction between two places: two plates that rub."""
        self._path(start, end, np.array([0.0, 0.35, 0.35, 0.65]), np.array([0.0, 0.0, 0.04, 0.04]))
        self._path(start, end, np.array([0.38, 0.68, 0.68, 1.0]), np.array([-0.04, -0.04, 0.0, 0.0]))
        for place in np.linspace(0.4, 0.62, 5):
            self._path(start, end, np.array([place, place + 0.04]), np.array([-0.04, 0.04]))

    def _path(self, start: Point, end: Point, along: np.ndarray, across: np.ndarray) -> None:
        """Draw a line given by its share of the way from start to end, and its distance across it [in]."""
        way = np.subtract(end, start)
        normal = np.array([-way[1], way[0]]) / np.hypot(*way)
        points = np.add(start, np.outer(along, way) + np.outer(across, normal))
        self._ax.plot(points[:, 0], points[:, 1], color=INK, linewidth=1.3, solid_capstyle="butt")
