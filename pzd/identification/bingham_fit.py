"""Least-squares fit of T0, C and k to the records of one condition.

Equation: W_s = sum (F - F_sim)^2 / sum F^2      Source: Makowski and Knap 2021, eq. (4)

The separable method starts from the characteristic, from a coarse grid and from the rigid damper, which is linear in T0
and C. Scaling T0 and C with k scales the force,
F = k f(T0/k, C/k), so the stiffness follows linearly and the grid covers delta = T0/k and tau = C/k only. The
evolutionary method stands for the paper's genetic algorithm. Both end in least squares with exact sensitivities.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pzd.damper.element import element_force, element_force_sensitivities
from pzd.fit.element_coordinates import LARGEST, LARGEST_PRE_SLIP, ElementCoordinates
from pzd.fit.least_squares import minimise
from pzd.identification.config import EvolutionaryConfig
from pzd.identification.prepared_record import PreparedRecord, split_by_record
from pzd.parallel.on_disk import one_at_a_time
from pzd.record import Array

# --- Criterion and search coordinates ---

AT_ZERO = 1e-6
"""A search coordinate below this lies at zero, a limit of the law: T0 a millionth of the peak force, C and 1/k as much
of what no test shows."""


class Bingham(NamedTuple):
    """Friction T0 [N], damping C [N s/m] and stiffness k [N/m] of the element, infinite for a rigid one."""

    friction: float
    damping: float
    stiffness: float


@dataclass(frozen=True, eq=False)
class Objective:
    """Criterion (4) pooled over the counted samples of the records, which both methods minimise."""

    prepared: tuple[PreparedRecord, ...]
    basis: Array | None = None
    """(N, q) orthonormal forces beside the element that are profiled out, by variable projection."""

    @cached_property
    def measured(self) -> Array:
        """Measured force (N,) at the counted samples, record by record [N]."""
        return np.concatenate([t.force[t.counted] for t in one_at_a_time(self.prepared)])

    @cached_property
    def energy(self) -> float:
        """Denominator of the criterion [N2]."""
        return float(self.measured @ self.measured)

    @cached_property
    def lengths(self) -> tuple[int, ...]:
        """Number of counted samples of each record."""
        return tuple(int(np.count_nonzero(t.counted)) for t in self.prepared)

    def simulated(self, parameters: Bingham) -> Array:
        """Compute the force (N,) of the element [N]."""
        return np.concatenate(
            [
                t.at_counted(element_force(t.displacement, t.step, *parameters, float(t.force[0]), every=t.every))
                for t in one_at_a_time(self.prepared)
            ]
        )

    def residuals(self, parameters: Bingham) -> Array:
        """Compute the measured less simulated force (N,), the forces beside the element profiled out [N]."""
        return self.projected(self.measured - self.simulated(parameters))

    def residuals_and_slopes(self, parameters: Bingham) -> tuple[Array, Array]:
        """Compute the residuals (N,) and the sensitivities (N, 3) to T0, C and 1/k, the basis projected out of both."""
        simulated, slopes = self.simulated_and_slopes(parameters)
        return self.projected(self.measured - simulated), self.projected(slopes)

    def simulated_and_slopes(self, parameters: Bingham) -> tuple[Array, Array]:
        """Compute the force (N,) of the element and its derivatives (N, 3) by T0, C and 1/k."""
        forces, slopes = np.empty(sum(self.lengths)), np.empty((sum(self.lengths), 3))
        for rows, force, slope in self._by_record(parameters):
            forces[rows], slopes[rows] = force, slope
        return forces, slopes

    def _by_record(self, parameters: Bingham) -> Iterator[tuple[slice, Array, Array]]:
        """Yield the rows of each record, its force (m,) and the derivatives (m, 3) of that at the counted samples."""
        first = 0
        for t, length in one_at_a_time(zip(self.prepared, self.lengths, strict=True)):
            force, slope = element_force_sensitivities(
                t.displacement, t.step, *parameters, float(t.force[0]), every=t.every
            )
            yield slice(first, first + length), t.at_counted(force), t.at_counted(slope)
            first += length

    def fitted_by_record(self, parameters: Bingham) -> Iterator[tuple[Array, Array]]:
        """Yield the residuals (m,) and sensitivities (m, 3) of each record, as of `residuals_and_slopes`."""
        if self.basis is not None:
            yield from split_by_record(self.prepared, *self.residuals_and_slopes(parameters))
            return
        for rows, force, slope in self._by_record(parameters):
            weight = 1.0 if self._all_count else self.weight[rows]
            yield (self.measured[rows] - force) * weight, slope * np.reshape(weight, (-1, 1))

    def triangle(self, parameters: Bingham, turned: Array, *, measured: bool = False) -> Array:
        """Return the triangle (q + 1, q + 1) with the inner products of the q slopes along directions, and residuals.

        Least squares on so few rows takes the same steps as on N rows, and costs next to nothing. Triangles of so many
        rows as lie in the cache of a processor are made first, and one of all of them: no more than a record is held.

        Parameters
        ----------
        parameters : at which
        turned : (3, q) derivatives of T0, C and 1/k along the directions
        measured : whether the measured forces take the place of the residuals
        """
        triangles = []
        for rows, force, slope in self._by_record(parameters):
            left = self.measured[rows] if measured else self.measured[rows] - force
            together = np.vstack([turned.T @ slope.T, left])
            if not self._all_count:
                together *= self.weight[rows]
            if self.basis is not None:
                together = np.vstack([self.basis[rows].T, together])
            pieces = (together[:, n : n + _ROWS_AT_A_TIME] for n in range(0, together.shape[1], _ROWS_AT_A_TIME))
            triangles += [np.linalg.qr(piece.T, mode="r") for piece in pieces]
        # What stands behind the columns of the basis is orthogonal to them.
        beside = 0 if self.basis is None else self.basis.shape[1]
        return np.asarray(np.linalg.qr(np.concatenate(triangles), mode="r"))[beside:, beside:]

    @cached_property
    def weight(self) -> Array:
        """Weight (N,) of the counted samples: 0 beside an unresolved jump of the force, else 1."""
        return np.concatenate([t.weight[t.counted] for t in one_at_a_time(self.prepared)])

    @cached_property
    def _all_count(self) -> bool:
        return bool(np.all(self.weight == 1.0))

    def projected(self, values: Array) -> Array:
        """Project the basis out of forces (N,) or (N, p), samples beside an unresolved jump left out.

        Equation: (I - Q Q') r                      Source: Golub and Pereyra 1973, variable projection
        """
        if not self._all_count:
            values = values * self.weight.reshape(-1, *([1] * (values.ndim - 1)))
        return values if self.basis is None else values - self.basis @ (self.basis.T @ values)

    def criterion(self, parameters: Bingham) -> float:
        """Compute W_s at the parameters."""
        residuals = self.residuals(parameters)
        return float(residuals @ residuals) / self.energy

    @cached_property
    def scales(self) -> tuple[float, float, float]:
        """Peak force [N], peak speed [m/s] and range of displacement [m] over the records."""
        speed = max(float(np.max(np.abs(np.diff(t.displacement)))) / t.step for t in one_at_a_time(self.prepared))
        stroke = max(float(np.ptp(t.displacement)) for t in one_at_a_time(self.prepared))
        return float(np.max(np.abs(self.measured))), speed, stroke

    @cached_property
    def coordinates(self) -> ElementCoordinates:
        """Coordinates of the search."""
        return ElementCoordinates(*self.scales)

    def to_search(self, parameters: Bingham) -> Array:
        """Return the search coordinates (3,) within their bounds."""
        return np.clip(self.coordinates.to_search(*parameters), 0.0, self.coordinates.high)

    def from_search(self, x: Array) -> Bingham:
        """Return the parameters at search coordinates (3,)."""
        return Bingham(*self.coordinates.from_search(x))

    def slips(self, parameters: Bingham) -> bool:
        """Tell whether the element slips within every full stroke: else F(0) would act as a free offset for ever."""
        return parameters.friction <= LARGEST_PRE_SLIP * parameters.stiffness * self.scales[2]

    def at_bounds(self, parameters: Bingham) -> tuple[bool, ...]:
        """Tell whether each parameter lies at a bound of the search; the limits of the law are results."""
        x, high = self.coordinates.to_search(*parameters), self.coordinates.high
        beyond = x >= high * (1.0 - 1e-3)
        return bool(beyond[0]), bool(beyond[1]), bool(beyond[2])

    def clipped(self, parameters: Bingham) -> Bingham:
        """Return the parameters clipped to the bounds."""
        return self.from_search(self.to_search(parameters))


@dataclass(frozen=True, eq=False)
class Fit:
    """An optimum of the criterion. Residuals and slopes of many records are large: they are computed when asked for."""

    parameters: Bingham
    criterion: float
    objective: Objective

    @property
    def residuals(self) -> Array:
        """Measured less simulated force (N,) at the counted samples [N]."""
        return self.objective.residuals(self.parameters)

    @property
    def slopes(self) -> Array:
        """Derivatives (N, 3) of the simulated force by T0, C and 1/k."""
        return self.objective.residuals_and_slopes(self.parameters)[1]


# --- Start from the characteristic, as in the first stage of the paper ---

FLANK_SPEED = 0.3
"""Least speed of the slip flank, as a share of its peak: where the speed falls and exceeds it, the element slips."""
PRE_SLIP_FORCE = 0.5
"""Largest force of the pre-slip branch, as a share of T0."""


def graphical_start(prepared: Sequence[PreparedRecord]) -> Bingham:
    """Estimate T0, C and k from the characteristic of force over speed.

    Equation: abs(F) = T0 + C (abs(v) - tau d abs(v)/dt) on the slip flank; k = dF/dx before slip
              Source: eq. (1)-(3), to first order in tau = C/k

    T0 is where the slip flank, extrapolated, meets zero piston speed (the measured force is larger there by the load of
    the oil spring, which the term in tau removes); C is the slope of the flank; k the slope of force over displacement
    where the force passes through zero.

    Parameters
    ----------
    prepared : records of one condition

    Returns
    -------
    T0 [N], C [N s/m], k [N/m], all positive
    """
    speed, slowing, force = _flank(prepared)
    peak = max(float(np.max(force, initial=0.0)), np.finfo(float).tiny)
    fastest = max(float(np.max(speed, initial=0.0)), np.finfo(float).tiny)
    terms = np.column_stack([np.ones(speed.size), speed / fastest, slowing / max(np.max(slowing, initial=0.0), 1e-12)])
    intercept, slope, _ = np.linalg.lstsq(terms, force / peak, rcond=1e-3)[0] * peak
    damping = max(slope, 0.05 * peak) / fastest
    friction = float(np.clip(intercept, 0.01 * peak, peak))
    return Bingham(friction, float(damping), _pre_slip_slope(prepared, friction))


def _flank(prepared: Sequence[PreparedRecord]) -> tuple[Array, Array, Array]:
    """Return speed, deceleration, and force along the direction of motion, on the slip flank."""
    parts = []
    for t in one_at_a_time(prepared):
        velocity = t.at_samples(np.gradient(t.displacement, t.step))
        step = t.step * (t.displacement.size - 1) / (t.force.size - 1)
        speed = np.abs(velocity)
        slowing = -np.gradient(speed, step)
        along = t.force * np.sign(velocity)
        flank = t.counted & (speed > FLANK_SPEED * np.max(speed)) & (slowing >= 0.0) & (along > 0.0)
        parts.append(np.stack([speed[flank], slowing[flank], along[flank]]))
    speed, slowing, along = np.concatenate(parts, axis=1)
    return speed, slowing, along


def _pre_slip_slope(prepared: Sequence[PreparedRecord], friction: float) -> float:
    """Return the slope of force over displacement where the force passes through zero, pooled over all passages."""
    covariance = variance = 0.0
    for t in one_at_a_time(prepared):
        displacement = t.at_samples(t.displacement)[t.counted]
        force = t.force[t.counted]
        for part in _runs(np.abs(force) < PRE_SLIP_FORCE * friction):
            dx = displacement[part] - displacement[part].mean()
            covariance += float(dx @ (force[part] - force[part].mean()))
            variance += float(dx @ dx)
    if covariance > 0.0:
        return covariance / variance
    stroke = max(float(np.ptp(t.displacement)) for t in one_at_a_time(prepared))
    return 20.0 * friction / stroke


def _runs(inside: NDArray[np.bool_]) -> list[slice]:
    """Return the runs of at least three samples inside."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], inside.astype(int), [0]))))
    return [slice(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= 3]


# --- Separable method ---

DEFLECTION_AND_TIME_GRID = (12, 10)
"""Points of the grid in delta = T0/k and in tau = C/k."""
GRID_SAMPLES = 10_000
"""Most samples on which the grid is evaluated, divided among the records."""
GRID_DESCENTS = 3
"""Best grid points that are starts."""
SAME_OPTIMUM = 1e-6
"""Relative difference of the criteria of two descents at the same optimum."""
_ROWS_AT_A_TIME = 8192
"""Rows of slopes and residuals that are reduced at a time: 256 kB."""
TOLERANCE = 1e-12
"""Relative tolerance of the least squares on parameters and criterion."""
EVALUATIONS = 100
"""Most evaluations of a descent: from a start near the valley it takes ten."""


def fit_separable(objective: Objective) -> Fit:
    """Find the global optimum of the criterion from the characteristic and the grid.

    Descents are made until the best optimum has been reached twice. The second need not converge: a criterion so close
    to that of a known optimum is no coincidence. That from the rigid damper is made in any case, since no grid over 1/k
    comes near it.
    """
    best = descend(objective, graphical_start(objective.prepared))
    for start in grid_starts(objective):
        try:
            fit = descend(objective, start, best.criterion)
        except KnownOptimum:
            break
        best = min(best, fit, key=lambda f: f.criterion)
    return min(best, descend(objective, fit_rigid(objective).parameters), key=lambda f: f.criterion)


def fit_rigid(objective: Objective) -> Fit:
    """Fit the rigid damper, whose force is linear in T0 and C.

    Equation: min sum (F - T0 sign(v) - C v)^2, T0 and C >= 0        Source: Lawson and Hanson 1974, ch. 23
    """
    from scipy.optimize import nnls

    force, speed, _ = objective.scales
    units = np.diag([force, force / speed, 0.0])[:, :2]
    triangle = objective.triangle(Bingham(force, force / speed, np.inf), units, measured=True)
    friction, damping = nnls(triangle[:, :2], triangle[:, 2])[0]
    return _fit_at(objective, Bingham(float(friction) * force, float(damping) * force / speed, np.inf))


class KnownOptimum(Exception):  # noqa: N818  # nothing went wrong
    """A descent has reached an optimum that is known."""


def grid_starts(objective: Objective) -> list[Bingham]:
    """Return the best points of the grid, best first.

    Equation: k = sum F f / sum f^2 with f = F(T0/k, C/k, 1)      Source: eq. (1)-(3), scaled by k
    """
    _, _, stroke = objective.scales
    pieces = [_coarse_record(t, GRID_SAMPLES // len(objective.prepared)) for t in one_at_a_time(objective.prepared)]
    slowest = max((t.displacement.size - 1) * t.step for t in objective.prepared)
    deltas = np.geomspace(1e-4, LARGEST_PRE_SLIP, DEFLECTION_AND_TIME_GRID[0]) * stroke
    taus = np.geomspace(min(p[1] for p in pieces), 0.1 * slowest, DEFLECTION_AND_TIME_GRID[1])
    found: list[tuple[float, Bingham]] = []
    for delta in deltas:
        for tau in taus:
            match, energy = _inner_products(pieces, float(delta), float(tau))
            if match > 0.0:
                k = match / energy
                found.append((-match * k, Bingham(float(delta) * k, float(tau) * k, k)))
    return [objective.clipped(start) for _, start in sorted(found)[:GRID_DESCENTS]]


def descend(objective: Objective, start: Bingham, known: float | None = None, free: int = 3) -> Fit:
    """Find the optimum from a starting point by trust-region least squares within the bounds.

    Parameters
    ----------
    objective : what is minimised
    start : of the search
    known : criterion of an optimum that is known already
    free : 2 to leave the stiffness where it starts

    Raises
    ------
    KnownOptimum : as soon as the criterion reaches the known one, which saves the rest of the way
    """
    norm = np.sqrt(objective.energy)
    begin, high = objective.to_search(start), objective.coordinates.high

    memory: dict[bytes, tuple[float, Array]] = {}

    def placed(moved: Array) -> tuple[Array, bytes]:
        x = np.concatenate([moved, begin[free:]])
        return x, x.tobytes()

    def at(moved: Array) -> tuple[float, Array]:
        x, key = placed(moved)
        if key not in memory:
            triangle = objective.triangle(objective.from_search(x), -objective.coordinates.slopes(x)) / norm
            memory[key] = float(triangle[:, 3] @ triangle[:, 3]), triangle
        return memory[key]

    def residuals_at(x: Array) -> Array:
        criterion, triangle = at(x)
        if known is not None and abs(criterion - known) <= SAME_OPTIMUM * known:
            raise KnownOptimum
        return triangle[:, 3]

    def slopes_at(x: Array) -> Array:
        return at(x)[1][:, :free]

    found = minimise(
        residuals_at,
        np.clip(begin, 1e-9, high - 1e-9)[:free],
        slopes_at,
        (np.zeros(free), high[:free]),
        precision=TOLERANCE,
        evaluations=EVALUATIONS,
        size=objective.measured.size,
    )
    x, _ = placed(found.x)
    return _settled(objective, x, Fit(objective.from_search(x), at(found.x)[0], objective))


STEP_SHARES = (1.0, 0.3, 0.1, 0.03, 0.01)
"""Parts of a Gauss-Newton step that are tried.

Reason: of a criterion without steps the first of them takes nearly all that there is to gain; not tuned."""


MUCH_OF_AN_ERROR = 0.1
"""Part of a standard error by which an optimum between steps may be missed, r.m.s. over T0, C and k."""


def ends_at_a_step(objective: Objective, parameters: Bingham) -> bool:
    """Tell whether the criterion hardly falls along the Gauss-Newton step from parameters, whatever its slope.

    Equation: W_s (1 - p e^2 / N) at the least, p = 3 parameters, N samples, e = `MUCH_OF_AN_ERROR`
    """
    x, high = objective.to_search(parameters), objective.coordinates.high
    triangle = objective.triangle(parameters, objective.coordinates.slopes(x))
    here = float(triangle[:, 3] @ triangle[:, 3]) / objective.energy
    step = np.linalg.lstsq(triangle[:, :3], triangle[:, 3], rcond=1e-12)[0]
    trials = (np.clip(x + share * step, 0.0, high) for share in STEP_SHARES)
    lowest = min(_fit_at(objective, objective.from_search(trial)).criterion for trial in trials)
    return lowest > here * (1.0 - 3.0 * MUCH_OF_AN_ERROR**2 / objective.measured.size)


def _settled(objective: Objective, x: Array, found: Fit) -> Fit:
    """Return the optimum in the limits of the law that it came next to, unless the criterion is less beside them."""
    limit = np.where(x < AT_ZERO, 0.0, x)
    if np.array_equal(limit, x):
        return found
    settled = _fit_at(objective, objective.from_search(limit))
    return settled if settled.criterion <= found.criterion * (1.0 + SAME_OPTIMUM) else found


def _fit_at(objective: Objective, parameters: Bingham) -> Fit:
    """Evaluate the criterion at parameters."""
    (left,) = objective.triangle(parameters, np.empty((3, 0)))[:, 0]
    return Fit(parameters, float(left**2) / objective.energy, objective)


def _coarse_record(record: PreparedRecord, samples: int) -> tuple[Array, float, Array, int]:
    """Return displacement at the samples, its step, force, and first counted sample of the first part of a record."""
    first = int(np.argmax(record.counted))
    stop = max(first + samples, 2 * first)
    displacement = np.ascontiguousarray(record.at_samples(record.displacement)[:stop])
    step = record.step * (record.displacement.size - 1) / (record.force.size - 1)
    return displacement, step, record.force[:stop], first


def _inner_products(pieces: list[tuple[Array, float, Array, int]], delta: float, tau: float) -> tuple[float, float]:
    """Return the sums of F f and of f^2 over the records."""
    match = energy = 0.0
    for displacement, step, force, first in pieces:
        shape = element_force(displacement, step, delta, tau, 1.0)[first:]
        match += float(force[first:] @ shape)
        energy += float(shape @ shape)
    return match, energy


# --- Evolutionary method ---

LEAST = (1e-4, 1e-4, 1e-4)
"""Least T0, C and 1/k of the search, in the units of the largest, since logarithms are searched."""
PENALTY = 10.0
"""Criterion of parameters outside the bounds of the separable method: ten times that of no model at all."""
LEAST_SPREAD = 1e-8
"""Spread of the criterion over the population at which the search ends; least squares does the rest."""


def fit_evolutionary(objective: Objective, config: EvolutionaryConfig, seed: int) -> Fit:
    """Find the optimum by the evolutionary search, refined by least squares."""
    return descend(objective, evolutionary_search(objective, config, seed))


def evolutionary_search(objective: Objective, config: EvolutionaryConfig, seed: int) -> Bingham:
    """Return the best member of the last generation of a differential evolution on the criterion.

    Equation: minimise W_s over log T0, log C, log 1/k   Source: Makowski and Knap 2021, eq. (4); Storn and Price 1997

    Parameters
    ----------
    objective : criterion and bounds, the same as of the separable method
    config : population, generations, tolerance
    seed : of the random draws

    Returns
    -------
    parameters, not yet refined by least squares
    """
    from scipy.optimize import Bounds, differential_evolution

    force, speed, stroke = objective.scales
    units = np.array([force, force / speed, stroke / force])
    high = units * LARGEST
    low = units * LEAST

    def parameters_at(logarithms: Array) -> Bingham:
        friction, damping, compliance = (float(p) for p in np.exp(logarithms))
        return Bingham(friction, damping, 1.0 / compliance)

    def criterion(logarithms: Array) -> float:
        parameters = parameters_at(logarithms)
        return objective.criterion(parameters) if objective.slips(parameters) else PENALTY

    found = differential_evolution(
        criterion,
        Bounds(np.log(low), np.log(high)),
        popsize=config.population,
        maxiter=config.generations,
        tol=config.tolerance,
        atol=LEAST_SPREAD,
        seed=seed,
        init="sobol",
        polish=False,
    )
    return parameters_at(found.x)
