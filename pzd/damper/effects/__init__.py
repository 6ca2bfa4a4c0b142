"""The library of effects, one file each; every module here and in the folder of `PZD_EFFECTS` is found by discovery."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import get_args

from pzd.damper.effect import Effect, Place, declared_effect
from pzd.own_effects import VARIABLE, own_files, own_folder
from pzd.schema.errors import ConfigError

_OWN = own_folder()
if _OWN is not None:
    __path__.append(str(_OWN))


@cache
def library() -> dict[str, Effect]:
    """Return every effect by name, in the physical order of the places and by name within one.

    Raises
    ------
    ImportError : when a file breaks a rule of `pzd.damper.effect`, or two files declare one name
    ConfigError : when one of `PZD_EFFECTS` does, or that is no folder
    """
    _check_own()
    places = get_args(Place)
    found = sorted(effects_in(__name__, pkgutil.iter_modules(__path__)), key=lambda e: (places.index(e.place), e.name))
    unhidden = [e.name for e in found if e.hidden is None and e.never_named is None and not e.beside_gas]
    if unhidden:
        raise ImportError(f"{__path__[0]}/{unhidden[0]}.py: says not how the benchmark hides it (`hidden`)")
    return {effect.name: effect for effect in found}


def _check_own() -> None:
    """Refuse a user's effect files that break a rule: their faults are the user's, not the package's."""
    if _OWN is not None and not _OWN.is_dir():
        raise ConfigError(f"{VARIABLE}: there is no folder of that name; make it, or unset the variable (got {_OWN})")
    for file in own_files():
        if (taken := Path(__path__[0]) / file.name).is_file():
            raise ConfigError(f"{file}: the library has an effect of that name; rename file and effect ({taken})")
        try:
            effect = declared_effect(importlib.import_module(f"{__name__}.{file.stem}"))
        except Exception as error:
            raise ConfigError(f"{file}: is no effect file: {type(error).__name__}: {error}") from error
        if effect.name != file.stem:
            raise ConfigError(f"{file}: declares the effect {effect.name}, so it must be called {effect.name}.py")
        if effect.hidden is None and effect.never_named is None:
            raise ConfigError(f"{file}: says neither how the benchmark hides it (`hidden`) nor why no verdict names it")


@cache
def nameable() -> dict[str, Effect]:
    """Return the effects that a verdict may name; the benchmark hides them, but for those that need a gas."""
    return {name: effect for name, effect in library().items() if effect.never_named is None}


def effects_in(package: str, modules: Iterable[pkgutil.ModuleInfo]) -> list[Effect]:
    """Return the effects that the modules of a package declare, one each.

    Raises
    ------
    ImportError : when a file breaks a rule of `pzd.damper.effect`, or is not called like its effect
    """
    found: dict[str, tuple[Effect, str | None]] = {}
    for info in modules:
        module = importlib.import_module(f"{package}.{info.name}")
        effect = declared_effect(module)
        if effect.name in found:
            raise ImportError(f"{found[effect.name][1]} and {module.__file__} both declare the effect {effect.name}")
        found[effect.name] = effect, module.__file__
    for effect, file in found.values():
        if file is not None and Path(file).stem != effect.name:
            raise ImportError(f"{file}: declares the effect {effect.name}, so it must be called {effect.name}.py")
    return [effect for effect, _ in found.values()]
