"""Compiled laws of every effect found, composed place by place.

They are generated as a module of their own in the kernel cache, so that a new effect is one new file and still compiled
into the loops of the damper and of the car: numba compiles a function that takes functions as arguments anew in each
process, and one that calls them by name once for all.
"""

from __future__ import annotations

import importlib.util
import os
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import ModuleType

import numpy as np

from pzd.compiled import cache_folder, refuse_cache
from pzd.damper.compiled.columns import DRIVE, PARALLEL, STROKE_AND_FLOW, Column, acting
from pzd.damper.confounders import module_of
from pzd.damper.effect import ELEMENT, Effect, arguments, functions
from pzd.record import Array

# --- Source of the generated module, each place composed as `pzd.damper.effect` says ---

_WIDTH = len(ELEMENT) + len(STROKE_AND_FLOW)


def _has(place_effects: Sequence[Effect], name: str) -> list[Effect]:
    """Return the effects that hold a function of that name."""
    return [effect for effect in place_effects if name in functions(effect, module_of(effect))]


def _place(column: Column) -> str:
    """Return a column as the generated code reads it."""
    if column in STROKE_AND_FLOW:
        return f"p[{len(ELEMENT) + STROKE_AND_FLOW.index(column)}]"
    return f"p[{(DRIVE if column in DRIVE else PARALLEL).index(column)}]"


def _call(effect: Effect, name: str, **quantities: str) -> str:
    """Return a call of a law with its arguments: quantities of the caller and the effect's own parameters."""
    own = {parameter.name: _place((effect.name, parameter.name)) for parameter in effect.parameters}
    given = {**own, **quantities}
    return f"_{effect.name}_{name}({', '.join(given[argument] for argument in _takes(effect, name))})"


def _beside(effect: Effect) -> dict[str, str]:
    """Return the parameters of a flow effect as a row of the parallel forces holds them."""
    return {p.name: f"p[{PARALLEL.index((effect.name, p.name))}]" for p in effect.parameters}


def _takes(effect: Effect, name: str) -> tuple[str, ...]:
    """Return the arguments of a law."""
    return arguments(functions(effect, module_of(effect))[name])


def _on(effect: Effect, law: str | None = None) -> str:
    """Return the condition under which an effect acts, or one law of it: a parameter that it takes is not neutral."""
    taken = [p for p in effect.parameters if law is None or p.name in _takes(effect, law)]
    return " or ".join(f"{_place((effect.name, p.name))} != {p.neutral!r}" for p in taken)


def _none_on(effects: Sequence[Effect], law: str | None = None) -> str:
    """Return the condition under which none of some effects acts, or one law of theirs."""
    return " and ".join(f"not ({_on(effect, law)})" for effect in effects) or "True"


def _function(head: str, *lines: str) -> list[str]:
    """Return the lines of a compiled function."""
    return ["@compiled", f"def {head}:", *(f"    {line}" for line in lines)]


def _guarded(effect: Effect, *lines: str, law: str | None = None) -> list[str]:
    """Return lines that run only where an effect acts, or one law of it."""
    return [f"if {_on(effect, law)}:", *(f"    {line}" for line in lines)]


def _tuple(entry: str) -> str:
    """Return a tuple with one entry per column of a parameter row, `#` standing for the column's place."""
    return f"({', '.join(entry.replace('#', str(i)) for i in range(_WIDTH))},)"


def _rows() -> Iterator[str]:
    """Yield the functions of parameter rows."""
    stroke = {effect.name for effect in acting("stroke")}
    moved = [len(ELEMENT) + i for i, (name, _) in enumerate(STROKE_AND_FLOW) if name in stroke]
    yield from _function("mix(a, b, share)", "return a if a == b else a + (b - a) * share")  # equal infinities stand
    yield from _function("interpolate(p, q, t)", f"return {_tuple('mix(p[#], q[#], t)')}")
    yield from _function("row_of(a)", f"return {_tuple('a[#]')}")
    yield from _function("nudged(p, i, by)", f"return {_tuple('p[#] + (by if i == # else 0.0)')}")
    same = " and ".join(f"p[{i}] == q[{i}]" for i in moved) or "True"
    by_stiffness = [effect for effect in acting("stroke") if "k" in _takes(effect, "law")]
    same = f"{same} and (p[{K}] == q[{K}] or ({_none_on(by_stiffness)}))"
    yield from _function("stroke_moves(p, q)", f"return not ({same})")
    alike = " and ".join(f"p[{i}] == q[{i}]" for i in range(len(ELEMENT), _WIDTH)) or "True"
    yield from _function("effects_alike(p, q)", f"return {alike}")
    yield from _function("no_effects(p)", f"return {_none_on([*acting('stroke'), *acting('flow')])}")


def _drive() -> Iterator[str]:
    """Yield the drive: each effect takes the voltage of the one before; `state` is what each gave last."""
    effects = acting("drive")
    step, after, kept = [], [], []
    for i, effect in enumerate(effects):
        own = f"state[{i}]"
        law = _guarded(effect, f"given = {_call(effect, 'law', effective=own, before='late', now='now', step='step')}")
        rate = _guarded(effect, f"moving = {_call(effect, 'rate', effective='given', now='now', rate='moving')}")
        step += ["given = now", *law, f"late, now, {own} = {own}, given, given"]
        immediate = _call(effect, "law", effective=own, before="late", now="late", step="0.0")
        jump = [f"late = {immediate}"] if any("before" in _takes(other, "law") for other in effects[i + 1 :]) else []
        after += ["given = now", *law, *rate, *(_guarded(effect, *jump) if jump else []), "now = given"]
        kept += ["given = now", *law, *(_guarded(effect, *jump) if jump else []), f"now, {own} = given, given"]
    yield from _function("follow_voltage(before, now, step, state, p)", "late = before", *step, "return now")
    head = "late, now, moving = voltage, voltage, 0.0"
    yield from _function("effective_voltage_after(voltage, step, state, p)", head, *after, "return now, moving")
    yield from _function("keep_voltage(voltage, step, state, p)", "late, now = voltage, voltage", *kept)


def _stroke() -> Iterator[str]:
    """Yield the stroke: each effect takes the deflection that the one before leaves."""
    effects = acting("stroke")
    out, back, slope, k = [], [], ["slope = 1.0"], f"p[{K}]"
    for effect in effects:
        out += _guarded(effect, f"e = {_call(effect, 'law', deflection='e', side='side', k=k)}")
        if "slope" in functions(effect, module_of(effect)):
            slope += _guarded(effect, f"slope *= {_call(effect, 'slope', deflection='e', side='side', k=k)}")
        slope += _guarded(effect, f"e = {_call(effect, 'law', deflection='e', side='side', k=k)}")
    for effect in reversed(effects):
        back += _guarded(effect, f"s = {_call(effect, 'inverse', extension='s', side='side', k=k)}")
    bent = _has(effects, "slope")
    yield from _function("stroke_law(e, side, p)", *out, "return e")
    yield from _function("stroke_inverse(s, side, p)", *back, "return s")
    yield from _function("stroke_slope(e, side, p)", *(slope if bent else ["slope = 1.0"]), "return slope")
    yield from _function("stroke_straight(p)", f"return {_none_on(bent)}")


def _flow() -> Iterator[str]:
    """Yield the flow curve."""
    effects = acting("flow")
    for name in ("direction_factor", "bleed_factor"):
        factors = [f"factor *= {_call(e, name, side='side')}" for e in _has(effects, name)]
        yield from _function(f"{name}(side, p)", "factor = 1.0", *factors, "return factor")
    yield from _yield(_has(effects, "yield_force"))
    yield from _viscous(_has(effects, "viscous_force"))
    yield from _extra(_has(effects, "extra_force"))
    lines = ["edge, slope, spread = math.inf, 1.0, 0.0"]
    for effect in _has(effects, "opens_at"):
        opens, beyond = (_call(effect, name, T0="T0", side="side") for name in ("opens_at", "slope_beyond"))
        about = _call(effect, "spread", side="side") if effect in _has(effects, "spread") else "0.0"
        taken = f"    edge, slope, spread = at, {beyond}, {about}"
        lines += _guarded(effect, f"at = {opens}", "if at < edge:", taken)
    yield from _function("relief_of(T0, side, p)", *lines, "return edge, slope, spread")


def _yield(effects: Sequence[Effect]) -> Iterator[str]:
    """Yield the friction: each effect takes the T0 of the one before, to which its law is proportional."""
    force: list[str] = []
    slope = ["slope = 0.0"]
    for i, effect in enumerate(effects):
        law = _call(effect, "yield_force", w="w", T0="T0")
        own, passed = _call(effect, "yield_slope", w="w", T0="T0"), _call(effect, "yield_force", w="w", T0="slope")
        force += _guarded(effect, f"T0 = {law}")
        slope += _guarded(effect, f"slope = {own}{f' + {passed}' if i else ''}", f"T0 = {law}")
    yield from _function("yield_force(w, T0, p)", *force, "return T0")
    yield from _function("yield_slope(w, T0, p)", *slope, "return slope")
    yield from _function("yield_sharp(p)", f"return {_none_on(effects)}")


def _viscous(effects: Sequence[Effect]) -> Iterator[str]:
    """Yield the viscous force: each effect takes viscous force / C of the one before as its speed."""
    force, slope, back = ["s = C * w"], ["s, slope = C * w, C"], []
    for i, effect in enumerate(effects):
        speed = "s / C" if i else "w"
        law, own = _call(effect, "viscous_force", w=speed, C="C"), _call(effect, "viscous_slope", w=speed, C="C")
        force += _guarded(effect, f"s = {law}")
        slope += _guarded(effect, f"slope = {own}{' * slope / C' if i else ''}", f"s = {law}")
    for i, effect in reversed(list(enumerate(effects))):
        law = _call(effect, "viscous_speed", viscous="s", C="C")
        back += _guarded(effect, f"s = C * {law}" if i else f"return {law}")
    yield from _function("viscous_force(w, C, p)", *force, "return s")
    yield from _function("viscous_slope(w, C, p)", *slope, "return slope")
    yield from _function("viscous_speed(s, C, p)", *back, "return s / C")
    yield from _function("viscous_straight(p)", f"return {_none_on(effects)}")


def _extra(effects: Sequence[Effect]) -> Iterator[str]:
    """Yield the extra force, a sum; an effect that does more to the curve may add none."""
    law, force, slope, closed = "extra_force", list[str](), list[str](), list[str]()
    for effect in effects:
        force += _guarded(effect, f"force += {_call(effect, law, w='w', side='side')}", law=law)
        slope += _guarded(effect, f"slope += {_call(effect, 'extra_slope', w='w', side='side')}", law=law)
    for effect in _has(effects, "extra_speed"):
        others = _none_on([other for other in effects if other is not effect], law)
        closed += [f"if {others}:", f"    return {_call(effect, 'extra_speed', force='force', C='C', side='side')}"]
    yield from _function("extra_force(w, side, p)", "force = 0.0", *force, "return force")
    yield from _function("extra_slope(w, side, p)", "slope = 0.0", *slope, "return slope")
    yield from _function("extra_speed(force, C, side, p)", *closed, "return -1.0")
    yield from _function("extra_none(p)", f"return {_none_on(effects, law)}")


def _parallel() -> Iterator[str]:
    """Yield the parallel forces without memory, a sum."""
    terms: list[str] = []
    for effect in acting("parallel"):
        terms += _guarded(effect, f"force += {_call(effect, 'law', x='x', v='v', a='a')}")
    yield from _function("parallel_force(x, v, a, p)", "force = 0.0", *terms, "return force")
    yield from _function(
        "fill_parallel(x, v, a, rows, force)",
        "for i in range(x.size):",
        "    force[i] = parallel_force(x[i], v[i], a[i], rows[min(i, rows.shape[0] - 1)])",
    )


def _branch() -> Iterator[str]:
    """Yield the branches: each has its own elastic deflection, `state[i]`; all follow the rod, and their forces add.

    What scales T0 and C by the direction scales the force of a branch by its own.
    """
    follow, stored, steady = [], [], []
    force: list[str] = []
    turned = [
        f"f *= {_call(e, 'direction_factor', side='math.copysign(1.0, f)', **_beside(e))}"
        for e in _has(acting("flow"), "direction_factor")
    ]
    for i, effect in enumerate(acting("branch")):
        own, law = f"state[{i}]", [f"f = {_call(effect, 'law', deflection='e')}", *turned]
        after = f"e = {_call(effect, 'advance', deflection=own, travel='travel')}"
        follow += _guarded(effect, after, f"{own} = e")
        force += _guarded(effect, after, *law, "force += f")
        rate = _call(effect, "rate", deflection="e", side="side")
        stored += _guarded(effect, after, *law, f"force += f * {rate}")
        slipping = _call(effect, "advance", deflection="0.0", travel="side * inf")
        steady += _guarded(effect, f"e = {slipping}", *law, "force += f")
    yield from _function("branches_follow(travel, state, p)", *follow, "return")
    yield from _function("branch_force(travel, state, p)", "force = 0.0", *force, "return force")
    yield from _function("branch_stored(travel, side, state, p)", "force = 0.0", *stored, "return force")
    yield from _function("branch_steady(side, p)", "force = 0.0", *steady, "return force")


def source() -> str:
    """Return the source of the module."""
    lines = ["import math", "from math import inf", "from pzd.compiled import compiled, compiled_law"]
    for place in ("drive", "stroke", "flow", "parallel", "branch"):
        for effect in acting(place):
            module = module_of(effect)
            lines.append(f"import {module.__name__} as _{effect.name}")
            lines += [
                f"_{effect.name}_{name} = compiled_law(_{effect.name}.{name})" for name in functions(effect, module)
            ]
    return "\n".join([*lines, *_rows(), *_drive(), *_stroke(), *_flow(), *_parallel(), *_branch(), ""])


# --- The generated module ---

Row = tuple[float, ...]
"""Parameter row, see `pzd.damper.compiled`: T0 [N], C [N s/m], k [N/m], then those of `columns.STROKE_AND_FLOW`."""

T0, C, K = range(len(ELEMENT))
"""Places of the element in a parameter row."""
FLOW = len(ELEMENT) + sum(len(effect.parameters) for effect in acting("stroke"))
"""First place of a flow effect, after those of the stroke."""


def _load() -> ModuleType:
    """Import the generated module, written by the first process that needs it, and anew where it was damaged."""
    path, text = cache_folder() / "damper_kernels.py", source().encode()
    if not path.is_file() or path.read_bytes() != text:
        try:
            handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".tmp")
            with os.fdopen(handle, "wb") as file:
                file.write(text)
            Path(temporary).replace(path)
        except OSError as error:
            refuse_cache(path.parent, error)
    spec = importlib.util.spec_from_file_location("pzd_damper_kernels", path)
    if spec is None or spec.loader is None:
        raise ImportError(f"cannot load {path}")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # a cached kernel finds its module by name
    spec.loader.exec_module(module)
    return module


_MODULE = _load()

interpolate: Callable[[Row, Row, float], Row] = _MODULE.interpolate
"""Parameter row at a share of the way from one to the other."""
row_of: Callable[[Array], Row] = _MODULE.row_of
"""Parameter row of an (r,) array."""
nudged: Callable[[Row, int, float], Row] = _MODULE.nudged
"""Parameter row with an amount added to one of its columns."""
stroke_moves: Callable[[Row, Row], bool] = _MODULE.stroke_moves
"""Whether two rows differ in a parameter of a stroke effect."""
effects_alike: Callable[[Row, Row], bool] = _MODULE.effects_alike
"""Whether two rows differ in T0, C and k alone."""
no_effects: Callable[[Row], bool] = _MODULE.no_effects
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
"""Extension of the oil stiffness [m] at an elastic deflection [m] on a side; below zero inside a free play."""
stroke_inverse: Callable[[float, float, Row], float] = _MODULE.stroke_inverse
"""Elastic deflection [m] at an extension of the oil stiffness [m] on a side."""
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
extra_force: Callable[[float, float, Row], float] = _MODULE.extra_force
"""Force added to friction and viscous force [N] at a flow speed [m/s] and side."""
extra_slope: Callable[[float, float, Row], float] = _MODULE.extra_slope
"""Derivative of `extra_force` by the speed [N s/m]."""
extra_speed: Callable[[float, float, float, Row], float] = _MODULE.extra_speed
"""Flow speed [m/s] at which C w and the extra force together take a force [N]; -1 where there is no closed form."""
extra_none: Callable[[Row], bool] = _MODULE.extra_none
"""Whether there is no extra force."""
relief_of: Callable[[float, float, Row], tuple[float, float, float]] = _MODULE.relief_of
"""Force at which a valve opens [N], slope beyond [N s/m] and spread of that force [N], by T0 [N] and side; the first to
open counts."""

parallel_force: Callable[[float, float, float, Array], float] = _MODULE.parallel_force
"""Parallel force without memory [N] at one x [m], v [m/s], a [m/s2] and one row of the parallel effects."""

branches_follow: Callable[[float, Array, Array], None] = _MODULE.branches_follow
"""Advance the (b,) deflections of the branches [m] by a travel of the rod to one side [m], in place; one row."""
branch_force: Callable[[float, Array, Array], float] = _MODULE.branch_force
"""Force of the branches [N] after a travel [m] from (b,) deflections [m], which stay as they are; one row."""
branch_stored: Callable[[float, float, Array, Array], float] = _MODULE.branch_stored
"""The part of `branch_force` [N] whose work on a rod that goes on to a side is stored; the rest slips."""
branch_steady: Callable[[float, Array], float] = _MODULE.branch_steady
"""Force of the branches [N] at steady slip to a side; one row."""


def parallel_forces(x: Array, v: Array, a: Array, rows: Array) -> Array:
    """Compute the (n,) parallel force without memory [N] from (n,) x [m], v [m/s], a [m/s2], (n, m) or (1, m) rows."""
    force = np.empty(x.size)
    _MODULE.fill_parallel(x, v, a, rows, force)
    return force
