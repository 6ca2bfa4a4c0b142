"""The formats of `pzd export`, one file each: `FORMAT`; every module here is found by itself."""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING

from pzd.schema.errors import ConfigError

# ----------------------------------------------------------------------------------------------------
# What a file of `formats/` declares: what it is called, what it needs, and how it writes a damper.


if TYPE_CHECKING:
    from pzd.export.content import Content

Files = Mapping[str, bytes]
"""What is to be written, by the name of the file."""


@dataclass(frozen=True)
class Format:
    """One form in which another tool takes a damper."""

    name: str
    """As behind `--to`."""
    meaning: str
    """What it is for, in a few words."""
    files: Callable[[Content], Files]
    """The files; the same bytes for the same damper, and `Content.origin` in each, uncompressed.

    Raises ConfigError where the format cannot hold the damper.
    """
    needs: str | None = None
    """The library that writes it, an extra; None where pzd itself needs it anyway."""
    ending: str | None = None
    """Of the files' names, where how many there are depends on the damper; None where there are always the same."""


# ----------------------------------------------------------------------------------------------------


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
        from pzd.schema.model import nearest

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
