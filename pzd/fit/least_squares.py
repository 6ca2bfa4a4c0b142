"""The least squares of every fit, and whether what it found is an optimum: by the residuals, not by the solver's word.

A solver ends where it makes little progress; that may be a plateau, a limit, or where a parameter does nothing. So an
optimum counts as converged where its Jacobian has full rank, and the residuals are orthogonal to its columns as far as
their own size can tell. Certified on the 27 nonlinear regressions of the NIST Statistical Reference Datasets
(tests/fit/test_nist.py).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from pzd.record import Array, Mask, Rows

PRECISION = 1e-15
"""Relative change of the variables, of the sum of squares and of its gradient at which a search ends.

Reason: a few roundings, so that it goes on for as long as there is progress; near an optimum two steps do that."""
MOST_EVALUATIONS = 2000
"""Most evaluations of the residuals in a search.

Reason: the longest of NIST StRD takes 1376 (Bennett5, whose valley is bent and flat); what takes more is told."""
LARGEST_OFFSET = 1e-3
"""Largest relative offset of a converged optimum.

Reason: Bates and Watts 1981: then the rest of the way changes no confidence region by more than a thousandth."""
LARGEST_CONDITION = 1e12
"""Largest ratio of the singular values of the Jacobian, its columns scaled to one, at which it has full rank.

Reason: rounding in the residuals (1e-16) moves the variables by this factor; beyond it they keep less than four digits.
NIST StRD goes to 1e8."""
ROUNDING = 32.0 * float(np.finfo(np.float64).eps)
"""Rounding of a residual, as a share of what its variables contribute to it: the root of a thousand operations."""
BY_CHANCE = 3.0
"""Multiple of the resolution that residuals may have along the columns of the Jacobian: three standard deviations."""
STANDARD_ERRORS_AT_LIMIT = 1e-2
"""Distance from a limit within which a variable lies at it [standard errors of that variable alone].

Reason: the search stays inside its limits and comes as near as its precision lets it."""
MOST_CLOSING_STEPS = 3
"""Most Gauss-Newton steps after the search.

Reason: they converge quadratically from where the sum of squares, flat to its last digit, tells no more apart."""
UNDETERMINED_SHARE = 0.3
"""Part of a direction that moves no residual, from which on a variable is told as undetermined; the largest always is.

Reason: of two that cancel each has 0.7, of ten 0.3."""


@dataclass(frozen=True, eq=False)
class Optimum:
    """Where a search ended, and how far that is from an optimum."""

    x: Array
    """(p,) variables."""
    residuals: Array
    """(n,)."""
    jacobian: Array
    """(n, p) derivatives of the residuals by the variables."""
    evaluations: int
    """Of the residuals."""
    offset: float
    """Relative offset: distance to the optimum in standard errors, r.m.s. over the free variables."""
    condition: float
    """Ratio of the singular values of the Jacobian of the free variables, its columns scaled to one."""
    at_limit: Mask
    """(p,) whether the variable lies at one of its limits and the sum of squares falls beyond it."""
    undetermined: tuple[int, ...]
    """Variables that can move, alone or against each other, without any change of the residuals."""
    reason: str
    """Why this is no optimum; empty where it is."""

    @property
    def converged(self) -> bool:
        """Whether this is an optimum, that of the limits where some variables lie at theirs."""
        return not self.reason

    @property
    def sum_of_squares(self) -> float:
        """Sum of the squared residuals."""
        return float(self.residuals @ self.residuals)


def minimise(
    residuals: Callable[[Array], Array],
    start: Array,
    jacobian: Callable[[Array], Array] | None = None,
    bounds: tuple[Array, Array] | None = None,
    *,
    precision: float = PRECISION,
    evaluations: int = MOST_EVALUATIONS,
    largest_offset: float = LARGEST_OFFSET,
    resolution: float = 0.0,
    size: int | None = None,
) -> Optimum:
    """Minimise a sum of squares from a starting point within limits, and judge what was found.

    Equation: min over x of |r(x)|^2, by trust-region reflective steps
                                                Source: Branch, Coleman and Li 1999, SIAM J. Sci. Comput. 21, 1; scipy

    Parameters
    ----------
    residuals : gives (n,) at variables (p,)
    start : (p,); moved inside the limits
    jacobian : gives (n, p) at variables (p,), what is not finite counts as 0; by three-point differences where there
        is none
    bounds : (p,) least and (p,) largest values of the variables
    precision : relative change at which the search ends
    evaluations : of the residuals, at most
    largest_offset : of an optimum that counts as converged
    resolution : size of a residual up to which the model is computed at random; an exact fit leaves no more
    size : number of residuals, where n rows with the same inner products stand for more

    Raises
    ------
    ValueError : when the residuals at the start are not finite
    """
    from scipy.optimize import least_squares

    low, high = bounds if bounds is not None else (np.full(start.size, -np.inf), np.full(start.size, np.inf))
    if start.size == 0:
        left = np.asarray(residuals(start), dtype=np.float64)
        limits = _Limits(low, high, largest_offset, resolution, size or left.size)
        return _judged(start, left, np.zeros((left.size, 0)), limits, 1)
    slopes = None if jacobian is None else _finite(jacobian)
    way: Any = slopes or "3-point"
    found = least_squares(
        residuals,
        np.clip(start, low, high),
        jac=way,
        bounds=(low, high),
        x_scale="jac",
        ftol=precision,
        xtol=precision,
        gtol=precision,
        max_nfev=evaluations,
    )
    limits = _Limits(low, high, largest_offset, resolution, found.fun.size if size is None else size)
    best = _judged(found.x, found.fun, np.asarray(found.jac), limits, int(found.nfev))
    if slopes is None or found.status <= 0:
        return best
    for _ in range(MOST_CLOSING_STEPS):
        if best.converged or best.undetermined or best.at_limit.any():
            break
        x = best.x - np.linalg.lstsq(best.jacobian, best.residuals, rcond=None)[0]
        if not np.all((low < x) & (x < high)):
            break
        nearer = _judged(x, residuals(x), slopes(x), limits, best.evaluations + 1)
        grows = nearer.sum_of_squares > best.sum_of_squares * (1.0 + ROUNDING)
        if grows or not nearer.offset < best.offset:
            break
        best = nearer
    return best


def _finite(jacobian: Callable[[Array], Array]) -> Callable[[Array], Array]:
    """Return derivatives in which a sample without a slope, as where a law of the flow is vertical, has no say."""
    return lambda x: np.nan_to_num(jacobian(x), posinf=0.0, neginf=0.0)


def minimise_from(starts: Iterable[Array], search: Callable[[Array], Optimum]) -> Optimum:
    """Return the least of the optima from several starting points.

    Parameters
    ----------
    starts : (p,) each, one or more
    search : `minimise` with all else given
    """
    return min((search(start) for start in starts), key=lambda found: found.sum_of_squares)


@dataclass(frozen=True, eq=False)
class _Limits:
    """What a point is judged by."""

    low: Array
    high: Array
    offset: float
    resolution: float
    size: int


def _judged(x: Array, residuals: Array, jacobian: Array, limits: _Limits, evaluations: int) -> Optimum:
    """Judge a point by rank, limits, and the orthogonality of the residuals to the columns of the Jacobian.

    Equation: P = |Q_1' r| / sqrt(p) / (|Q_2' r| / sqrt(n - p)), Q_1 a basis of the columns, Q_2 of the rest
                                                        Source: Bates and Watts 1981, Technometrics 23, 179
    """
    if not (np.all(np.isfinite(residuals)) and np.all(np.isfinite(jacobian))):
        nowhere, reason = np.zeros(x.size, dtype=np.bool_), "the residuals or their derivatives are not finite"
        return Optimum(x, residuals, jacobian, evaluations, np.inf, np.inf, nowhere, (), reason)
    norms = np.linalg.norm(jacobian, axis=0)
    spread = float(np.linalg.norm(residuals)) / np.sqrt(max(limits.size - x.size, 1))
    at_limit = _at_limit(x, residuals @ jacobian, norms, (limits.low, limits.high), spread)
    free = np.flatnonzero(~at_limit)
    scaled = jacobian[:, free] / np.where(norms[free] > 0.0, norms[free], 1.0)
    # The triangle has the inner products of columns and residuals; its last row is what is orthogonal to all columns.
    triangle = np.asarray(np.linalg.qr(np.column_stack([scaled, residuals]), mode="r"))
    left, sizes, right = np.linalg.svd(triangle[: free.size, : free.size], full_matrices=False)
    largest = float(sizes[0]) if sizes.size else 0.0
    kept = sizes * LARGEST_CONDITION > largest
    missing = free.size - int(np.count_nonzero(kept))
    condition = np.inf if missing else largest / float(sizes[-1]) if free.size else 1.0
    along = left.T @ triangle[: free.size, -1]
    rest = float(np.linalg.norm(triangle[free.size :, -1])) / np.sqrt(max(limits.size - free.size, 1))
    # An exact fit leaves rounding alone, which is orthogonal to nothing.
    rounding = ROUNDING * float(np.linalg.norm(np.abs(jacobian) @ np.abs(x))) / np.sqrt(max(limits.size, 1))
    towards = float(np.linalg.norm(along)) / np.sqrt(max(free.size, 1))
    least = max(rest, limits.resolution)
    offset = towards / least if least > 0.0 else np.inf if towards > rounding else 0.0
    undetermined = _undetermined(right, kept, free, norms) if missing else ()
    reason = ""
    if missing:
        reason = f"no residual tells variables {', '.join(map(str, undetermined))} apart, or depends on them"
    elif offset > limits.offset and towards > max(rounding, BY_CHANCE * limits.resolution):
        reason = f"ended after {evaluations} evaluations, {offset:.2g} standard errors from an optimum"
    return Optimum(x, residuals, jacobian, evaluations, offset, condition, at_limit, undetermined, reason)


def _at_limit(x: Array, gradient: Array, norms: Array, bounds: tuple[Array, Array], spread: float) -> Mask:
    """Return (p,) whether a variable lies at a limit and the sum of squares falls beyond it."""
    near = STANDARD_ERRORS_AT_LIMIT * spread / np.where(norms > 0.0, norms, np.inf)
    near = np.maximum(near, np.sqrt(ROUNDING) * np.maximum(1.0, np.abs(x)))
    low, high = bounds
    return np.asarray(((x - low <= near) & (gradient > 0.0)) | ((high - x <= near) & (gradient < 0.0)))


def _undetermined(right: Array, kept: Mask, free: Rows, norms: Array) -> tuple[int, ...]:
    """List the variables of the directions (q, q) that move no residual."""
    unmoved = right[kept.size :] if right.shape[0] > kept.size else right[~kept]
    share = np.max(np.abs(unmoved), axis=0)
    found = (share >= min(UNDETERMINED_SHARE, float(share.max()))) | (norms[free] == 0.0)
    return tuple(int(j) for j in free[found])
