"""The least-squares problem: T0, C, k of every base row and the parameters of effects in the units of the search."""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import cast

import numpy as np

from pzd.damper.confounders import known
from pzd.damper.effect import NODE_VOLTAGES, Effect, EffectValues, Parameter, Scales, Search
from pzd.damper.element import STIFFEST
from pzd.damper.fitted_laws import fitted_laws
from pzd.damper.model import BaseRow, Damper
from pzd.damper.parameter_rows import DamperNodes, drive_row, nodes_of, nodes_with, rows_per_voltage
from pzd.diagnosis.fit.likelihood import WeightedRecord
from pzd.fit.element_coordinates import ElementCoordinates
from pzd.record import Array

# --- Budget of simulations


@dataclass(eq=False)
class Budget:
    """Count of simulated samples, and the limit at which the search ends with what it knows.

    It counts forces at samples, whoever asks for them, and is checked only between steps of the search, when every
    thread has finished: so the same input ends at the same place, as a limit in seconds would not.
    """

    limit: float = float("inf")
    """Forces that may be computed."""
    spent: int = 0
    """Forces computed."""
    exhausted: bool = False
    """Whether the search was kept from a further step."""
    _lock: threading.Lock = field(default_factory=threading.Lock, repr=False)

    def add(self, samples: int) -> None:
        """Count a simulation of so many samples."""
        with self._lock:
            self.spent += samples

    def allows_more(self) -> bool:
        """Whether the search may go on; asked between one step and the next."""
        self.exhausted = self.exhausted or self.spent >= self.limit
        return not self.exhausted

    @property
    def note(self) -> str:
        """Sentence of the verdict on a search that was ended; empty for one that came to its own end."""
        if not self.exhausted:
            return ""
        return (
            f"; the search was ended by diagnose.most_evaluations ({self.limit:.3g} forces): a larger one, or shorter "
            "records, may tell more"
        )


# --- Unknowns and the problem


UNSEEN = (0.1, 1e-3)
"""C [largest force over largest speed] and 1/k [range of displacement over largest force] below which the priors tell
no values apart: hardly any damping, hardly any oil spring."""
BOUND = 1e4
"""Limit of scaled parameters, and of the inverse of those searched by their logarithm."""
ZERO = Parameter(
    "zero_m",
    "m",
    0.0,
    -1.0,
    1.0,
    "zero of the displacement, from the middle of the stroke",
    Search(lambda s: s.stroke, (0.0,), within=(-0.3, 0.3)),
)
"""Zero of the displacement, searched once, beside the first effect that depends on it; near the middle of the stroke.
"""


@dataclass(frozen=True)
class Unknown:
    """One effect parameter in the units of the search."""

    effect: str
    parameter: Parameter
    scale: float
    node: int | None = None
    """Index of its voltage; None for one value at every voltage."""

    @property
    def bounds(self) -> tuple[float, float]:
        """Limits of the search variable."""
        least, most = self.parameter.search.within
        low, high = max(self.parameter.low / self.scale, least), min(self.parameter.high / self.scale, most)
        if self.parameter.search.logarithmic:
            return float(np.log(max(low, 1.0 / BOUND))), float(np.log(min(high, BOUND)))
        return max(low, -BOUND), min(high, BOUND)

    def value(self, searched: float) -> float:
        """Return the parameter in its own unit at a value of the search variable."""
        scaled = float(np.exp(searched)) if self.parameter.search.logarithmic else searched
        return float(np.clip(scaled * self.scale, self.parameter.low, self.parameter.high))

    def to_search(self, value: float) -> float:
        """Return the search variable at a value of the parameter."""
        scaled = value / self.scale
        return float(np.log(max(scaled, 1.0 / BOUND))) if self.parameter.search.logarithmic else scaled

    def towards_neutral(self, searched: float, share: float) -> float:
        """Return the parameter [own unit] at a share of the way from its neutral value, where the effect is off."""
        value, neutral = self.value(searched), self.parameter.neutral
        return neutral + share * (value - neutral) if np.isfinite(neutral) else value / share

    def value_in(self, damper: Damper) -> float:
        """Return the value [own unit] that a damper has."""
        return damper.zero_m if self.parameter is ZERO else self.value_among(damper.effects)

    def value_among(self, effects: Mapping[str, EffectValues]) -> float:
        """Return the value [own unit] among the parameters of some effects, by the effect's name."""
        value = effects[self.effect][self.parameter.name]
        return value if isinstance(value, float) else value[self.node or 0]

    def derivative(self, searched: float) -> float:
        """Return the derivative of the parameter by the search variable."""
        return self.scale * (float(np.exp(searched)) if self.parameter.search.logarithmic else 1.0)


@dataclass(frozen=True, eq=False)
class Problem:
    """Observations, starting values and limits of a fit."""

    observations: tuple[WeightedRecord, ...]
    base: tuple[BaseRow, ...]
    """Labels and starting values of the base rows."""
    scales: Scales
    reference_temperature: float | None = None
    """T_ref of the temperature drift [degC]."""
    per_voltage: frozenset[str] = frozenset()
    """Effects whose parameters have one value per voltage of the base rows."""
    budget: Budget = field(default_factory=Budget, repr=False)
    """Counts what is simulated."""
    rigid: bool = False
    """Whether every oil spring stays rigid."""
    law: Mapping[str, EffectValues] = field(default_factory=dict)
    """What else the law of the element has beside T0 + C w, as knees and a gas, with starting values by name: free in
    every fit as T0, C and k are, and no effects."""

    @cached_property
    def voltages(self) -> tuple[float, ...]:
        """(v,) voltages of the base rows [V], rising."""
        return tuple(voltage for voltage, _ in rows_per_voltage(self.base))

    @cached_property
    def nodes(self) -> tuple[int, ...]:
        """(b,) index of the voltage of every base row."""
        place = {id(row): i for i, (_, rows) in enumerate(rows_per_voltage(self.base)) for row in rows}
        return tuple(place[id(row)] for row in self.base)

    def pooled_temperatures(self) -> Problem:
        """Return the problem with one base row per voltage, for effects that replace the temperature axis."""
        groups = [rows for _, rows in rows_per_voltage(self.base)]
        if len(groups) == len(self.base):
            return self
        place = {id(row): i for i, rows in enumerate(groups) for row in rows}
        moved = tuple(
            o if o.base_row < 0 else replace(o, base_row=place[id(self.base[o.base_row])]) for o in self.observations
        )
        return replace(self, observations=moved, base=tuple(_mean_row(rows) for rows in groups))

    def started_at(self, damper: Damper) -> Problem:
        """Return the problem with the rows and the law of a damper as starting values, and its effects per voltage."""
        by_voltage = frozenset(name for name, values in damper.effects.items() if NODE_VOLTAGES in values)
        reference = damper.reference_temperature_degC
        kept = self.reference_temperature if reference is None else reference
        law = law_of(damper, tuple(self.law))
        return replace(self, base=damper.base, per_voltage=by_voltage, reference_temperature=kept, law=law)

    def with_friction_scaling(self, effect: Effect) -> Problem:
        """Return the problem with an effect's parameters per voltage if they scale with T0."""
        by_voltage = len(self.voltages) > 1 and any(parameter.with_friction for parameter in effect.parameters)
        return replace(self, per_voltage=self.per_voltage | {effect.name}) if by_voltage else self

    def relative_friction(self, node: int) -> float:
        """Return the starting T0 at one of the voltages, as a share of the largest."""
        here = max(row.T0_N for row, at in zip(self.base, self.nodes, strict=True) if at == node)
        return here / (max(row.T0_N for row in self.base) or 1.0)

    def unknowns(self, effects: Sequence[str]) -> tuple[Unknown, ...]:
        """List the parameters of law and effects in search order, the zero behind the first effect that needs it."""
        found: list[Unknown] = []
        for name in (*self.law, *(name for name in effects if name not in self.law)):
            nodes = range(len(self.voltages)) if name in self.per_voltage else (None,)
            free = [p for p in known()[name].parameters if name not in self.law or _is_free(self.law[name], p)]
            found += [self._unknown(name, parameter, node) for node in nodes for parameter in free]
            if known()[name].needs_displacement_zero and all(u.parameter is not ZERO for u in found):
                found.append(self._unknown(name, ZERO, None))
        return tuple(found)

    def _unknown(self, effect: str, parameter: Parameter, node: int | None) -> Unknown:
        return Unknown(effect, parameter, parameter.search.scale(self.scales) or 1.0, node)

    def plain_start(self) -> Array:
        """Return the (3 b + l,) base rows and the law in the units of the search, where plain fits begin."""
        return np.concatenate([self.start(), [u.to_search(u.value_among(self.law)) for u in self.unknowns(())]])

    def start(self) -> Array:
        """Return the (3 b,) base rows in the units of the search, see `pzd.fit.element_coordinates`."""
        rows = [self.coordinates.to_search(r.T0_N, r.C_Ns_per_m, r.k_N_per_m) for r in self.base]
        return np.asarray(np.fmin(np.concatenate(rows), np.tile((np.inf, *self.coordinates.high[1:]), len(rows))))

    @cached_property
    def coordinates(self) -> ElementCoordinates:
        """Coordinates of T0, C and k in the search."""
        return ElementCoordinates(self.scales.force, self.scales.speed, 2.0 * self.scales.stroke)

    @cached_property
    def unseen(self) -> Array:
        """(3,) coordinates below which the priors tell no values apart; none of T0."""
        force, speed, stroke = self.coordinates.force, self.coordinates.speed, self.coordinates.stroke
        return self.coordinates.to_search(0.0, UNSEEN[0] * force / speed, force / (UNSEEN[1] * stroke))

    def start_with(self, damper: Damper) -> Array:
        """Return the (3 b + e,) base rows and the effects of a damper in the units of the search."""
        unknowns = self.unknowns(tuple(damper.effects))
        return np.concatenate([self.start(), [u.to_search(u.value_in(damper)) for u in unknowns]])

    def point(self, searched: Array, unknowns: Sequence[Unknown]) -> Point:
        """Return the parameters at a point of the search."""
        base = searched[: 3 * len(self.base)].reshape(-1, 3)
        values = np.array([self.coordinates.from_search(np.maximum(row, 0.0)) for row in base])
        return Point(values, *self._effects(searched, unknowns), self)

    def point_beside(self, point: Point, searched: Array, unknowns: Sequence[Unknown], moved: int) -> Point:
        """Return the parameters at a point of the search that differs from another one in one variable alone.

        Parameters
        ----------
        point : the other one
        searched : (3 b + e,) the point
        unknowns : of the effects
        moved : the variable
        """
        row = moved // 3
        if row >= len(self.base):
            return Point(point.base, *self._effects(searched, unknowns), self)
        values = point.base.copy()
        values[row] = self.coordinates.from_search(np.maximum(searched[3 * row : 3 * row + 3], 0.0))
        return Point(values, point.effects, point.displacement_zero, self)

    def _effects(
        self, searched: Array, unknowns: Sequence[Unknown]
    ) -> tuple[Mapping[str, Mapping[str, float | tuple[float, ...]]], float]:
        """Return the values by effect and parameter, and the zero of the displacement [m], at a point of the search."""
        effects: dict[str, dict[str, float | tuple[float, ...]]] = {
            name: {p.name: values.get(p.name, p.neutral) for p in known()[name].parameters if not _is_free(values, p)}
            for name, values in self.law.items()
        }
        zero = 0.0
        for unknown, x in zip(unknowns, searched[3 * len(self.base) :], strict=True):
            if unknown.parameter is ZERO:
                zero = unknown.value(float(x))
                continue
            given, name, value = effects.setdefault(unknown.effect, {}), unknown.parameter.name, unknown.value(float(x))
            given[name] = value if unknown.node is None else (*cast("tuple[float, ...]", given.get(name, ())), value)
        return effects, zero


def law_of(damper: Damper, names: Sequence[str]) -> dict[str, EffectValues]:
    """Return what of a damper belongs to the law of its element: effects of some names, and every fitted law it has."""
    every = dict.fromkeys((*names, *fitted_laws()))
    return {name: damper.effects[name] for name in every if name in damper.effects}


def _is_free(values: EffectValues, parameter: Parameter) -> bool:
    """Whether a parameter of the law is searched: it is there, and no limit, as the force of a knee that is none."""
    value = values.get(parameter.name, parameter.neutral)
    return not np.all(np.equal(value, parameter.neutral) | (np.asarray(value) >= parameter.high))


def _mean_row(rows: Sequence[BaseRow]) -> BaseRow:
    """Average T0, C and k over several temperatures."""
    friction, damping, stiffness = np.mean([(r.T0_N, r.C_Ns_per_m, r.k_N_per_m) for r in rows], axis=0)
    return BaseRow(
        voltage_V=rows[0].voltage_V,
        T0_N=float(friction),
        C_Ns_per_m=float(damping),
        k_N_per_m=float(stiffness),
    )


@dataclass(frozen=True, eq=False)
class Point:
    """Values of T0, C and k of every base row, and of the effects."""

    base: Array
    """(b, 3) T0 [N], C [N s/m], k [N/m]."""
    effects: Mapping[str, Mapping[str, float | tuple[float, ...]]]
    """Values by effect and parameter; tuples are per voltage."""
    displacement_zero: float
    """Zero of the displacement [m]."""
    problem: Problem
    _nodes_by_temperature: dict[float | None, DamperNodes] = field(default_factory=dict, repr=False)

    @cached_property
    def damper(self) -> Damper:
        """The same as a damper."""
        rows = tuple(
            BaseRow(
                voltage_V=label.voltage_V,
                temperature_degC=label.temperature_degC,
                T0_N=float(friction),
                C_Ns_per_m=float(damping),
                k_N_per_m=float(stiffness),
            )
            for label, (friction, damping, stiffness) in zip(self.problem.base, self.base, strict=True)
        )
        return Damper(
            base=rows,
            effects={name: {**values, **self._node_voltages(name)} for name, values in self.effects.items()},
            reference_temperature_degC=self.problem.reference_temperature,
            zero_m=self.displacement_zero,
        )

    def nodes(self, temperature: float | None) -> DamperNodes:
        """Return the rows at the nodes of voltage, at one temperature [degC]; cached."""
        problem = self.problem
        if len(problem.base) == len(problem.voltages) and all(known()[n].place != "material" for n in self.effects):
            return self._nodes
        if temperature not in self._nodes_by_temperature:
            self._nodes_by_temperature[temperature] = nodes_of(self.damper, temperature)
        return self._nodes_by_temperature[temperature]

    @cached_property
    def _nodes(self) -> DamperNodes:
        """Rows at the nodes of voltage, where they are the same at every temperature: without a damper to check."""
        base = np.empty_like(self.base)
        base[list(self.problem.nodes)] = self.base
        if len(base) > 1:
            base[:, 2] = np.minimum(base[:, 2], STIFFEST)  # between two infinite ones nothing is linear
        drive = {name: cast("Mapping[str, float]", own) for name, own in self.effects.items()}  # one value for all
        return nodes_with(np.array(self.problem.voltages), base, self.effects, drive_row(drive))

    def _node_voltages(self, effect: str) -> dict[str, tuple[float, ...]]:
        return {NODE_VOLTAGES: self.problem.voltages} if effect in self.problem.per_voltage else {}

    def effects_at(self, base_row: int) -> Mapping[str, Mapping[str, float]]:
        """Return the effects at the voltage of one base row."""
        node = self.problem.nodes[base_row]
        return {
            name: {key: value[node] if isinstance(value, tuple) else value for key, value in values.items()}
            for name, values in self.effects.items()
        }
