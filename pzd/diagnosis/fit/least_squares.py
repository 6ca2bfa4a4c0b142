"""Least-squares fit of T0, C and k of every base row together with some effects, and its standard errors.

Every residual is in units of noise with the tests' nuisances integrated out, so that half the sum of squares is minus
the logarithm of the likelihood, and fits of different effects can be compared.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from pzd.damper.model import Damper, against_nature
from pzd.diagnosis.fit.likelihood import residuals_of
from pzd.diagnosis.fit.problem import Problem, Unknown
from pzd.diagnosis.fit.sensitivities import BlockJacobian, Linearisation, active_columns, linearise
from pzd.fit.element_coordinates import ElementCoordinates
from pzd.fit.intervals import LEVEL, covariance, disagreement, widening
from pzd.fit.least_squares import Optimum, minimise
from pzd.record import Array

MOST_EVALUATIONS = 20
"""Most evaluations of the model in a search, unless said otherwise.

Reason: time; what is adopted is searched on, see `thresholds.MOST_EVALUATIONS_OF_BEST`."""
PRECISION = 1e-5
"""Relative change of the sum of squares at which a search ends whose outcome is compared with others.

Reason: of ten thousand squares of noise a tenth of one, far less than `adopt_bic` asks for; what is quoted goes on, see
`polished`."""
POLISHED_PRECISION = 1e-12
"""Relative change at which the search for an optimum that is quoted ends.

Reason: beyond it the path of the element, integrated to `likelihood.SIMULATION_TOLERANCE`, shows its own steps."""
POLISHED_EVALUATIONS = 100
"""Most evaluations of that search: five times those of any other; a bent valley may take them."""
POLISHED_OFFSET = 1e-2
"""Largest distance to the optimum of what is quoted [standard errors].

Reason: of a 95 % interval of 1.96 standard errors half a hundredth, less than its second digit shows."""
PRIOR_DEVIATION = 1.5
"""Prior standard deviation of ln C and ln k about their starting values: fixes a row where the tests do not show it (C
under an open relief valve, k of a soft drive), and nowhere else. Between values that no test shows there is none.

Reason: a factor of e^1.5 = 4.5 either way is no surprise between what identify reads from loops and an optimum with an
effect beside it."""
LARGEST_LOG_RATIO = 3.0
"""C and 1/k stay within e^3 = 20 times their starting values, or what no test shows; their limit zero is never barred.

Reason: two standard deviations of the prior; what ends there is not shown by the tests."""

LARGEST_KEPT_JACOBIAN = 100_000
"""Derivatives that an optimum keeps at most.

Reason: 0.8 MB, so that a hundred candidates take a fifth of the memory of a command; campaigns of average cycles have
fewer."""


@dataclass(frozen=True, eq=False)
class FitResult:
    """A least-squares optimum: the damper, its residuals and its Jacobian."""

    damper: Damper
    effects: tuple[str, ...]
    optimum: Array
    """(3 b + e,) the optimum in the units of the search."""
    residuals: tuple[Array, ...]
    """(w,) per observation, in units of noise."""
    simulated: tuple[Array, ...]
    """(n,) per observation, force at the compared samples [N]."""
    unknowns: tuple[Unknown, ...]
    prior: Array
    """(2 b, 3 b + e) Jacobian of the prior on C and k."""
    derive_jacobian: Callable[[], BlockJacobian]
    """Gives `jacobian`: computes it anew where those of all candidates together would fill the memory."""
    offset: float = 0.0
    """Distance to the optimum by the residuals [standard errors], see `pzd.fit.least_squares`."""

    @property
    def converged(self) -> bool:
        """Whether this is so near an optimum that its figures may be quoted."""
        return self.offset <= POLISHED_OFFSET

    @property
    def unphysical(self) -> tuple[str, ...]:
        """Its effects whose values are not physical, see `against_nature`; what belongs to the law is none of them."""
        return tuple(name for name in against_nature(self.damper) if name in self.effects)

    @cached_property
    def jacobian(self) -> BlockJacobian:
        """Of all residuals by the search variables."""
        return self.derive_jacobian()

    @cached_property
    def column_basis(self) -> Array:
        """(w, p) orthonormal basis of the columns of the Jacobian, p of 3 b + e: those that any test shows."""
        columns = self.jacobian.dense()
        return np.asarray(np.linalg.qr(columns[:, np.any(columns != 0.0, axis=0)]).Q)

    @cached_property
    def covariance(self) -> Array:
        """(3 b + e, 3 b + e) covariance of the search variables by noise alone; infinite where no test shows one."""
        return covariance(np.concatenate([self.jacobian.dense(), self.prior]))

    @property
    def misfit(self) -> float:
        """Sum of squares in units of noise: minus twice the logarithm of the likelihood, but for a constant."""
        return float(sum(r @ r for r in self.residuals))

    @property
    def size(self) -> int:
        """Number of residuals."""
        return sum(r.size for r in self.residuals)


def fit(
    problem: Problem,
    effects: Sequence[str],
    start: Array,
    evaluations: int = MOST_EVALUATIONS,
    precision: float = PRECISION,
) -> FitResult:
    """Fit a damper with some effects by trust-region least squares within the limits, from a starting point.

    Parameters
    ----------
    problem : observations and starting values
    effects : names of the effects fitted with the base rows
    start : (3 b + e,) in the units of the search
    evaluations : of the model, at most
    precision : relative change of the sum of squares at which the search ends
    """
    unknowns = problem.unknowns(effects)

    def search(begin: Array) -> tuple[Array, Linearisation, Optimum]:
        return _search(problem, unknowns, begin, start.size, evaluations, precision)

    found, left, optimum = search(start)
    if (begin := _beyond_steps(problem, unknowns, found, left)) is not None:
        again = search(begin)
        found, left, optimum = min((found, left, optimum), again, key=lambda each: each[2].sum_of_squares)
    limits = _bounds(problem, unknowns)
    kept = left.jacobian if sum(block.size for _, block in left.jacobian.blocks) <= LARGEST_KEPT_JACOBIAN else None
    return FitResult(
        problem.point(found, unknowns).damper,
        tuple(name for name in effects if name not in problem.law),
        found,
        left.residuals,
        left.simulated,
        unknowns,
        _prior(problem, len(unknowns)),
        (lambda: kept) if kept is not None else lambda: linearise(problem, unknowns, found, limits).jacobian,
        optimum.offset,
    )


def plain_fit(problem: Problem) -> FitResult:
    """Fit T0, C, k and the law without any effect, from the starting values of the problem."""
    return fit(problem, (), problem.plain_start())


def refit(problem: Problem, damper: Damper, evaluations: int = MOST_EVALUATIONS) -> FitResult:
    """Fit a damper with the effects that it has, from its present parameters; see `fit`."""
    return fit(problem, tuple(damper.effects), problem.start_with(damper), evaluations)


def polished(problem: Problem, fitted: FitResult) -> FitResult:
    """Search a fit on until it is an optimum by its residuals: what is adopted and quoted."""
    return fit(problem, fitted.effects, fitted.optimum, POLISHED_EVALUATIONS, POLISHED_PRECISION)


def projected_out(frame: Array, values: Array) -> Array:
    """Project values (w,) or (w, c) onto the complement of orthonormal columns (w, p)."""
    return values - frame @ (frame.T @ values)


def profiled_misfit(problem: Problem, damper: Damper) -> float:
    """Return the smallest misfit over T0, C, k and the law while the effects stay as a damper has them."""
    unknowns = problem.unknowns(tuple(damper.effects))
    start = problem.start_with(damper)
    _, left, _ = _search(problem, unknowns, start, problem.plain_start().size, MOST_EVALUATIONS, PRECISION)
    return float(left.stacked @ left.stacked)


def _search(
    problem: Problem, unknowns: Sequence[Unknown], start: Array, free: int, evaluations: int, precision: float
) -> tuple[Array, Linearisation, Optimum]:
    """Minimise over the first `free` variables; return the (3 b + e,) optimum, linearised there and judged.

    Variables that no observation depends on, such as T0 of a left-out voltage, stay where they are: free, one wanders
    between its limits, and where it meets one the step of all variables ends.
    """
    low, high = _bounds(problem, unknowns)
    begin, limits = np.clip(start, low + 1e-9, high - 1e-9), (low[:free], high[:free])
    elastic = range(2, 3 * len(problem.base), 3)
    if problem.rigid:
        begin[elastic] = 0.0
    start_of_rows, prior = problem.start(), _prior(problem, len(unknowns))
    unseen = np.tile(problem.unseen, len(problem.base))
    active = sorted({j for o in problem.observations for j in active_columns(problem, unknowns, o, free)})
    if problem.rigid:
        active = [j for j in active if j not in elastic]

    def all_variables(x: Array) -> Array:
        at = begin.copy()
        at[active] = x
        return at

    @lru_cache(maxsize=2)  # where the search is, and where it tries to go
    def linearised_at(x: bytes) -> Linearisation:
        return linearise(problem, unknowns, all_variables(np.frombuffer(x)), limits)

    def residuals_at(x: Array) -> Array:
        shown, begun = np.maximum(all_variables(x)[: start_of_rows.size], unseen), np.maximum(start_of_rows, unseen)
        return np.concatenate([linearised_at(x.tobytes()).stacked, prior[:, : start_of_rows.size] @ (shown - begun)])

    def slopes_at(x: Array) -> Array:
        at = all_variables(x)
        shown = np.ones(at.size)
        shown[: unseen.size] = at[: unseen.size] > unseen
        return np.concatenate([linearised_at(x.tobytes()).jacobian.dense(active), (prior * shown)[:, active]])

    found = minimise(
        residuals_at,
        begin[active],
        slopes_at,
        (low[active], high[active]),
        precision=precision,
        evaluations=evaluations,
        largest_offset=POLISHED_OFFSET,
    )
    return all_variables(found.x), linearised_at(found.x.tobytes()), found


STEPS_OF_COMPLIANCE = (-np.inf, -4.0 * np.log(2.0), -2.0 * np.log(2.0), -np.log(2.0), np.log(2.0), 2.0 * np.log(2.0))
"""Changes of the coordinate of 1/k by which a search is taken to the next step of the misfit: to a rigid spring, 16, 4
and 2 times as stiff, 2 and 4 times as soft.

Reason: a flank of a few samples has a step for each, and its length goes with the root of 1/k."""
STEP_OF_MISFIT = 1.0
"""Misfit [squares of noise] that another oil spring must gain for the search to go on from there.

Reason: less tells no two springs apart."""
AS_NOISE = 2.0
"""Misfit per residual up to which another oil spring is tried.

Reason: where a law is missing all misfits are larger, and a step of them is no flank; not tuned."""


def _beyond_steps(problem: Problem, unknowns: Sequence[Unknown], x: Array, left: Linearisation) -> Array | None:
    """Return an optimum with oil springs of less misfit, to search on from; None where there are none.

    Behind a stiff spring a friction turns within a few samples, and the misfit over k has a step wherever one more of
    them changes sides: a search ends between two such steps.

    Parameters
    ----------
    problem : observations and starting values
    unknowns : of the effects
    x : (3 b + e,) optimum in the units of the search
    left : linearised there
    """
    rows = len(problem.base)
    springs = x[2 : 3 * rows : 3]
    stiff = springs < problem.unseen[2]
    low, high = (limit[2 : 3 * rows : 3] for limit in _bounds(problem, unknowns))

    def misfits(residuals: Sequence[Array]) -> Array:
        """Return the (b,) misfit of the tests of each row."""
        found = np.zeros(rows)
        for o, r in zip(problem.observations, residuals, strict=True):
            if o.base_row >= 0:
                found[o.base_row] += float(r @ r)
        return found

    here, counts = misfits(left.residuals), misfits([np.ones(r.size) for r in left.residuals])
    stiff &= here <= AS_NOISE * counts
    if problem.rigid or not stiff.any():
        return None
    best, begin = here - STEP_OF_MISFIT, springs.copy()
    for step in STEPS_OF_COMPLIANCE:
        tried = np.where(stiff, np.clip(springs + step, low, high), springs)
        at = x.copy()
        at[2 : 3 * rows : 3] = tried
        found = misfits(residuals_of(problem.observations, problem.point(at, unknowns).damper))
        better = found < best
        best, begin = np.where(better, found, best), np.where(better, tried, begin)
    if np.array_equal(begin, springs):
        return None
    at = x.copy()
    at[2 : 3 * rows : 3] = begin
    return at


def _prior(problem: Problem, effects: int) -> Array:
    """Return the (2 b, 3 b + e) Jacobian of the prior on ln C and ln k, in its standard deviations."""
    rows = len(problem.base)
    columns = [3 * row + i for row in range(rows) for i in (1, 2)]
    return np.eye(3 * rows + effects)[columns] / PRIOR_DEVIATION


LARGEST_LAG = 0.2
"""C/k up to which oil springs are searched whatever they begin at, as a share of stroke over peak speed.

Reason: a fit without the branch of a seal gives its friction, which turns at once, a rigid spring, whatever that of the
oil is; beyond this the force of a sine falls by a fiftieth."""


def _softest(problem: Problem) -> list[float]:
    """Return the stiffness (b,) of each base row at `LARGEST_LAG` [N/m]; infinite for friction alone, without a lag."""
    lag = LARGEST_LAG * problem.scales.stroke / (problem.scales.speed or 1.0)
    return [row.C_Ns_per_m / lag if row.C_Ns_per_m > 0.0 else np.inf for row in problem.base]


def _bounds(problem: Problem, unknowns: Sequence[Unknown]) -> tuple[Array, Array]:
    """Return the limits of the search: rows within a ratio of their start, beyond which dampers are rigid or dead."""
    start = problem.start().reshape(-1, 3)
    low, high = np.zeros_like(start), np.maximum(start, problem.unseen) + LARGEST_LOG_RATIO
    high = np.minimum(high, np.maximum(start, problem.coordinates.high))
    high[:, 2] = np.maximum(high[:, 2], [problem.coordinates.to_search(0.0, 0.0, k)[2] for k in _softest(problem)])
    high[:, 0] = 2.0
    bounds = np.reshape([u.bounds for u in unknowns], (-1, 2))
    return np.concatenate([low.ravel(), bounds[:, 0]]), np.concatenate([high.ravel(), bounds[:, 1]])


# --- Standard errors and intervals


def standard_errors(fitted: FitResult) -> Array:
    """Compute the (e,) standard errors of the effect parameters in their own units.

    They are wider where the fit leaves more than noise or the tests disagree.

    Equation: s_j^2 = C_jj w_j, w as in `pzd.fit.intervals.widening`
    """
    of_effects = slice(fitted.optimum.size - len(fitted.unknowns), fitted.optimum.size)
    searched = fitted.optimum[of_effects]
    slopes = np.array([u.derivative(float(x)) for u, x in zip(fitted.unknowns, searched, strict=True)])
    return np.asarray(np.abs(slopes) * search_errors(fitted, of_effects))


def base_half_widths(fitted: FitResult, coordinates: ElementCoordinates) -> Array:
    """Compute the (b, 3) half widths of the 95 % intervals of T0, C and 1/k of every base row, the effects free.

    Equation: 1.96 s, s as in `standard_errors`, from that of the search coordinates to first order

    Parameters
    ----------
    fitted : the optimum
    coordinates : of the search
    """
    of_base = slice(0, fitted.optimum.size - len(fitted.unknowns))
    units = np.array([np.diag(coordinates.slopes(row)) for row in fitted.optimum[of_base].reshape(-1, 3)])
    return np.asarray(LEVEL * search_errors(fitted, of_base).reshape(-1, 3) * units)


def search_errors(fitted: FitResult, of: slice) -> Array:
    """Compute the standard errors of some variables in the units of the search; see `standard_errors`."""
    slopes = np.split(fitted.jacobian.dense(), np.cumsum([r.size for r in fitted.residuals])[:-1])
    apart = disagreement(slopes, fitted.residuals, fitted.covariance, of)
    wider = widening(apart, fitted.misfit, fitted.size - fitted.optimum.size)
    return np.asarray(np.sqrt(np.diag(fitted.covariance)[of] * wider))
