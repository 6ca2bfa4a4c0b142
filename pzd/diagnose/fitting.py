"""A damper with some effects fitted to observations: T0, C, k of every base row together with the effects.

Every residual is in units of noise with the tests' nuisances integrated out, so that half the sum of
squares is minus the logarithm of the likelihood, and fits of different effects can be compared.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pzd.damper.compose import force_of_rows, recorded, respond, standing_rows
from pzd.damper.effect import Parameter, Scales
from pzd.damper.effects import library
from pzd.damper.material import by_voltage
from pzd.damper.model import BaseRow, Damper
from pzd.diagnose.observation import Observation
from pzd.record import Array

SIMULATION_TOLERANCE = 1e-8
"""Of the damper's path, as a share of the force."""
DIFFERENCE = 1e-4
"""Step of the searched variables for forward differences."""
MOST_EVALUATIONS = 20
BOUND = 1e3
"""No scaled parameter is looked for beyond this, nor one with ratio steps below its inverse."""
STIFFER = 2.0
"""By this factor the search may exceed the fastest element."""
USUAL = 1.5
"""Prior standard deviation of ln C and ln k about their starting values: holds a row still where the tests do not
show it (C under an open relief valve, k of a soft drive), and nowhere else."""
WIDEST = 3.0
"""C and k stay within e^3 = 20 times their starting values."""

Values = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class Unknown:
    """One effect parameter in the units of the search."""

    effect: str
    parameter: Parameter
    scale: float

    @property
    def bounds(self) -> tuple[float, float]:
        """Limits of the searched variable."""
        low, high = (limit / self.scale for limit in (self.parameter.low, self.parameter.high))
        if self.parameter.search.logarithmic:
            return float(np.log(max(low, 1.0 / BOUND))), float(np.log(min(high, BOUND)))
        return max(low, -BOUND), min(high, BOUND)

    def value(self, searched: float) -> float:
        """The parameter in its own unit."""
        scaled = float(np.exp(searched)) if self.parameter.search.logarithmic else searched
        return float(np.clip(scaled * self.scale, self.parameter.low, self.parameter.high))

    def searched(self, value: float) -> float:
        """The searched variable at a value of the parameter."""
        scaled = value / self.scale
        return float(np.log(max(scaled, 1.0 / BOUND))) if self.parameter.search.logarithmic else scaled

    def slope(self, searched: float) -> float:
        """Derivative of the parameter by the searched variable."""
        return self.scale * (float(np.exp(searched)) if self.parameter.search.logarithmic else 1.0)


@dataclass(frozen=True, eq=False)
class Fitted:
    """An optimum: the damper, and what it leaves."""

    damper: Damper
    effects: tuple[str, ...]
    searched: Array
    """(3 b + e,) the optimum in the units of the search."""
    residuals: tuple[Array, ...]
    """(w,) an observation, in units of noise."""
    simulated: tuple[Array, ...]
    """(n,) an observation, force at the compared samples [N]."""
    slopes: Array
    """(w, 3 b + e) derivatives of all residuals by the searched variables."""
    covariance: Array
    """(e, e) of the effect parameters in their own units, noise alone."""
    unknowns: tuple[Unknown, ...]

    @property
    def misfit(self) -> float:
        """Sum of squares in units of noise: minus twice the logarithm of the likelihood, but for a constant."""
        return float(sum(r @ r for r in self.residuals))

    @property
    def size(self) -> int:
        """Number of residuals."""
        return sum(r.size for r in self.residuals)

    def value_of(self, effect: str, parameter: str) -> float:
        """A fitted parameter in its own unit."""
        value = self.damper.effects[effect][parameter]
        return value if isinstance(value, float) else value[0]


@dataclass(frozen=True, eq=False)
class Problem:
    """What is fitted to what."""

    observations: tuple[Observation, ...]
    base: tuple[BaseRow, ...]
    """Labels and starting values of the base rows."""
    scales: Scales
    fastest: float
    """Largest k / C that is looked for [1/s]: an element that answers within a sample shows no spring."""
    reference: float | None = None
    """T_ref for temperature drift [degC]."""

    def pooled(self) -> Problem:
        """The same with one base row a voltage, whatever the temperature: an effect stands for its axis then."""
        groups = [rows for _, rows in by_voltage(self.base)]
        if len(groups) == len(self.base):
            return self
        place = {id(row): i for i, rows in enumerate(groups) for row in rows}
        moved = tuple(o if o.place < 0 else replace(o, place=place[id(self.base[o.place])]) for o in self.observations)
        return replace(self, observations=moved, base=tuple(_mean_row(rows) for rows in groups))

    def unknowns(self, effects: Sequence[str]) -> tuple[Unknown, ...]:
        """The parameters of some effects, in the order of the search."""
        return tuple(
            Unknown(name, parameter, parameter.search.scale(self.scales) or 1.0)
            for name in effects
            for parameter in library()[name].parameters
        )

    def start(self) -> Array:
        """(3 b,) the base rows in the units of the search."""
        stiffest = [min(r.k_N_per_m, self.fastest * r.C_Ns_per_m) for r in self.base]
        return np.concatenate(
            [
                (r.T0_N / self.scales.force, np.log(r.C_Ns_per_m), np.log(k))
                for r, k in zip(self.base, stiffest, strict=True)
            ]
        )

    def start_with(self, fitted: Fitted) -> Array:
        """(3 b + e,) the base rows, and the effects of an earlier fit, whose scales may have been others."""
        unknowns = self.unknowns(fitted.effects)
        values = [u.searched(fitted.value_of(u.effect, u.parameter.name)) for u in unknowns]
        return np.concatenate([self.start(), values])

    def point(self, searched: Array, unknowns: Sequence[Unknown]) -> Point:
        """What a point of the search stands for."""
        split = 3 * len(self.base)
        base = searched[:split].reshape(-1, 3)
        values = np.column_stack([np.maximum(base[:, 0], 0.0) * self.scales.force, np.exp(base[:, 1:])])
        effects: dict[str, dict[str, float]] = {}
        for unknown, x in zip(unknowns, searched[split:], strict=True):
            effects.setdefault(unknown.effect, {})[unknown.parameter.name] = unknown.value(float(x))
        return Point(values, effects, self)


def _mean_row(rows: Sequence[BaseRow]) -> BaseRow:
    """One row for several temperatures or none: means of T0, C and k."""
    friction, damping, stiffness = np.mean([(r.T0_N, r.C_Ns_per_m, r.k_N_per_m) for r in rows], axis=0)
    return BaseRow(
        voltage_V=rows[0].voltage_V,
        T0_N=float(friction),
        C_Ns_per_m=float(damping),
        k_N_per_m=float(stiffness),
    )


@dataclass(frozen=True, eq=False)
class Point:
    """Numbers for T0, C and k of every base row, and for the effects."""

    base: Array
    """(b, 3)"""
    effects: Mapping[str, Mapping[str, float]]
    problem: Problem

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
            effects={name: dict(values) for name, values in self.effects.items()},
            reference_temperature_degC=self.problem.reference,
        )


def simulated(point: Point, observation: Observation) -> Array:
    """(n,) force at the compared samples of an observation [N]."""
    o, start = observation, float(observation.measured[0])
    if o.place >= 0 and "temperature_drift" not in point.effects:
        friction, damping, stiffness = point.base[o.place]
        rows, beside = standing_rows(friction, damping, stiffness, point.effects)
        force = force_of_rows(rows, beside, o.motion, o.steps, start, SIMULATION_TOLERANCE)
        tau = point.effects.get("sensor_delay", {}).get("tau", 0.0)
        return o.at_compared(recorded(tau, o.motion.time, force))
    damper = point.damper()
    if o.place >= 0:
        damper = damper.model_copy(update={"base": damper.base[o.place : o.place + 1]})
    return o.at_compared(respond(damper, o.motion, start, SIMULATION_TOLERANCE))


def fit(problem: Problem, effects: Sequence[str], start: Array, evaluations: int = MOST_EVALUATIONS) -> Fitted:
    """The optimum reached from a starting point, by trust-region least squares within the limits.

    Parameters
    ----------
    problem : what is fitted to what
    effects : names of the effects fitted together with the base rows
    start : (3 b + e,) in the units of the search
    evaluations : of the model, at most
    """
    from scipy.optimize import least_squares

    unknowns = problem.unknowns(effects)
    low, high = _bounds(problem, unknowns)

    centre, prior = problem.start(), _prior(problem, len(unknowns))

    def residuals_at(x: Array) -> Array:
        return np.concatenate(
            [*_residuals(problem, unknowns, x)[0], prior[:, : centre.size] @ (x[: centre.size] - centre)]
        )

    def slopes_at(x: Array) -> Array:
        return np.concatenate([_slopes(problem, unknowns, x), prior])

    found = least_squares(
        residuals_at,
        np.clip(start, low + 1e-9, high - 1e-9),
        jac=slopes_at,
        bounds=(low, high),
        x_scale="jac",
        ftol=1e-6,
        xtol=1e-6,
        gtol=1e-6,
        max_nfev=evaluations,
    )
    residuals, forces = _residuals(problem, unknowns, found.x)
    slopes = np.asarray(found.jac, dtype=np.float64)
    return Fitted(
        problem.point(found.x, unknowns).damper(),
        tuple(effects),
        found.x,
        tuple(residuals),
        tuple(forces),
        slopes[: slopes.shape[0] - prior.shape[0]],
        _covariance(slopes, found.x, unknowns),
        unknowns,
    )


def _prior(problem: Problem, effects: int) -> Array:
    """(2 b, 3 b + e) slopes of the prior on ln C and ln k of every base row, in its standard deviations."""
    rows = len(problem.base)
    columns = [3 * row + i for row in range(rows) for i in (1, 2)]
    return np.eye(3 * rows + effects)[columns] / USUAL


def _bounds(problem: Problem, unknowns: Sequence[Unknown]) -> tuple[Array, Array]:
    """Base rows within a ratio of where they start: far from there lie only stiff or dead dampers."""
    start = problem.start().reshape(-1, 3)
    low, high = start - WIDEST, start + WIDEST
    low[:, 0], high[:, 0] = 0.0, 2.0
    high[:, 2] = np.minimum(high[:, 2], start[:, 1] + np.log(STIFFER * problem.fastest))
    limits = [u.bounds for u in unknowns]
    return (
        np.array([*low.ravel(), *(lower for lower, _ in limits)]),
        np.array([*high.ravel(), *(upper for _, upper in limits)]),
    )


def _residuals(problem: Problem, unknowns: Sequence[Unknown], x: Array) -> tuple[list[Array], list[Array]]:
    point = problem.point(x, unknowns)
    forces = [simulated(point, o) for o in problem.observations]
    return [o.in_noise(o.measured - f) for o, f in zip(problem.observations, forces, strict=True)], forces


def _slopes(problem: Problem, unknowns: Sequence[Unknown], x: Array) -> Array:
    """(w, p) derivatives of the residuals by forward differences; a test moves with its own base row alone."""
    point, rows = problem.point(x, unknowns), len(problem.base)
    shifted = [problem.point(_shifted(x, j), unknowns) for j in range(x.size)]
    blocks = []
    for o in problem.observations:
        here = simulated(point, o)
        own = range(3 * o.place, 3 * o.place + 3) if o.place >= 0 else range(3 * rows)
        columns = [*own, *range(3 * rows, x.size)]
        change = o.in_noise(np.stack([here - simulated(shifted[j], o) for j in columns], axis=-1) / DIFFERENCE)
        block = np.zeros((len(change), x.size))
        block[:, columns] = change
        blocks.append(block)
    return np.concatenate(blocks)


def _shifted(x: Array, j: int) -> Array:
    moved = x.copy()
    moved[j] += DIFFERENCE
    return moved


def _covariance(jacobian: Array, x: Array, unknowns: Sequence[Unknown]) -> Array:
    """(e, e) covariance of the effect parameters in their own units."""
    count = len(unknowns)
    size = np.linalg.norm(jacobian, axis=0)
    size[size == 0.0] = 1.0
    scaled = jacobian / size
    whole = np.linalg.pinv(scaled.T @ scaled, rcond=1e-13, hermitian=True) / np.outer(size, size)
    slopes = np.array([u.slope(float(v)) for u, v in zip(unknowns, x[x.size - count :], strict=True)])
    return np.asarray(whole[x.size - count :, x.size - count :] * np.outer(slopes, slopes))
