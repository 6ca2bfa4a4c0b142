"""The waveforms, one file each: a block of the config that gives a motion. Every module here is found by itself."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache

from pzd.rig.stand.waveform import Waveform


@cache
def waveforms() -> dict[str, type[Waveform]]:
    """The block of every kind of waveform, by its `kind`."""
    found = [importlib.import_module(f"{__name__}.{info.name}").WAVEFORM for info in pkgutil.iter_modules(__path__)]
    return {waveform.model_fields["kind"].default: waveform for waveform in found}
