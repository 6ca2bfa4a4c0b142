"""The policies, one file each: what force is asked of the dampers. Every module here is found by itself."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache

from pzd.simulate.policy import Policy


@cache
def policies() -> dict[str, Policy]:
    """Every policy by name."""
    found = [importlib.import_module(f"{__name__}.{info.name}").POLICY for info in pkgutil.iter_modules(__path__)]
    return {policy.name: policy for policy in found}
