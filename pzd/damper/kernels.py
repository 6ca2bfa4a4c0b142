"""The compiled laws of every effect found.

They are written out as a module of its own (`kernel_source`) in the kernel cache, so that a new effect is one new
file and still compiled into the loops of the damper and of the car.
"""

from __future__ import annotations

import importlib.util
import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np

from pzd.compiled import cache_folder
from pzd.damper.columns import acting
from pzd.damper.kernel_source import source
from pzd.damper.laws import ELEMENT
from pzd.record import Array

Row = tuple[float, ...]
"""Parameters at one moment: T0 [N], C [N s/m], k [N/m], then those of `columns.STROKE_AND_FLOW`."""

T0, C, K = range(len(ELEMENT))
"""The first places in a parameter row."""
FLOW = len(ELEMENT) + sum(len(effect.parameters) for effect in acting("stroke"))
"""The first place of a flow effect, behind those of the stroke."""


def _load() -> ModuleType:
    path = cache_folder() / "damper_kernels.py"
    if not path.exists():
        handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".tmp")
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(source())
        Path(temporary).replace(path)
    spec = importlib.util.spec_from_file_location("pzd_damper_kernels", path)
    if spec is None or spec.loader is None:
        raise ImportError(f"cannot load {path}")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # a cached kernel finds its module by name
    spec.loader.exec_module(module)
    return module


_MODULE = _load()

interpolate: Callable[[Row, Row, float], Row] = _MODULE.interpolate
"""The parameter row at a share of the way from one to the other."""
row_of: Callable[[Array], Row] = _MODULE.row_of
"""An array as a parameter row."""
nudged: Callable[[Row, int, float], Row] = _MODULE.nudged
"""The parameter row with one of its columns changed by so much."""
stroke_moves: Callable[[Row, Row], bool] = _MODULE.stroke_moves
"""Whether two rows differ in a parameter of a stroke effect."""
effects_alike: Callable[[Row, Row], bool] = _MODULE.effects_alike
"""Whether two rows differ in T0, C and k alone."""
plain: Callable[[Row], bool] = _MODULE.plain
"""Whether no stroke or flow effect acts: the element of the paper alone."""

follow_voltage: Callable[[float, float, float, Array, Array], float] = _MODULE.follow_voltage
"""Effective voltage [V] when the signal has gone linearly from `before` to `now` [V] in a step [s]; (d,) voltages
behind each drive effect [V], changed in place, and the row of the drive."""
effective_voltage_after: Callable[[float, float, Array, Array], tuple[float, float]] = _MODULE.effective_voltage_after
"""Effective voltage [V] and its rate [V/s] a time [s] after a voltage [V] was set; (d,) voltages behind each drive
effect when it was set [V], and the row of the drive."""

keep_voltage: Callable[[float, float, Array, Array], None] = _MODULE.keep_voltage
"""Advance the (d,) voltages behind each drive effect [V] to a time [s] after a voltage [V] was set."""

stroke_law: Callable[[float, float, Row], float] = _MODULE.stroke_law
"""Extension of the oil spring [m] at an elastic deflection [m] on a side; below zero inside a free play."""
stroke_inverse: Callable[[float, float, Row], float] = _MODULE.stroke_inverse
"""Elastic deflection [m] at an extension of the oil spring [m] on a side."""
stroke_slope: Callable[[float, float, Row], float] = _MODULE.stroke_slope
"""Derivative of `stroke_law` by the deflection."""
stroke_straight: Callable[[Row], bool] = _MODULE.stroke_straight
"""Whether that slope is 1 everywhere."""

direction_factor: Callable[[float, Row], float] = _MODULE.direction_factor
"""Factor on T0 and C by the sign of the force."""
bleed_factor: Callable[[float, Row], float] = _MODULE.bleed_factor
"""Factor on C alone by the sign of the force."""
yield_force: Callable[[float, float, Row], float] = _MODULE.yield_force
"""Friction [N] at a flow speed [m/s] and T0 [N]."""
yield_slope: Callable[[float, float, Row], float] = _MODULE.yield_slope
"""Derivative of `yield_force` by the speed [N s/m]."""
yield_sharp: Callable[[Row], bool] = _MODULE.yield_sharp
"""Whether the friction is T0 at every speed."""
viscous_force: Callable[[float, float, Row], float] = _MODULE.viscous_force
"""Viscous force [N] at a flow speed [m/s] and C [N s/m]."""
viscous_slope: Callable[[float, float, Row], float] = _MODULE.viscous_slope
"""Derivative of `viscous_force` by the speed [N s/m]."""
viscous_speed: Callable[[float, float, Row], float] = _MODULE.viscous_speed
"""Flow speed [m/s] at a viscous force [N] and C [N s/m]."""
viscous_straight: Callable[[Row], bool] = _MODULE.viscous_straight
"""Whether the viscous force is C w."""
extra_force: Callable[[float, Row], float] = _MODULE.extra_force
"""Force beside friction and viscous force [N] at a flow speed [m/s]."""
extra_slope: Callable[[float, Row], float] = _MODULE.extra_slope
"""Derivative of `extra_force` by the speed [N s/m]."""
extra_speed: Callable[[float, float, Row], float] = _MODULE.extra_speed
"""Flow speed [m/s] at which C w and the extra force together take a force [N]; -1 where there is no closed form."""
extra_none: Callable[[Row], bool] = _MODULE.extra_none
"""Whether there is no extra force."""
relief_of: Callable[[float, float, Row], tuple[float, float]] = _MODULE.relief_of
"""Force from which a valve is open [N] and the slope beyond [N s/m], by T0 [N] and side; the first to open counts."""

parallel_force: Callable[[float, float, float, Array], float] = _MODULE.parallel_force
"""Force [N] of what has no memory beside the element, at one x [m], v [m/s], a [m/s2] and one row of parameters."""

branches_follow: Callable[[float, Array, Array], None] = _MODULE.branches_follow
"""Bring the (b,) deflections of the branches [m] through a travel of the rod to one side [m], in place; one row."""
branch_force: Callable[[float, Array, Array], float] = _MODULE.branch_force
"""Force of the branches [N] after a travel [m] from (b,) deflections [m], which stay as they are; one row."""
branch_stored: Callable[[float, float, Array, Array], float] = _MODULE.branch_stored
"""The part of `branch_force` [N] whose work on a rod that goes on to a side is stored; the rest slips."""
branch_steady: Callable[[float, Array], float] = _MODULE.branch_steady
"""Force of the branches [N] at steady slip to a side; one row."""


def parallel_forces(x: Array, v: Array, a: Array, rows: Array) -> Array:
    """(n,) force [N] of what has no memory beside the element; (n,) x [m], v [m/s], a [m/s2], (n, m) or (1, m) rows."""
    force = np.empty(x.size)
    _MODULE.fill_parallel(x, v, a, rows, force)
    return force
