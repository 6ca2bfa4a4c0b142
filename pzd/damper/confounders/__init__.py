"""Competing forms: parallel forces outside the library, never named, that an effect must do better than.

A posterior over the library alone calls the least bad of its effects certain. An effect that does no better than
one of these is not, their fewer parameters counted. One file each; every module here is found by discovery.
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
    """Every competing form by name; all are parallel to the element."""
    return {effect.name: effect for effect in effects_in(__name__, pkgutil.iter_modules(__path__))}


@cache
def known() -> dict[str, Effect]:
    """Everything that a damper can be computed with: the library, the competing forms and the fitted laws.

    Raises
    ------
    ImportError : when two of them have one name
    """
    folder, files = Path(__file__).parent.parent, dict[str, Path]()
    sets = {"effects": library(), "confounders": confounders(), "fitted_laws": fitted_laws()}
    for package, name in ((package, name) for package, found in sets.items() for name in found):
        file = folder / package / f"{name}.py"
        if name in files:
            raise ImportError(f"{files[name]} and {file} both declare {name}")
        files[name] = file
    return {name: effect for found in sets.values() for name, effect in found.items()}


def module_of(effect: Effect) -> ModuleType:
    """The file that declares an effect, a competing form or a fitted law, imported."""
    sets = {"effects": library(), "fitted_laws": fitted_laws()}
    package = next((name for name, found in sets.items() if found.get(effect.name) is effect), "confounders")
    return importlib.import_module(f"pzd.damper.{package}.{effect.name}")
