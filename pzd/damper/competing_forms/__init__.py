"""Competing forms: parallel forces outside the library, never named, that an effect must do better than.

A posterior over the library alone calls the least bad of its effects certain. An effect that does no better than
one of these is not, their fewer parameters counted. One file each; every module here is found by discovery.
"""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache
from types import ModuleType

from pzd.damper.effect import Effect
from pzd.damper.effects import effects_in, library


@cache
def competing_forms() -> dict[str, Effect]:
    """Every competing form by name; all are parallel to the element."""
    return {effect.name: effect for effect in effects_in(__name__, pkgutil.iter_modules(__path__))}


@cache
def known() -> dict[str, Effect]:
    """Everything that a damper can be computed with: the library, and the competing forms.

    Raises
    ------
    ImportError : when a competing form has the name of an effect of the library
    """
    for name in competing_forms().keys() & library().keys():
        raise ImportError(f"{module_of(library()[name]).__file__} and {__path__[0]}/{name}.py both declare {name}")
    return {**library(), **competing_forms()}


def module_of(effect: Effect) -> ModuleType:
    """The file that declares an effect or a competing form, imported."""
    package = "effects" if library().get(effect.name) is effect else "competing_forms"
    return importlib.import_module(f"pzd.damper.{package}.{effect.name}")
