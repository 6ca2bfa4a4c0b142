"""The library of effects, one file each; every module here is found by itself."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterable
from functools import cache

from pzd.damper.effect import Effect

_PLACES = ("drive", "material", "stroke", "flow", "parallel", "sensor")


@cache
def library() -> dict[str, Effect]:
    """Every effect by name, in the physical order of the places and by name within one."""
    found = sorted(effects_in(__name__, pkgutil.iter_modules(__path__)), key=lambda e: (_PLACES.index(e.place), e.name))
    return {effect.name: effect for effect in found}


def effects_in(package: str, modules: Iterable[pkgutil.ModuleInfo]) -> list[Effect]:
    """The effects that the modules of a package declare, one each."""
    return [importlib.import_module(f"{package}.{info.name}").EFFECT for info in modules]
