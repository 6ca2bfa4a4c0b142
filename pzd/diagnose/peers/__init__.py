"""Published models that a damper is compared with, one file each; every module here is found by itself."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache

from pzd.diagnose.peer import Peer


@cache
def peers() -> dict[str, Peer]:
    """Every peer by name."""
    found = [importlib.import_module(f"{__name__}.{info.name}").PEER for info in pkgutil.iter_modules(__path__)]
    return {peer.name: peer for peer in sorted(found, key=lambda peer: peer.name)}
