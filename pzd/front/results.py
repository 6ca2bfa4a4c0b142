"""What every result of the front door offers: a DataFrame, a plot, a few lines of text, and a table in a notebook."""

from __future__ import annotations

import html
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pzd.quantities import Control
from pzd.schema.model import Frozen

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

MOST_ROWS = 12
"""Rows of a table that a notebook shows below the text."""


class Result(ABC):
    """A result: text in a terminal, text and table in a notebook, a DataFrame, and a plot."""

    @abstractmethod
    def lines(self) -> list[str]:
        """Return the result in a few lines."""

    @abstractmethod
    def to_frame(self) -> pd.DataFrame:
        """Return the numbers as a DataFrame."""

    @abstractmethod
    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the result.

        Parameters
        ----------
        ax : axes to draw on; new ones by default
        """

    def __repr__(self) -> str:
        """Return the result in a few lines."""
        return "\n".join(self.lines())

    def _repr_html_(self) -> str:
        """Return the same for a notebook, with the first rows of the table below."""
        frame = self.to_frame()
        more = f"<p>{len(frame)} rows in all</p>" if len(frame) > MOST_ROWS else ""
        table = frame.head(MOST_ROWS).to_html(index=False, na_rep="", border=0, float_format=lambda x: f"{x:.4g}")
        return f"<pre>{html.escape(repr(self))}</pre>{table}{more}"


def new_axes(ax: Axes | None) -> Axes:
    """Return axes to draw on: those given, else those of a new figure."""
    if ax is not None and not hasattr(ax, "plot"):
        raise TypeError(f"ax: must be the Axes to draw on, such as axs[0] of several (got {type(ax).__name__})")
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt

    _, made = plt.subplots(layout="constrained")
    return made


def frame_of(rows: Sequence[Frozen], model: type[Frozen], control: Control) -> pd.DataFrame:
    """Return the rows of an artefact under the columns of its file; a cell that is empty there is NaN, or None in text.

    Parameters
    ----------
    rows : of the artefact
    model : of the rows, for a table without any
    control : the control signal, which names columns
    """
    import pandas as pd

    plain = [row.model_dump() for row in rows]
    return pd.DataFrame({control.renamed(name): column([each[name] for each in plain]) for name in model.model_fields})


def column(values: list[Any]) -> Any:
    """Return the values of a column: numbers with NaN where one is missing, or as they are where one is no number."""
    import numpy as np

    if any(value is None for value in values) and all(isinstance(value, float | None) for value in values):
        return np.array([np.nan if value is None else value for value in values], dtype=np.float64)
    return values
