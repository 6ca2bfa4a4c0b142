"""What an effect file declares, which functions it holds, and whether it keeps to the rules.

An effect is one file in `effects/`, named like its effect: `EFFECT`, and the functions of its place. Nothing else names
it: parameter rows, kernels, stand, fit, table, half-car and benchmark follow from what the files declare. A function
takes by name what it needs of the quantities of its law (`LAWS`) and of the effect's own parameters; an effect that
breaks a rule is an ImportError with the file's name. All but those of `material` and `sensor` are compiled by numba:
they take and return numbers, and use `math` alone. Effects of one place act by `order`, then by name; with every
parameter at its neutral value an effect is left out.

drive
    `law`: effective voltage a step later, the incoming one going linearly from `before` to `now`; `rate`: its rate.
    Its state is the voltage that it gave last. Supply, valve and actuator; no force acts back on it.
material
    `friction_factor`, `damping_factor`, `stiffness_factor`: factors on T0, C and k by the recorded temperature.
stroke
    `law`: the extension of the oil stiffness, F = k extension, by the elastic deflection x - y, its side (+1 or -1)
    and k, rising; `inverse`; `slope` where it is not 1. A free play goes below zero on its side, and carries no force
    there. Whatever is in series with the oil stiffness and gives by the force alone has its place here: late filling, a
    compliant frame or mount, a gas volume that is compressed (accumulator, cavitation without its history).
flow
    One or more changes of the curve that gives the force by the flow speed w = |dy/dt| >= 0:
    |F| = yield(w) + viscous(w) + extra(w), and beyond the force that opens a valve a straight line. All rise with w.
    `direction_factor`: on T0, C and branches by the sign of F; `bleed_factor`: on C alone.
    `yield_force`, `yield_slope`: replace T0, in proportion to it.
    `viscous_force`, `viscous_slope`, `viscous_speed`: replace C w, in proportion to C; speed is the inverse.
    `extra_force`, `extra_slope`: added to both, 0 at w = 0, by the sign of F too; `extra_speed`: the flow speed at
    C w + extra, where there is a closed form. `opens_at`, `slope_beyond`: force beyond which the slope is another, by
    the sign of F too; `spread`: of the forces about that one at which it opens [N], 0 where it opens at once.
parallel
    `law`: force parallel to the element by x, v and a of the piston, without memory; with `needs_displacement_zero` a
    fit looks for the zero of x too.
branch
    A force parallel to the element that depends on the path of the rod, not on its speed: a spring behind a slip, a
    force of Dahl or of Bouc and Wen. `advance`: its elastic deflection after a travel of the rod to one side alone,
    from the deflection before; it has a limit for an infinite travel, which is steady slip. `law`: force by the
    deflection, 0 at 0; `rate`: derivative of the deflection by the travel, to a side (+1 or -1).
sensor
    `law`: the moment whose force the channel shows.
"""

from __future__ import annotations

import inspect
import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Literal

from pzd.quantities import BINGHAM

if TYPE_CHECKING:
    import numpy as np

Place = Literal["drive", "material", "stroke", "flow", "parallel", "branch", "sensor"]
"""Where in the damper an effect acts, in physical order."""

Need = Literal["voltage", "temperature"]
"""What must vary inside a test."""


LARGEST_FORCE = 1.0e8
"""Of any damper [N].

Reason: ten times that of the largest ones, in bridges; a value beyond is in another unit."""
LARGEST_DAMPING = 1.0e9
"""Of any damper [N s/m]: a tenth of that force, as of the largest ones, at 10 mm/s."""
LARGEST_SQUARE = 1.0e12
"""Force over the square of the speed of any damper [N s2/m2]: the largest force at 10 mm/s."""
FLOWING_WELL = (0.1, 0.9)
"""Shares of the way from T0 to the largest force of a condition between which a change of the flow shows well.

Reason: nearer to either end it acts on nearly all of the flow or on next to nothing. Not tuned."""


@dataclass(frozen=True)
class Scales:
    """Magnitudes of the signals of one rig, in which starting values of parameters are given."""

    force: float
    """Largest force [N]."""
    low_force: float
    """Largest force of the softest condition [N]."""
    speed: float
    """Largest extension speed [m/s]."""
    stroke: float
    """Largest displacement from the middle of the stroke [m]."""
    acceleration: float
    """Largest acceleration [m/s2]."""
    damping: float
    """Median C of the conditions [N s/m]."""
    voltage: float
    """Span of the control signal [V]."""
    flow: tuple[tuple[float, float], ...] = ()
    """T0 and the force at the largest speed of each condition [N]: between them its fluid flows."""


@dataclass(frozen=True)
class Search:
    """Starting values of a parameter in a fit, and the scale in which it steps."""

    scale: Callable[[Scales], float]
    """Scale of the parameter, by the magnitudes of the rig."""
    starts: tuple[float, ...]
    """Starting values, in that scale; every one is tried."""
    logarithmic: bool = False
    """Whether steps are ratios."""
    within: tuple[float, float] = (-math.inf, math.inf)
    """Smallest and largest value searched, in that scale."""
    flowing: bool = False
    """Whether it is a force at which the flow changes: it shows between T0 and the largest force of a condition alone,
    so that each needs a start there."""

    def starts_on(self, scales: Scales) -> tuple[float, ...]:
        """Return the starting values in scale on a rig of those magnitudes.

        Examples
        --------
        >>> scales = Scales(1500.0, 300.0, 0.1, 0.02, 1.0, 1000.0, 2.0, flow=((280.0, 410.0), (960.0, 1110.0)))
        >>> Search(lambda s: s.force, (0.25, 0.8), flowing=True).starts_on(scales)
        (0.25, 0.8, 0.69)
        """
        if not self.flowing:
            return self.starts
        size, found = self.scale(scales) or 1.0, list(self.starts)
        for friction, largest in scales.flow:
            low, high = (friction + share * (largest - friction) for share in FLOWING_WELL)
            if high > low and not any(low <= start * size <= high for start in found):
                found.append(0.5 * (low + high) / size)
        return tuple(found)


Strength = Callable[[float], dict[str, float]]
"""Parameters of an effect at a strength between 0 (next to nothing) and 1 (the most)."""
Hiding = Callable[["np.random.Generator", Scales], Strength]
"""Draws everything of an effect but its strength, on a rig of those magnitudes."""


def growing(name: str, most: Callable[[Scales], float], *, either: bool = False) -> Hiding:
    """Return the hiding of an effect of one parameter, which grows from 0 with the strength.

    Parameters
    ----------
    name : of the parameter
    most : its value at strength 1
    either : whether the sign is drawn, where the physics has no preference
    """

    def hiding(draw: np.random.Generator, scales: Scales) -> Strength:
        end = most(scales) * (float(draw.choice([-1.0, 1.0])) if either else 1.0)
        return lambda s: {name: end * s}

    return hiding


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect."""

    name: str
    """The symbol, as in configs, verdicts and files."""
    unit: str
    """SI unit; '-' for a pure number."""
    neutral: float
    """The value that switches the effect off."""
    low: float
    """Smallest admissible value."""
    high: float
    """Largest admissible value."""
    meaning: str
    search: Search
    """Starting values of a fit."""
    natural_from: float = -math.inf
    """Smallest physical value; a fit that goes below has found something that looks alike."""
    natural_to: float = math.inf
    """Largest physical value; a fit that goes beyond has found something that looks alike."""
    position: str = ""
    """Of a position along the stroke: the words between its value and the displacement it is counted from."""
    with_friction: bool = False
    """Whether it changes with the voltage as T0 does: it is fitted per voltage, in proportion to T0."""
    optional: bool = False
    """Whether a damper may leave it out and have the neutral value, as those that were written before it was there."""

    def admits(self, value: float) -> bool:
        """Return whether the value lies within the limits."""
        return math.isfinite(value) and self.low <= value <= self.high


def _always(values: Mapping[str, float], damping: float) -> bool:
    """Accept any values: the default of `Effect.natural`."""
    return True


EffectValues = Mapping[str, float | tuple[float, ...]]
"""Parameters by name: a value, or one per voltage."""


@dataclass(frozen=True)
class Beside:
    """What stands beside an effect in a damper."""

    effects: Mapping[str, EffectValues]
    """Every effect of the damper."""
    T0: tuple[float, ...]
    """Of every base row [N]."""
    k: float
    """Stiffest oil spring [N/m], infinite for a rigid damper."""
    force: float
    """Largest of the tests [N]."""
    static: float
    """Force at rest in the middle of the stroke, of a gas or a weight [N]."""


def _nothing_else(values: EffectValues, beside: Beside) -> str | None:
    """Return no other effect, or nothing against it: the default of `Effect.nearly` and `Effect.contradicted`."""
    return None


@dataclass(frozen=True)
class Effect:
    """One physical term that a damper may or may not have."""

    name: str
    place: Place
    law: str
    """The equation, as the documentation prints it."""
    parameters: tuple[Parameter, ...]
    source: str
    """Where the law comes from."""
    tests: tuple[tuple[Mapping[str, float], float], ...]
    """Reference numbers: the arguments of one of the effect's laws, by name, and what it gives."""
    needs: Need | None = None
    """What must vary in a test for the effect to show at all."""
    hidden: Hiding | None = None
    """How the blind benchmark draws it; None for what it never hides: a confounder, or what is never named."""
    never_named: str | None = None
    """Why no verdict names it beside others; a damper then has it only where held-out tests are predicted better with
    it, or where the config forces it. None for an effect that a verdict may name."""
    named_alone: bool = False
    """Whether a verdict names it all the same, where nothing else explains the tests and it leaves nothing, alone or
    beside one other."""
    imitates: bool = False
    """Whether its numbers let it follow a part of nearly any difference of two forces: `pzd changes` asks it last."""
    asked_last: bool = False
    """Whether the search for what predicts best asks it where nothing else helps: it would take up a part of much."""
    order: int = 0
    """Order among the effects of its place, smaller numbers first."""
    needs_displacement_zero: bool = False
    """Whether its law depends on the zero of the displacement, which a fit then looks for too."""
    same_at_every_voltage: bool = False
    """Whether the control signal cannot change it, as a length or a mass: it is fitted as one value."""
    nearly: Callable[[EffectValues, Beside], str | None] = _nothing_else
    """Which other effect many would call it with such values, however well tests tell the two apart: its rival."""
    contradicted: Callable[[EffectValues, Beside], str | None] = _nothing_else
    """Why such values are those of no such effect beside what else the damper has; None where they may be."""
    beside_gas: bool = False
    """Whether it is an effect of its own beside a static force alone, as a gas has; without one it is that which it
    nearly is. No benchmark hides it."""
    by_speed_alone: bool = False
    """Whether a force beside the flow depends on the speed alone, so that it bends the same curve as the flow does."""
    natural: Callable[[Mapping[str, float], float], bool] = _always
    """Whether its parameters are physical together, given the C of the element [N s/m]."""

    @property
    def curve(self) -> Place | None:
        """Place whose curve it bends: force by speed in the flow, deflection by force in the stroke; None for none."""
        if self.by_speed_alone:
            return "flow"
        return self.place if self.place in ("flow", "stroke") else None

    def parameter(self, name: str) -> Parameter:
        """Return the parameter of that name.

        Raises
        ------
        KeyError : when the effect has no such parameter
        """
        return {parameter.name: parameter for parameter in self.parameters}[name]


# --- Functions of each place, and the rules ---

ELEMENT = tuple(quantity.symbol for quantity in BINGHAM)
"""Parameters of the element, whose names no parameter of an effect may take."""
NODE_VOLTAGES = "at_voltage_V"
"""Key of the voltages at which an effect's parameters are given in a config."""


@dataclass(frozen=True)
class Law:
    """Rules of one function that an effect file may hold."""

    quantities: tuple[str, ...]
    """Arguments that it may take besides the effect's own parameters."""
    requires: tuple[str, ...] = ()
    """Functions that the file must hold too."""
    suffices: bool = True
    """Whether it makes an effect by itself; False for one that only accompanies another."""


LAWS: Mapping[Place, Mapping[str, Law]] = {
    "drive": {
        "law": Law(("effective", "before", "now", "step"), ("rate",)),
        "rate": Law(("effective", "now", "rate"), suffices=False),
    },
    "material": {
        name: Law(("temperature", "reference")) for name in ("friction_factor", "damping_factor", "stiffness_factor")
    },
    "stroke": {
        "law": Law(("deflection", "side", "k"), ("inverse",)),
        "inverse": Law(("extension", "side", "k"), suffices=False),
        "slope": Law(("deflection", "side", "k"), suffices=False),
    },
    "flow": {
        "direction_factor": Law(("side",)),
        "bleed_factor": Law(("side",)),
        "yield_force": Law(("w", "T0"), ("yield_slope",)),
        "yield_slope": Law(("w", "T0"), suffices=False),
        "viscous_force": Law(("w", "C"), ("viscous_slope", "viscous_speed")),
        "viscous_slope": Law(("w", "C"), suffices=False),
        "viscous_speed": Law(("viscous", "C"), suffices=False),
        "extra_force": Law(("w", "side"), ("extra_slope",)),
        "extra_slope": Law(("w", "side"), suffices=False),
        "extra_speed": Law(("force", "C", "side"), suffices=False),
        "opens_at": Law(("T0", "side"), ("slope_beyond",)),
        "slope_beyond": Law(("side",), suffices=False),
        "spread": Law(("side",), ("opens_at",), suffices=False),
    },
    "parallel": {"law": Law(("x", "v", "a"))},
    "branch": {
        "advance": Law(("deflection", "travel"), ("law", "rate")),
        "law": Law(("deflection",), ("advance",)),
        "rate": Law(("deflection", "side"), suffices=False),
    },
    "sensor": {"law": Law(("time",))},
}
"""Rules by place and name; the docstring of this module says what each function returns."""


def functions(effect: Effect, module: ModuleType) -> dict[str, Callable[..., float]]:
    """Return the functions that a file holds for its effect, by name."""
    return {name: vars(module)[name] for name in LAWS[effect.place] if callable(vars(module).get(name))}


@cache
def arguments(function: Callable[..., float]) -> tuple[str, ...]:
    """Return the names of the arguments of a function."""
    return tuple(inspect.signature(function).parameters)


def declared_effect(module: ModuleType) -> Effect:
    """Return the effect that a file declares.

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
    """Yield every rule that the file of an effect breaks."""
    own = [parameter.name for parameter in effect.parameters]
    yield from (f"parameter {name} is declared twice" for name, count in Counter(own).items() if count > 1)
    if effect.place not in LAWS:
        yield f"there is no place {effect.place}, but {', '.join(LAWS)}"
        return
    taken = {quantity for law in LAWS[effect.place].values() for quantity in law.quantities}
    yield from (f"parameter {name} has the name of a quantity that its law takes" for name in own if name in taken)
    reserved, model = (*ELEMENT, NODE_VOLTAGES), Path(__file__).with_name("model.py")
    yield from (
        f"parameter {name} has a name of the element's ({', '.join(reserved)}), see {model}"
        for name in own
        if name in reserved
    )
    laws, present = LAWS[effect.place], functions(effect, module)
    if not any(laws[name].suffices for name in present):
        yield f"an effect of the {effect.place} needs {' or '.join(name for name, law in laws.items() if law.suffices)}"
    for name, function in present.items():
        yield from (f"{other} must stand beside {name}" for other in laws[name].requires if other not in present)
        known = (*laws[name].quantities, *own)
        yield from (
            f"{name} takes {', '.join(known) or 'nothing'} (got {argument})"
            for argument in arguments(function)
            if argument not in known
        )
