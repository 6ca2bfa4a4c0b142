"""Which functions an effect file holds in each place, and whether it keeps to them."""

from __future__ import annotations

import inspect
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from types import ModuleType

from pzd.damper.effect import Effect, Place

ELEMENT = ("T0", "C", "k")
"""Parameters of the element, whose names no parameter of an effect may take."""
NODES = "at_voltage_V"
"""Key of the voltages at which an effect's parameters are given in a config."""


@dataclass(frozen=True)
class Law:
    """One function that an effect file may hold."""

    quantities: tuple[str, ...]
    """What it may take besides the effect's own parameters."""
    beside: tuple[str, ...] = ()
    """Functions that must stand beside it."""
    alone: bool = True
    """Whether it makes an effect; False where it only stands beside one that does."""


LAWS: Mapping[Place, Mapping[str, Law]] = {
    "drive": {
        "law": Law(("effective", "before", "now", "step"), ("rate",)),
        "rate": Law(("effective", "now", "rate"), alone=False),
    },
    "material": {
        name: Law(("temperature", "reference")) for name in ("friction_factor", "damping_factor", "stiffness_factor")
    },
    "stroke": {
        "law": Law(("deflection", "side"), ("inverse",)),
        "inverse": Law(("extension", "side"), alone=False),
        "slope": Law(("deflection", "side"), alone=False),
    },
    "flow": {
        "direction_factor": Law(("side",)),
        "bleed_factor": Law(("side",)),
        "yield_force": Law(("w", "T0"), ("yield_slope",)),
        "yield_slope": Law(("w", "T0"), alone=False),
        "viscous_force": Law(("w", "C"), ("viscous_slope", "viscous_speed")),
        "viscous_slope": Law(("w", "C"), alone=False),
        "viscous_speed": Law(("viscous", "C"), alone=False),
        "extra_force": Law(("w",), ("extra_slope",)),
        "extra_slope": Law(("w",), alone=False),
        "extra_speed": Law(("force", "C"), alone=False),
        "opens_at": Law(("T0", "side"), ("slope_beyond",)),
        "slope_beyond": Law(("side",), alone=False),
    },
    "parallel": {"law": Law(("x", "v", "a"))},
    "branch": {
        "advance": Law(("deflection", "travel"), ("law", "rate")),
        "law": Law(("deflection",), ("advance",)),
        "rate": Law(("deflection", "side"), alone=False),
    },
    "sensor": {"law": Law(("time",))},
}
"""By place and name; `pzd.damper.effect` says what each gives."""


def functions(effect: Effect, module: ModuleType) -> dict[str, Callable[..., float]]:
    """The functions that a file holds for its effect, by name."""
    return {name: vars(module)[name] for name in LAWS[effect.place] if callable(vars(module).get(name))}


@cache
def arguments(function: Callable[..., float]) -> tuple[str, ...]:
    """Names of what a function takes."""
    return tuple(inspect.signature(function).parameters)


def declared(module: ModuleType) -> Effect:
    """The effect that a file declares.

    Raises
    ------
    ImportError : when it declares none, or breaks a rule of `pzd.damper.effect`; with the name of the file
    """
    effect = vars(module).get("EFFECT")
    if not isinstance(effect, Effect):
        raise ImportError(f"{module.__file__}: declares no EFFECT")  # noqa: TRY004  # what fails is the import
    faults = "; ".join(_faults(effect, module))
    if faults:
        raise ImportError(f"{module.__file__}: {faults}")
    return effect


def _faults(effect: Effect, module: ModuleType) -> Iterator[str]:
    own = [parameter.name for parameter in effect.parameters]
    yield from (f"parameter {name} is declared twice" for name, count in Counter(own).items() if count > 1)
    if effect.place not in LAWS:
        yield f"there is no place {effect.place}, but {', '.join(LAWS)}"
        return
    taken = {quantity for law in LAWS[effect.place].values() for quantity in law.quantities}
    yield from (f"parameter {name} has the name of a quantity that its law takes" for name in own if name in taken)
    yield from (
        f"parameter {name} has a name of the element's ({', '.join((*ELEMENT, NODES))}), see {_model_file()}"
        for name in own
        if name in (*ELEMENT, NODES)
    )
    laws, held = LAWS[effect.place], functions(effect, module)
    if not any(laws[name].alone for name in held):
        yield f"an effect of the {effect.place} needs {' or '.join(name for name, law in laws.items() if law.alone)}"
    for name, function in held.items():
        yield from (f"{other} must stand beside {name}" for other in laws[name].beside if other not in held)
        known = (*laws[name].quantities, *own)
        yield from (
            f"{name} takes {', '.join(known) or 'nothing'} (got {argument})"
            for argument in arguments(function)
            if argument not in known
        )


def _model_file() -> str:
    from pathlib import Path

    return str(Path(__file__).parent.parent / "model.py")
