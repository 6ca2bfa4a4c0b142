"""The separable method: a coarse grid in two parameters, then least squares with exact sensitivities.

Scaling T0 and C with k scales the force, F = k f(T0/k, C/k), so on the grid the stiffness follows
linearly from the rest and only delta = T0/k and tau = C/k are searched.
"""

from __future__ import annotations

from typing import overload

import numpy as np

from pzd.damper.element import element_force
from pzd.identify.objective import LARGEST_PRE_SLIP, Bingham, Fit, Objective, from_search, search_slopes, to_search
from pzd.identify.starts import graphical_start
from pzd.identify.trial import Trial
from pzd.record import Array

GRID = (12, 10)
"""Points of the grid in delta = T0/k and in tau = C/k."""
GRID_SAMPLES = 10_000
"""The grid is evaluated on at most this many samples, shared out among the trials."""
DESCENTS = 3
"""How many of the best grid points are followed down."""
SAME_OPTIMUM = 1e-6
"""Two descents whose criteria differ by less, relative, have reached the same optimum."""
_REMEMBERED = 2
"""Points whose forces are kept: where a descent stands, and where it has just tried to go."""
TOLERANCE = 1e-12
"""Tolerance of the least squares, relative, on parameters and criterion."""


def fit_separable(objective: Objective) -> Fit:
    """The global optimum of the criterion, from the graphical starting values and the grid.

    Starts are followed down until the best optimum has been reached twice. A second descent need not end: on one whose
    criterion has come this close to an optimum that is known, another does not lie by chance.
    """
    best = descend(objective, graphical_start(objective.trials))
    for start in grid_starts(objective):
        fit = descend(objective, start, best.criterion)
        if fit is None:
            return best
        best = min(best, fit, key=lambda f: f.criterion)
    return best


class _Reached(Exception):  # noqa: N818  # nothing went wrong
    """A descent has come to an optimum that is known."""


def grid_starts(objective: Objective, count: int = DESCENTS) -> list[Bingham]:
    """The best points of the grid, best first.

    Equation: k = sum F f / sum f^2 with f = F(T0/k, C/k, 1)      Source: eq. (1)-(3), scaled by k
    """
    _, _, stroke = objective.scales
    pieces = [_piece(t, GRID_SAMPLES // len(objective.trials)) for t in objective.trials]
    slowest = max((t.displacement.size - 1) * t.step for t in objective.trials)
    deltas = np.geomspace(1e-4, LARGEST_PRE_SLIP, GRID[0]) * stroke
    taus = np.geomspace(min(p[1] for p in pieces), 0.1 * slowest, GRID[1])
    found: list[tuple[float, Bingham]] = []
    for delta in deltas:
        for tau in taus:
            match, energy = _overlap(pieces, float(delta), float(tau))
            if match > 0.0:
                k = match / energy
                found.append((-match * k, Bingham(float(delta) * k, float(tau) * k, k)))
    return [objective.clipped(start) for _, start in sorted(found)[:count]]


@overload
def descend(objective: Objective, start: Bingham) -> Fit: ...
@overload
def descend(objective: Objective, start: Bingham, known: float) -> Fit | None: ...
def descend(objective: Objective, start: Bingham, known: float | None = None) -> Fit | None:
    """The optimum reached from a starting point by trust-region least squares within the bounds.

    Parameters
    ----------
    objective : what is minimised
    start : where from
    known : criterion of an optimum that is known already

    Returns
    -------
    the optimum; None as soon as the known one is reached, which is that much of the way saved
    """
    from scipy.optimize import least_squares

    stroke = objective.scales[2]
    norm = np.sqrt(objective.energy)
    low, high = objective.search_bounds

    def reduced(fit: Fit) -> Array:
        """(4, 4) triangle whose last column and first three have the products of residuals and slopes."""
        together = np.column_stack([fit.slopes @ -search_slopes(fit.parameters, stroke), fit.residuals])
        together /= norm
        return np.asarray(np.linalg.qr(together, mode="r"))

    memory: dict[bytes, tuple[Fit, Array]] = {}

    def at(x: Array) -> tuple[Fit, Array]:
        key = x.tobytes()
        if key not in memory:
            if len(memory) == _REMEMBERED:
                memory.pop(next(iter(memory)))
            fit = _fit_at(objective, from_search(x, stroke))
            memory[key] = fit, reduced(fit)
        return memory[key]

    def residuals_at(x: Array) -> Array:
        fit, triangle = at(x)
        if known is not None and abs(fit.criterion - known) <= SAME_OPTIMUM * known:
            raise _Reached
        return triangle[:, 3]

    def slopes_at(x: Array) -> Array:
        return at(x)[1][:, :3]

    inside = np.clip(to_search(start, stroke), low + 1e-9, high - 1e-9)
    try:
        found = least_squares(
            residuals_at,
            inside,
            jac=slopes_at,
            bounds=(low, high),
            x_scale="jac",
            xtol=TOLERANCE,
            ftol=TOLERANCE,
            gtol=TOLERANCE,
            max_nfev=100,
        )
    except _Reached:
        return None
    return at(found.x)[0]


def _fit_at(objective: Objective, parameters: Bingham) -> Fit:
    """The parameters as a fit, however good."""
    residuals, slopes = objective.residuals_and_slopes(parameters)
    return Fit(parameters, float(residuals @ residuals) / objective.energy, residuals, slopes)


def _piece(trial: Trial, samples: int) -> tuple[Array, float, Array, int]:
    """Coarse displacement, its step, the force, and the first counted sample, of the trial's first part."""
    first = int(np.argmax(trial.counted))
    stop = max(first + samples, 2 * first)
    displacement = np.ascontiguousarray(trial.at_samples(trial.displacement)[:stop])
    step = trial.step * (trial.displacement.size - 1) / (trial.force.size - 1)
    return displacement, step, trial.force[:stop], first


def _overlap(pieces: list[tuple[Array, float, Array, int]], delta: float, tau: float) -> tuple[float, float]:
    """Sums of F f and of f^2 over the pieces."""
    match = energy = 0.0
    for displacement, step, force, first in pieces:
        shape = element_force(displacement, step, delta, tau, 1.0)[first:]
        match += float(force[first:] @ shape)
        energy += float(shape @ shape)
    return match, energy
