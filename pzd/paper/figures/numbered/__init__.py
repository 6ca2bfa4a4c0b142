"""The figures by the paper's number: every module here declares a family as `FIGURES`, and is found by itself."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import TYPE_CHECKING, Literal

from pzd.paper.figures.sources import FigureData

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
    """Its numbers, beside the paper's."""


@dataclass(frozen=True)
class PaperFigure:
    """One figure of the paper, and how it is drawn."""

    number: int
    title: str
    """Of the figure in the paper."""
    source: Source
    made_from: str
    """Data or model that ours is made from, in one sentence."""
    draw: Callable[[FigureData], Iterable[Drawing]] | None = None
    """None for a photograph; raises LookupError where the run has no test that the figure needs."""


@cache
def library() -> dict[int, PaperFigure]:
    """Return every figure by its number, in the order of the paper."""
    figures = [figure for family in families() for figure in family.FIGURES]
    return {figure.number: figure for figure in sorted(figures, key=lambda figure: figure.number)}


def families() -> list[ModuleType]:
    """Import every module of this package."""
    return [importlib.import_module(f"{__name__}.{info.name}") for info in pkgutil.iter_modules(__path__)]
