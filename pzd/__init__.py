"""What a controlled damper's rig files say, what the model misses, and what the passengers feel.

The front door: arrays, DataFrames and dampers in and out, without a config and without a file.

    import pzd
    tests = [pzd.Test(time, displacement, force, voltage=100.0)]
    found = pzd.diagnose(tests)
    found.plot()
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:  # each is imported when it is first used: an import of the package takes no time
    from pzd.front.comparison import changes
    from pzd.front.dampers import Damper, table
    from pzd.front.records import Test, read
    from pzd.front.rides import ride
    from pzd.front.runs import load, run
    from pzd.front.stages import diagnose, identify
    from pzd.front.vibration import rate

__all__ = [
    "Damper",
    "Test",
    "changes",
    "diagnose",
    "identify",
    "load",
    "rate",
    "read",
    "ride",
    "run",
    "table",
]

_MODULES = {
    "comparison": ("changes",),
    "dampers": ("Damper", "table"),
    "records": ("Test", "read"),
    "rides": ("ride",),
    "runs": ("load", "run"),
    "stages": ("diagnose", "identify"),
    "vibration": ("rate",),
}
"""Modules of the front door by what each offers. No module of the package bears the name of one of these functions."""


def __getattr__(name: str) -> object:
    """Import what is asked for."""
    for module, offered in _MODULES.items():
        if name in offered:
            from importlib import import_module

            found = getattr(import_module(f".front.{module}", __name__), name)
            globals()[name] = found
            return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return what the front door offers beside what is imported already."""
    return sorted({*globals(), *__all__})
