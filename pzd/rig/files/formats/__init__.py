"""Readers of rig files, one file a format: `SUFFIXES`, and `read(path, entry, wanted) -> Sheet`.

A reader whose library is an extra imports it inside `read`.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from types import ModuleType

from pzd.rig.config import FilesEntry
from pzd.rig.files.sheet import Sheet, Wanted
from pzd.schema.errors import ConfigError

Reader = Callable[[Path, FilesEntry, Wanted], Sheet]

TEXT = "text"
"""The format of files whose ending no other format claims."""


@lru_cache(maxsize=1)
def formats() -> dict[str, ModuleType]:
    """Every format by its name, as found in this folder."""
    return {found.name: import_module(f"{__name__}.{found.name}") for found in pkgutil.iter_modules(__path__)}


def reader(path: Path, name: str | None, place: str) -> Reader:
    """The reader for a file: the one named, else the one that claims its ending, else text.

    Raises
    ------
    ConfigError : when no format has the name
    """
    if name is not None and name not in formats():
        raise ConfigError(f"{place}.format: no such format; there are {', '.join(formats())} (got {name!r})")
    ending = path.suffix.lower()
    claimed = next((n for n, module in formats().items() if ending in module.SUFFIXES), TEXT)
    chosen: Reader = formats()[name or claimed].read
    return chosen
