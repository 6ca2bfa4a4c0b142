"""What a figure of the paper is here: what it is made from, and what draws it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
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
