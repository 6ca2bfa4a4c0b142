"""A damper as data: the Bingham parameters over voltage and temperature, and its effects."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping

import numpy as np
from pydantic import Field, ValidationInfo, field_validator, model_validator

from pzd.damper.confounders import known
from pzd.damper.effect import LARGEST_DAMPING, LARGEST_FORCE, NODE_VOLTAGES, Effect, EffectValues
from pzd.damper.effects import library
from pzd.schema.errors import InsideError
from pzd.schema.model import Frozen

Effects = dict[str, dict[str, float | tuple[float, ...]]]
"""Parameters of each effect, by its name and theirs."""

PHYSICAL = {"T0_N": (0.0, LARGEST_FORCE), "C_Ns_per_m": (0.0, LARGEST_DAMPING), "k_N_per_m": (1.0, math.inf)}
"""Limits within which T0, C and k of any damper lie, from those of a drawer to those of a bridge; no friction, no
damping and a rigid oil spring are limits of the law. A value outside is in another unit."""


class BaseRow(Frozen):
    """The Bingham parameters at one voltage and one temperature."""

    voltage_V: float | None = None
    """Control signal; empty where the damper has none."""
    temperature_degC: float | None = None
    """Temperature; empty where none was recorded."""
    T0_N: float = Field(ge=0.0)
    """Dry friction force."""
    C_Ns_per_m: float = Field(ge=0.0)
    """Damping coefficient."""
    k_N_per_m: float = Field(gt=0.0, allow_inf_nan=True)
    """Stiffness of the oil spring; empty or `.inf` for a rigid damper."""

    @field_validator("k_N_per_m", mode="before")
    @classmethod
    def _rigid(cls, value: float | None) -> float:
        """Take an empty cell, as JSON writes an infinite number, for a rigid damper."""
        return math.inf if value is None else value

    @field_validator(*PHYSICAL)
    @classmethod
    def _physical(cls, value: float, info: ValidationInfo) -> float:
        """Check what a person writes; a search may go further."""
        if info.mode == "json" and info.field_name and (wrong := unphysical(info.field_name, value)):
            raise ValueError(wrong)
        return value


def unphysical(name: str, value: float) -> str | None:
    """Say what a value of T0, C or k (by its column) must be where no damper has it; None where it is possible."""
    low, high = PHYSICAL[name]
    if low <= value <= high:
        return None
    unit = name.partition("_")[2].replace("_per_", "/").replace("Ns", "N s")
    limits = f"be at least {low:g} {unit}" if math.isinf(high) else f"lie between {low:g} and {high:g} {unit}"
    return f"must {limits}, as that of every damper does; is it in another unit?"


class Damper(Frozen):
    """A damper: base rows (interpolated between, held beyond) and effects by name.

    An effect's parameter is one number, or a list of numbers beside `at_voltage_V`, piecewise
    linear in the voltage. Base rows of one voltage are interpolated over temperature first.
    """

    base: tuple[BaseRow, ...] = Field(min_length=1)
    """Bingham parameters, one row a voltage and temperature."""
    effects: Effects = Field(default_factory=dict)
    """Parameters of each effect, by the effect's name; see `pzd effects`."""
    reference_temperature_degC: float | None = None
    """T_ref of the effects of the material, as `temperature_drift`; needed only with one of them."""
    zero_m: float = 0.0
    """Recorded displacement from which x in the laws of `end_stop` and `gas_spring` is counted, as a displacement
    sensor has any zero: the middle of the stroke on the stand. In a car it is the static position."""

    @field_validator("effects")
    @classmethod
    def _known_effects(cls, effects: Effects) -> Effects:
        for name, values in effects.items():
            _check_effect(name, values)
        return effects

    @field_validator("base")
    @classmethod
    def _one_row_each(cls, base: tuple[BaseRow, ...]) -> tuple[BaseRow, ...]:
        labels = [(row.voltage_V, row.temperature_degC) for row in base]
        twice = next((i for i, label in enumerate(labels) if label in labels[:i]), None)
        if twice is not None:
            raise InsideError("another row before it has the same voltage and temperature; say those of each", twice)
        return base

    @model_validator(mode="after")
    def _reference(self) -> Damper:
        for name in self.effects:
            if known()[name].place == "material" and self.reference_temperature_degC is None:
                raise ValueError(f"{name} needs reference_temperature_degC")
        return self

    def with_effect(self, name: str, values: EffectValues) -> Damper:
        """Return the damper with one effect more, or with other values of it."""
        return Damper(**{**dict(self), "effects": {**self.effects, name: dict(values)}})  # unlike a copy, validated

    def without_effects(self, *names: str) -> Damper:
        """Return the damper without some of its effects."""
        return self.model_copy(update={"effects": {n: values for n, values in self.effects.items() if n not in names}})

    def moved(self, by: float) -> Damper:
        """Return the damper on a stand whose displacement reads more by an amount [m]."""
        return self.model_copy(update={"zero_m": self.zero_m + by})

    def about(self, zero: float) -> Damper:
        """Return the same damper with the force and stiffness beside the element about another displacement [m].

        As it is where an effect acts at a place of the stroke, for which no force and stiffness make up.

        Equation: F_0 + k_g (x - z) = (F_0 + k_g (z' - z)) + k_g (x - z')
        """
        gas, preload = (self.effects.get(name, {}) for name in ("gas_spring", "preload_offset"))
        nodes = {values[NODE_VOLTAGES] for values in (gas, preload) if NODE_VOLTAGES in values}
        if any(acts_at_a_place(name) for name in self.effects) or len(nodes) > 1:
            return self
        moved = np.multiply(gas.get("k_g", 0.0), zero - self.zero_m)
        if not moved.any():
            return self.model_copy(update={"zero_m": zero})
        force = np.add(preload.get("F_0", 0.0), moved)
        values: EffectValues = {"F_0": float(force)} if not nodes else {}
        for own in nodes:  # one value at every node stands for each
            values = {"F_0": tuple(np.broadcast_to(force, np.shape(own)).tolist()), NODE_VOLTAGES: own}
        return self.model_copy(update={"effects": {**self.effects, "preload_offset": values}, "zero_m": zero})


def acts_at_a_place(name: str) -> bool:
    """Whether an effect of that name acts at a place of the stroke, as a stop does."""
    return name in library() and any(parameter.position for parameter in library()[name].parameters)


def _check_effect(name: str, values: EffectValues) -> None:
    """Refuse an unknown effect, missing or unknown parameters, and values beyond the limits."""
    effects = known()
    if name not in effects:
        near = difflib.get_close_matches(name, library(), 1)
        hint = f"did you mean {near[0]}?" if near else "`pzd effects` lists those there are"
        raise InsideError(f"no effect is called {name}; {hint}", name, of_key=True)
    wanted = {p.name for p in effects[name].parameters}
    given = set(values) - {NODE_VOLTAGES}
    required = {p.name for p in effects[name].parameters if not p.optional}
    if not required <= given <= wanted:
        unknown = sorted(given - wanted)
        says = f"{name} takes {', '.join(sorted(wanted))} (got {', '.join(sorted(given)) or 'nothing'})"
        raise InsideError(says, name, *unknown[:1], of_key=bool(unknown))
    nodes = values.get(NODE_VOLTAGES)
    for key in sorted(given):
        value = values[key]
        listed = value if isinstance(value, tuple) else (value,)
        if isinstance(value, tuple) and (not isinstance(nodes, tuple) or len(nodes) != len(value)):
            raise InsideError(f"{name}.{key} is a list, so at_voltage_V must be a list of the same length", name, key)
        parameter = effects[name].parameter(key)
        for number in listed:
            if not parameter.admits(number):
                limits = f"[{parameter.low:g}, {parameter.high:g}] {parameter.unit}"
                raise InsideError(f"{name}.{key} must lie in {limits} (got {number:g})", name, key)


def against_nature(damper: Damper) -> tuple[str, ...]:
    """Return the effects of a damper whose values are not physical, such as a negative mass.

    A fit may go beyond physical values, and has then found something that looks alike.
    """
    damping = max(row.C_Ns_per_m for row in damper.base)
    return tuple(
        name
        for name, values in damper.effects.items()
        if not all(_natural(known()[name], at, damping) for at in _per_voltage(values))
    )


def _natural(effect: Effect, values: Mapping[str, float], damping: float) -> bool:
    """Return whether an effect's parameters are physical at a C [N s/m]."""
    within = all(p.natural_from <= values.get(p.name, p.neutral) <= p.natural_to for p in effect.parameters)
    return within and effect.natural(values, damping)


def _per_voltage(values: EffectValues) -> list[dict[str, float]]:
    """Return the parameters of an effect, one set per voltage."""
    given = {name: np.atleast_1d(value).tolist() for name, value in values.items() if name != NODE_VOLTAGES}
    count = max(len(each) for each in given.values())
    return [{name: each[min(i, len(each) - 1)] for name, each in given.items()} for i in range(count)]
