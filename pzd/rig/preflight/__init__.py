"""What a test engineer would ask of a record before trusting it, one file a check.

A check is `check(test) -> list[Finding]`. Nothing here changes a record.
"""

from __future__ import annotations

import pkgutil
from functools import lru_cache
from importlib import import_module
from types import ModuleType

from pzd.artefacts import Finding
from pzd.rig.measured import Measured


@lru_cache(maxsize=1)
def checks() -> dict[str, ModuleType]:
    """Every check by its name, as found in this folder."""
    return {found.name: import_module(f"{__name__}.{found.name}") for found in pkgutil.iter_modules(__path__)}


def findings(test: Measured) -> tuple[Finding, ...]:
    """What every check found in one record, in the order of the checks' names."""
    return tuple(finding for module in checks().values() for finding in module.check(test))
