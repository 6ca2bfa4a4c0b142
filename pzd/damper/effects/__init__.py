"""The library of effects, one file each; every module here is found by itself."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from pzd.damper.effect import Effect
from pzd.damper.laws import declared

_PLACES = ("drive", "material", "stroke", "flow", "parallel", "branch", "sensor")


@cache
def library() -> dict[str, Effect]:
    """Every effect by name, in the physical order of the places and by name within one.

    Raises
    ------
    ImportError : when a file breaks a rule of `pzd.damper.effect`, or two files declare one name
    """
    found = sorted(effects_in(__name__, pkgutil.iter_modules(__path__)), key=lambda e: (_PLACES.index(e.place), e.name))
    unhidden = [effect.name for effect in found if effect.hidden is None and effect.never_named is None]
    if unhidden:
        raise ImportError(f"{__path__[0]}/{unhidden[0]}.py: says not how the benchmark hides it (`hidden`)")
    return {effect.name: effect for effect in found}


@cache
def nameable() -> dict[str, Effect]:
    """Those of them that a verdict may name and the benchmark hides."""
    return {name: effect for name, effect in library().items() if effect.never_named is None}


def effects_in(package: str, modules: Iterable[pkgutil.ModuleInfo]) -> list[Effect]:
    """The effects that the modules of a package declare, one each.

    Raises
    ------
    ImportError : when a file breaks a rule of `pzd.damper.effect`, or is not called like its effect
    """
    found: dict[str, tuple[Effect, str | None]] = {}
    for info in modules:
        module = importlib.import_module(f"{package}.{info.name}")
        effect = declared(module)
        if effect.name in found:
            raise ImportError(f"{found[effect.name][1]} and {module.__file__} both declare the effect {effect.name}")
        found[effect.name] = effect, module.__file__
    for effect, file in found.values():
        if file is not None and Path(file).stem != effect.name:
            raise ImportError(f"{file}: declares the effect {effect.name}, so it must be called {effect.name}.py")
    return [effect for effect, _ in found.values()]
