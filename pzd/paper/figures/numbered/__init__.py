"""The figures by the paper's number, one file each; every module here is found by itself."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache

from pzd.paper.figures.figure import PaperFigure


@cache
def library() -> dict[int, PaperFigure]:
    """Every figure by its number, in the order of the paper."""
    found = [importlib.import_module(f"{__name__}.{info.name}").FIGURE for info in pkgutil.iter_modules(__path__)]
    return {figure.number: figure for figure in sorted(found, key=lambda figure: figure.number)}
