"""The roads, one file each: a block of the config that gives a profile. Every module here is found by itself."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache

from pzd.simulate.road import Road


@cache
def roads() -> dict[str, type[Road]]:
    """The block of every kind of road, by its `kind`."""
    found = [importlib.import_module(f"{__name__}.{info.name}").ROAD for info in pkgutil.iter_modules(__path__)]
    return {road.model_fields["kind"].default: road for road in found}
