"""Confounders: parallel forces outside the library, never named, that an effect must fit better than.

A posterior over the library alone calls the least bad of its effects certain. An effect that fits no better than a
confounder is not, the number of parameters considered. One file each; every module here is found by discovery.
"""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache
from pathlib import Path
from types import ModuleType

from pzd.damper.effect import Effect
from pzd.damper.effects import effects_in, library
from pzd.damper.fitted_laws import fitted_laws


@cache
def confounders() -> dict[str, Effect]:
    """Return every confounder by name; all are parallel to the element."""
    return {effect.name: effect for effect in effects_in(__name__, pkgutil.iter_modules(__path__))}


def _sets() -> dict[str, dict[str, Effect]]:
    """Return the folders of effect files, each with its effects by name."""
    return {"effects": library(), "confounders": confounders(), "fitted_laws": fitted_laws()}


@cache
def known() -> dict[str, Effect]:
    """Return everything that a damper can be computed with: the library, the confounders and the fitted laws.

    Raises
    ------
    ImportError : when two of them have one name
    """
    folder, files = Path(__file__).parent.parent, dict[str, Path]()
    for package, name in ((package, name) for package, found in _sets().items() for name in found):
        file = folder / package / f"{name}.py"
        if name in files:
            raise ImportError(f"{files[name]} and {file} both declare {name}")
        files[name] = file
    return {name: effect for found in _sets().values() for name, effect in found.items()}


def module_of(effect: Effect) -> ModuleType:
    """Import the file that declares an effect, a confounder or a fitted law."""
    package = next(name for name, found in _sets().items() if found.get(effect.name) is effect)
    return importlib.import_module(f"pzd.damper.{package}.{effect.name}")
