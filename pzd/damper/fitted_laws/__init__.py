"""Laws of the element that identify fits instead of T0 + C w, named by `identify.law` of the config.

They are no effects of the library: diagnose does not search for them, and the benchmark does not hide them. One file
each, written as an effect is; every module here is found by discovery.
"""

from __future__ import annotations

import pkgutil
from functools import cache

from pzd.damper.effect import Effect
from pzd.damper.effects import effects_in


@cache
def fitted_laws() -> dict[str, Effect]:
    """Return every fitted law by name."""
    return {effect.name: effect for effect in effects_in(__name__, pkgutil.iter_modules(__path__))}
