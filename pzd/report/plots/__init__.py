"""The pictures, one file each; every module here is found by itself."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache

from pzd.report.drawing import Plot


@cache
def library() -> dict[str, Plot]:
    """Every kind of picture by name, in the order in which the page shows them."""
    found = [importlib.import_module(f"{__name__}.{info.name}").PLOT for info in pkgutil.iter_modules(__path__)]
    return {plot.name: plot for plot in sorted(found, key=lambda plot: (plot.place, plot.order, plot.name))}
