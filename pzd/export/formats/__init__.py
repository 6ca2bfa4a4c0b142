"""The formats of `pzd export`: a module declares one or a family in `FORMATS`, and every module is found by itself."""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING

from pzd.schema.errors import ConfigError

if TYPE_CHECKING:
    from pzd.export.content import Content
    from pzd.record import Record

Files = Mapping[str, bytes]
"""Contents by the name of the file."""


@dataclass(frozen=True)
class Format:
    """A form in which another tool takes a damper."""

    name: str
    """As behind `--to`."""
    meaning: str
    """What it is for, in a few words."""
    files: Callable[[Content], Files]
    """Returns the files: the same bytes for the same damper, and `Content.origin` in each, uncompressed.

    Raises ConfigError where the format cannot hold the damper.
    """
    certified: Callable[[Content, Sequence[Record], Mapping[str, str]], Files] | None = None
    """Returns the same files with a certificate: what was exported, run beside pzd on the records; by these versions.

    None where there is nothing to run.
    """
    needs: str | None = None
    """The library that writes it, an extra; None where pzd itself needs it anyway."""
    dynamics: bool = False
    """Whether it holds more of the damper than its table, which is all that there is of a measured curve."""
    adjustable: bool = False
    """Whether there is nothing to write of a damper without a second value of the control signal."""
    ending: str | None = None
    """Ending of the files' names where their number depends on the damper; None where it does not."""


@lru_cache(maxsize=1)
def formats() -> dict[str, Format]:
    """Return every format by its name."""
    modules = [import_module(f"{__name__}.{info.name}") for info in pkgutil.iter_modules(__path__)]
    found = [one for module in modules for one in module.FORMATS]
    return {one.name: one for one in sorted(found, key=lambda one: one.name)}


def format_of(name: str) -> Format:
    """Return the format of a name.

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
