"""The library of effects, one file each; every module here is found by itself."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache

from pzd.damper.effect import Effect

_PLACES = ("drive", "material", "stroke", "flow", "parallel", "sensor")


@cache
def library() -> dict[str, Effect]:
    """Every effect by name, in the physical order of the places and by name within one."""
    found = [importlib.import_module(f"{__name__}.{info.name}").EFFECT for info in pkgutil.iter_modules(__path__)]
    return {effect.name: effect for effect in sorted(found, key=lambda e: (_PLACES.index(e.place), e.name))}
