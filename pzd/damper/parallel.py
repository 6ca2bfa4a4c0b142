"""The forces beside the element: the sum of all parallel effects in the library, and of the foils.

The sum is written out as a module of its own in the kernel cache, so that a new parallel effect
is one new file and still one compiled loop.
"""

from __future__ import annotations

import importlib.util
import os
import sys
import tempfile
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from pzd.compiled import cache_folder
from pzd.damper.competing_forms import competing_forms, known

Array = NDArray[np.float64]

COLUMNS = tuple(
    (effect.name, parameter.name)
    for effect in known().values()
    if effect.place == "parallel"
    for parameter in effect.parameters
)
"""The columns of a row of parallel parameters: effect and parameter."""


def _source() -> str:
    effects = sorted({effect for effect, _ in COLUMNS})
    terms = [
        f"_{effect}(x, v, a, {', '.join(f'p[{i}]' for i, (name, _) in enumerate(COLUMNS) if name == effect)})"
        for effect in effects
    ]
    return "\n".join(
        [
            "from pzd.compiled import compiled",
            *(
                f"from pzd.damper.{'competing_forms' if effect in competing_forms() else 'effects'} import {effect}"
                for effect in effects
            ),
            *(f"_{effect} = compiled({effect}.law)" for effect in effects),
            "@compiled",
            "def parallel_force(x, v, a, p):",
            f"    return {' + '.join(terms)}",
            "@compiled",
            "def fill_parallel(x, v, a, rows, force):",
            "    for i in range(x.size):",
            "        force[i] = parallel_force(x[i], v[i], a[i], rows[min(i, rows.shape[0] - 1)])",
            "",
        ]
    )


def _load() -> ModuleType:
    path = cache_folder() / "parallel_effects.py"
    if not path.exists():
        handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".tmp")
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(_source())
        Path(temporary).replace(path)
    spec = importlib.util.spec_from_file_location("pzd_parallel_effects", path)
    if spec is None or spec.loader is None:
        raise ImportError(f"cannot load {path}")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # a cached kernel finds its module by name
    spec.loader.exec_module(module)
    return module


_MODULE = _load()

parallel_force = _MODULE.parallel_force
"""Compiled: force [N] beside the element at one x [m], v [m/s], a [m/s2] and one row of parameters."""


def parallel_forces(x: Array, v: Array, a: Array, rows: Array) -> Array:
    """(n,) force [N] beside the element at (n,) x [m], v [m/s], a [m/s2] and (n, m) or (1, m) rows."""
    force = np.empty(x.size)
    _MODULE.fill_parallel(x, v, a, rows, force)
    return force
