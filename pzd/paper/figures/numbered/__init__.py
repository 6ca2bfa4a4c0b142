"""The figures by the paper's number, one file each; every module here is found by itself."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Literal

from pzd.paper.figures.sources import FigureData

# ----------------------------------------------------------------------------------------------------
# What a figure of the paper is here: what it is made from, and what draws it.


if TYPE_CHECKING:
    from matplotlib.figure import Figure

Source = Literal["stand", "model", "rides", "scheme", "computed", "photograph"]
"""The virtual stand, the identified model, the half-car, a drawing of ours, something computed in its place, or
a photograph that cannot be made."""


@dataclass(frozen=True, eq=False)
class Drawing:
    """One picture with its words and numbers."""

    part: str
    """What of the figure it shows; ends the name of the file."""
    figure: Figure
    alt: str
    caption: str
    """What the picture shows, with its numbers beside the paper's."""


@dataclass(frozen=True)
class PaperFigure:
    """One figure of the paper."""

    number: int
    title: str
    """What the paper shows there."""
    source: Source
    made_from: str
    """What ours is made from, in one sentence."""
    draw: Callable[[FigureData], Iterable[Drawing]] | None = None
    """None for a photograph; raises LookupError where the run has no test that the figure needs."""


# ----------------------------------------------------------------------------------------------------


@cache
def library() -> dict[int, PaperFigure]:
    """Every figure by its number, in the order of the paper."""
    found = [importlib.import_module(f"{__name__}.{info.name}").FIGURE for info in pkgutil.iter_modules(__path__)]
    return {figure.number: figure for figure in sorted(found, key=lambda figure: figure.number)}
