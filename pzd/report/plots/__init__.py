"""The pictures of the page, in families: each module declares `PLOTS`, and every module here is found by itself."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache

from pzd.report.drawing import Plot


@cache
def library() -> dict[str, Plot]:
    """Return every kind of picture by name, in the order in which the page shows them."""
    modules = [importlib.import_module(f"{__name__}.{info.name}") for info in pkgutil.iter_modules(__path__)]
    found = [plot for module in modules for plot in module.PLOTS]
    return {plot.name: plot for plot in sorted(found, key=lambda plot: (plot.place, plot.order, plot.name))}
