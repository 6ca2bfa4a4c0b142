"""The formats of `pzd export`, one file each: `FORMAT`; every module here is found by itself."""

from __future__ import annotations

import pkgutil
from functools import lru_cache
from importlib import import_module
from importlib.util import find_spec

from pzd.export.format import Format
from pzd.schema.errors import ConfigError


@lru_cache(maxsize=1)
def formats() -> dict[str, Format]:
    """Every format by its name."""
    found = [import_module(f"{__name__}.{info.name}").FORMAT for info in pkgutil.iter_modules(__path__)]
    return {one.name: one for one in sorted(found, key=lambda one: one.name)}


def format_of(name: str) -> Format:
    """The format of a name.

    Raises
    ------
    ConfigError : when there is none, or its library is not installed
    """
    if name not in formats():
        from pzd.schema.nearest import nearest

        near = nearest(name, formats())
        hint = f"; did you mean {near}?" if near else ""
        raise ConfigError(f"--to: no such format; there are {', '.join(formats())}{hint} (got {name})")
    found = formats()[name]
    if found.needs is not None and find_spec(found.needs) is None:
        raise ConfigError(
            f"--to {name}: {found.meaning}: it is written with {found.needs}, which is not installed; "
            "pip install 'pzd[formats]'"
        )
    return found
