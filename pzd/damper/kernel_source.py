"""The text of the module of compiled laws, each place composed as `pzd.damper.effect` says."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from pzd.damper.columns import DRIVE, PARALLEL, STROKE_AND_FLOW, Column, acting
from pzd.damper.competing_forms import module_of
from pzd.damper.effect import Effect
from pzd.damper.laws import ELEMENT, arguments, functions

_WIDTH = len(ELEMENT) + len(STROKE_AND_FLOW)


def _has(place_effects: Sequence[Effect], name: str) -> list[Effect]:
    return [effect for effect in place_effects if name in functions(effect, module_of(effect))]


def _place(column: Column) -> str:
    """A column as the generated code reads it."""
    if column in STROKE_AND_FLOW:
        return f"p[{len(ELEMENT) + STROKE_AND_FLOW.index(column)}]"
    return f"p[{(DRIVE if column in DRIVE else PARALLEL).index(column)}]"


def _call(effect: Effect, name: str, **quantities: str) -> str:
    """A law with what it asks for: quantities of the caller, and the effect's own parameters."""
    own = {parameter.name: _place((effect.name, parameter.name)) for parameter in effect.parameters}
    given = {**own, **quantities}
    return f"_{effect.name}_{name}({', '.join(given[argument] for argument in _takes(effect, name))})"


def _takes(effect: Effect, name: str) -> tuple[str, ...]:
    return arguments(functions(effect, module_of(effect))[name])


def _on(effect: Effect) -> str:
    """Whether an effect acts: one of its parameters is not neutral."""
    return " or ".join(f"{_place((effect.name, p.name))} != {p.neutral!r}" for p in effect.parameters)


def _none_on(effects: Sequence[Effect]) -> str:
    return " and ".join(f"not ({_on(effect)})" for effect in effects) or "True"


def _function(head: str, *lines: str) -> list[str]:
    return ["@compiled", f"def {head}:", *(f"    {line}" for line in lines)]


def _guarded(effect: Effect, *lines: str) -> list[str]:
    return [f"if {_on(effect)}:", *(f"    {line}" for line in lines)]


def _tuple(entry: str) -> str:
    """A tuple with one entry a column of a parameter row, `#` being the column's place."""
    return f"({', '.join(entry.replace('#', str(i)) for i in range(_WIDTH))},)"


def _rows() -> Iterator[str]:
    stroke = {effect.name for effect in acting("stroke")}
    moved = [len(ELEMENT) + i for i, (name, _) in enumerate(STROKE_AND_FLOW) if name in stroke]
    yield from _function("mix(a, b, share)", "return a if a == b else a + (b - a) * share")  # equal infinities stand
    yield from _function("interpolate(p, q, t)", f"return {_tuple('mix(p[#], q[#], t)')}")
    yield from _function("row_of(a)", f"return {_tuple('a[#]')}")
    yield from _function("nudged(p, i, by)", f"return {_tuple('p[#] + (by if i == # else 0.0)')}")
    same = " and ".join(f"p[{i}] == q[{i}]" for i in moved) or "True"
    yield from _function("stroke_moves(p, q)", f"return not ({same})")
    alike = " and ".join(f"p[{i}] == q[{i}]" for i in range(len(ELEMENT), _WIDTH)) or "True"
    yield from _function("effects_alike(p, q)", f"return {alike}")
    yield from _function("plain(p)", f"return {_none_on([*acting('stroke'), *acting('flow')])}")


def _drive() -> Iterator[str]:
    """Each effect takes what the one before gives; `state` is what each gave last."""
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
    effects = acting("stroke")
    out, back, slope = [], [], ["slope = 1.0"]
    for effect in effects:
        out += _guarded(effect, f"e = {_call(effect, 'law', deflection='e', side='side')}")
        if "slope" in functions(effect, module_of(effect)):
            slope += _guarded(effect, f"slope *= {_call(effect, 'slope', deflection='e', side='side')}")
        slope += _guarded(effect, f"e = {_call(effect, 'law', deflection='e', side='side')}")
    for effect in reversed(effects):
        back += _guarded(effect, f"s = {_call(effect, 'inverse', extension='s', side='side')}")
    bent = _has(effects, "slope")
    yield from _function("stroke_law(e, side, p)", *out, "return e")
    yield from _function("stroke_inverse(s, side, p)", *back, "return s")
    yield from _function("stroke_slope(e, side, p)", *(slope if bent else ["slope = 1.0"]), "return slope")
    yield from _function("stroke_straight(p)", f"return {_none_on(bent)}")


def _flow() -> Iterator[str]:
    effects = acting("flow")
    for name in ("direction_factor", "bleed_factor"):
        factors = [f"factor *= {_call(e, name, side='side')}" for e in _has(effects, name)]
        yield from _function(f"{name}(side, p)", "factor = 1.0", *factors, "return factor")
    yield from _yield(_has(effects, "yield_force"))
    yield from _viscous(_has(effects, "viscous_force"))
    yield from _extra(_has(effects, "extra_force"))
    lines = ["edge, slope = math.inf, 1.0"]
    for effect in _has(effects, "opens_at"):
        opens, beyond = (_call(effect, name, T0="T0", side="side") for name in ("opens_at", "slope_beyond"))
        lines += _guarded(effect, f"at = {opens}", "if at < edge:", f"    edge, slope = at, {beyond}")
    yield from _function("relief_of(T0, side, p)", *lines, "return edge, slope")


def _yield(effects: Sequence[Effect]) -> Iterator[str]:
    """In the order in which they act, each takes what the one before made of T0; a law is in proportion to it."""
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
    """In the order in which they act, each takes viscous force / C of the one before as its speed."""
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
    force = [line for e in effects for line in _guarded(e, f"force += {_call(e, 'extra_force', w='w')}")]
    slope = [line for e in effects for line in _guarded(e, f"slope += {_call(e, 'extra_slope', w='w')}")]
    closed = []
    for effect in _has(effects, "extra_speed"):
        others = _none_on([other for other in effects if other is not effect])
        closed += [f"if {others}:", f"    return {_call(effect, 'extra_speed', force='force', C='C')}"]
    yield from _function("extra_force(w, p)", "force = 0.0", *force, "return force")
    yield from _function("extra_slope(w, p)", "slope = 0.0", *slope, "return slope")
    yield from _function("extra_speed(force, C, p)", *closed, "return -1.0")
    yield from _function("extra_none(p)", f"return {_none_on(effects)}")


def _parallel() -> Iterator[str]:
    terms = [_call(effect, "law", x="x", v="v", a="a") for effect in acting("parallel")]
    yield from _function("parallel_force(x, v, a, p)", f"return {' + '.join(terms) or '0.0'}")
    yield from _function(
        "fill_parallel(x, v, a, rows, force)",
        "for i in range(x.size):",
        "    force[i] = parallel_force(x[i], v[i], a[i], rows[min(i, rows.shape[0] - 1)])",
    )


def _branch() -> Iterator[str]:
    """Each has its own elastic deflection, `state[i]`; all go with the rod, and their forces add."""
    follow, stored, steady = [], [], []
    force: list[str] = []
    for i, effect in enumerate(acting("branch")):
        own, law = f"state[{i}]", _call(effect, "law", deflection="e")
        after = f"e = {_call(effect, 'advance', deflection=own, travel='travel')}"
        follow += _guarded(effect, after, f"{own} = e")
        force += _guarded(effect, after, f"force += {law}")
        stored += _guarded(effect, after, f"force += {law} * {_call(effect, 'rate', deflection='e', side='side')}")
        slipping = _call(effect, "advance", deflection="0.0", travel="side * inf")
        steady += _guarded(effect, f"e = {slipping}", f"force += {law}")
    yield from _function("branches_follow(travel, state, p)", *follow, "return")
    yield from _function("branch_force(travel, state, p)", "force = 0.0", *force, "return force")
    yield from _function("branch_stored(travel, side, state, p)", "force = 0.0", *stored, "return force")
    yield from _function("branch_steady(side, p)", "force = 0.0", *steady, "return force")


def source() -> str:
    """The text of the module."""
    lines = ["import math", "from math import inf", "from pzd.compiled import compiled"]
    for place in ("drive", "stroke", "flow", "parallel", "branch"):
        for effect in acting(place):
            module = module_of(effect)
            lines.append(f"import {module.__name__} as _{effect.name}")
            lines += [f"_{effect.name}_{name} = compiled(_{effect.name}.{name})" for name in functions(effect, module)]
    return "\n".join([*lines, *_rows(), *_drive(), *_stroke(), *_flow(), *_parallel(), *_branch(), ""])
