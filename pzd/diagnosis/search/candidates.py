"""Candidates: every effect that can be named, fitted one at a time together with those already adopted."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from pzd.damper.confounders import confounders, known
from pzd.damper.effect import Effect
from pzd.damper.effects import library, nameable
from pzd.diagnosis import thresholds
from pzd.diagnosis.cleaned_records import MOVING_TEMPERATURE, end_temperatures
from pzd.diagnosis.fit.least_squares import MOST_EVALUATIONS, FitResult, fit, projected_out, refit
from pzd.diagnosis.fit.problem import BOUND, Problem, Unknown
from pzd.diagnosis.fit.sensitivities import linearise
from pzd.diagnosis.search.determination import force_at_rest, nearly_others
from pzd.record import CONSTANT_SHARE, Array

# --- Starting values, and the drop in misfit that a linearised step promises from each


def sorted_starts(problem: Problem, before: FitResult, effect: Effect) -> list[Array]:
    """Return all starting values of an effect, sorted by the misfit that one linearised step promises from each.

    Equation: min_b,d |r_s - J_b b - J_s d|^2 at each start s, J_b of the base rows at `before`
                                                                Source: Gauss-Newton step

    Parameters
    ----------
    problem : observations and starting values
    before : optimum with the effects adopted so far
    effect : whose starting values are sorted

    Returns
    -------
    each (unknowns,) in the units of the search, the smallest misfit first
    """
    starts = starts_of(problem, before, effect)
    if len(starts) == 1:
        return starts
    promised = [_promised_misfit(problem, before, effect, start) for start in starts]
    return [starts[i] for i in np.argsort(promised, kind="stable")]


@dataclass(frozen=True, eq=False)
class Promise:
    """What one linearised step promises of an effect from its most promising starting values."""

    effect: Effect
    problem: Problem
    """With the parameters of the effect per voltage, if they scale with T0."""
    start: Array
    """In the units of the search."""
    misfit: float


def most_promising(
    problem: Problem,
    before: FitResult,
    effects: Sequence[Effect],
    reached: Mapping[str, Array] | None = None,
    jobs: int = 1,
) -> list[Promise]:
    """Return what one linearised step promises of some effects, the smallest misfits first.

    Parameters
    ----------
    problem : observations and starting values
    before : optimum with the effects adopted so far
    effects : to be tried
    reached : values that an earlier search of an effect reached, by its name: they take the place of its starts
    jobs : effects that are linearised at the same time
    """
    _ = before.column_basis  # needed by every effect: computed once, before they go to threads of their own

    def promise(effect: Effect) -> Promise:
        own, values = problem.with_friction_scaling(effect), (reached or {}).get(effect.name)
        starts = starts_of(own, before, effect)
        starts = starts if values is None or values.size != starts[0].size else [values]
        found = [(_promised_misfit(own, before, effect, start), start) for start in starts]
        misfit, start = min(found, key=lambda each: each[0])
        return Promise(effect, own, start, misfit)

    with ThreadPoolExecutor(max(jobs, 1)) as pool:
        return sorted(pool.map(promise, effects), key=lambda each: each.misfit)


def promised_drop(problem: Problem, before: FitResult, effect: Effect) -> float:
    """Compute the largest drop in misfit that a linearised step promises, from the starts or from near zero.

    Parameters
    ----------
    problem : observations and starting values
    before : optimum with the effects adopted so far
    effect : to be tried

    Returns
    -------
    in the unit of the misfit, squares of residuals in units of noise; negative where every step is to the worse
    """
    starts = starts_of(problem, before, effect)
    share = thresholds.LINEARISED_SHARE
    faint = [towards_neutral(problem, before, effect, start, share) for start in starts]
    return before.misfit - min(_promised_misfit(problem, before, effect, start) for start in (*starts, *faint))


def starts_of(problem: Problem, before: FitResult, effect: Effect) -> list[Array]:
    """Return all combinations of the starting values of an effect, each (unknowns,) in the units of the search.

    A parameter with one value per voltage starts alike at all of them, or in proportion to T0.

    Parameters
    ----------
    problem : observations and starting values
    before : optimum with the effects adopted so far
    effect : whose starting values are combined
    """
    unknowns = _new_unknowns(problem, before, effect)
    parameters = {u.parameter.name: u.parameter for u in unknowns}

    def searched(unknown: Unknown, start: float) -> float:
        if unknown.node is not None and unknown.parameter.with_friction:
            start *= problem.relative_friction(unknown.node)
        return float(np.log(max(start, 1.0 / BOUND))) if unknown.parameter.search.logarithmic else start

    grid = itertools.product(*(parameter.search.starts_on(problem.scales) for parameter in parameters.values()))
    starts = [dict(zip(parameters, values, strict=True)) for values in grid]
    return [np.array([searched(u, start[u.parameter.name]) for u in unknowns]) for start in starts]


def towards_neutral(problem: Problem, before: FitResult, effect: Effect, start: Array, share: float) -> Array:
    """Return starting values at a share of the way from those that switch the effect off.

    Parameters
    ----------
    problem : observations and starting values
    before : optimum with the effects adopted so far
    effect : to be tried
    start : (unknowns,) in the units of the search
    share : of the way: 0 switches the effect off, 1 is the start itself

    Returns
    -------
    (unknowns,) in the units of the search
    """
    unknowns = _new_unknowns(problem, before, effect)
    return np.array([u.to_search(u.towards_neutral(float(x), share)) for u, x in zip(unknowns, start, strict=True)])


def _new_unknowns(problem: Problem, before: FitResult, effect: Effect) -> tuple[Unknown, ...]:
    """Return the unknowns of an effect beside those of `before`."""
    return problem.unknowns((*before.effects, effect.name))[len(before.unknowns) :]


def _promised_misfit(problem: Problem, before: FitResult, effect: Effect, start: Array) -> float:
    """Return the sum of squares after one linearised step from a start; infinite where the derivatives are."""
    effects = (*before.effects, effect.name)
    unknowns = problem.unknowns(effects)
    here = np.concatenate([before.optimum, start])
    new = range(before.optimum.size, here.size)
    limits = np.full(here.size, -np.inf), np.full(here.size, np.inf)
    left = linearise(problem, unknowns, here, limits, new)
    r, columns = (projected_out(before.column_basis, values) for values in (left.stacked, left.jacobian.dense(new)))
    if not np.all(np.isfinite(columns)):
        return np.inf  # a power law whose flow stands still at a sample has no slope there
    size = np.linalg.norm(columns, axis=0)
    columns = columns / np.where(size > 0.0, size, 1.0)
    rest = r - columns @ np.linalg.lstsq(columns, r, rcond=1e-6)[0]
    return float(rest @ rest)


# --- Candidates


PLACES_PER_VOLTAGE = ("stroke", "flow", "parallel", "branch")
"""Places of effects whose parameters may differ by voltage."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """One effect fitted together with the base rows and the effects adopted so far."""

    effect: str
    fitted: FitResult
    delta_bic: float
    """Change of the Bayesian criterion against the model without it; negative where it improves."""
    explained: float
    """R.m.s. by which it moves the simulated force, as a share of each record's peak."""
    residual_change: float
    """Sum of squares of the change of the residuals, in units of noise."""
    misfit_drop: float
    """Decrease of the misfit."""
    varies: bool = False
    """Whether its parameters have one value per voltage: an effect adopted before, or one that is only tried so."""
    searched: bool = True
    """Whether its optimum was searched for; else it stands for the faintest values tried."""


def testable(problem: Problem, before: FitResult, effect: Effect) -> bool:
    """Whether some test could show an effect beside those of `before`.

    One of the voltage or temperature shows where it moves, one of a joint with a gas where a force is there at rest.
    """
    if effect.beside_gas and not force_at_rest(before.damper):
        return False
    if effect.needs == "voltage":
        span = CONSTANT_SHARE * (problem.scales.voltage or np.inf)
        return any(o.motion.voltage is not None and np.ptp(o.motion.voltage) > span for o in problem.observations)
    if effect.needs == "temperature":
        by_row: dict[int, list[float]] = {}
        for o in problem.observations:
            if o.motion.temperature is not None:
                by_row.setdefault(o.base_row, []).extend(end_temperatures(o.motion.temperature))
        return any(np.ptp(temperatures) > MOVING_TEMPERATURE for temperatures in by_row.values())
    return True


def has_name(problem: Problem, effect: Effect) -> bool:
    """Whether a verdict may name an effect beside the law of the element.

    A law of straight stages is off by as much as what bends the curve of the flow: a name for it would be one of the
    law.
    """
    of_flow = any(known()[name].place == "flow" for name in problem.law)
    return effect.name not in problem.law and (effect.curve != "flow" or not of_flow)


def candidates(
    problem: Problem,
    before: FitResult,
    forbidden: Sequence[str] = (),
    jobs: int = 1,
    *,
    silent: bool = False,
) -> tuple[Candidate, ...]:
    """Fit every effect with a name that the tests could show beside those of `before`, best first.

    Parameters
    ----------
    problem : observations and starting values
    before : optimum with the effects adopted so far
    forbidden : effects that are not tried
    jobs : how many are fitted at the same time
    silent : noise explains what is left, so that only a faint effect can be missing
    """
    barred = (*before.effects, *forbidden)
    tried = [e for e in nameable().values() if e.name not in barred and has_name(problem, e)]
    tried = [effect for effect in tried if testable(problem, before, effect)]

    _ = before.column_basis  # every candidate needs it: computed once, before they go to threads of their own

    def promised(effect: Effect) -> float:
        return promised_drop(problem, before, effect) if problem_for(problem, effect) is problem else np.inf

    with ThreadPoolExecutor(max(jobs, 1)) as pool:
        gains = list(pool.map(promised, tried))
        best = max((gain for gain in gains if np.isfinite(gain)), default=0.0)
        drop = thresholds.LEAST_DROP_IN_NOISE if silent else thresholds.LEAST_DROP_IN_GAP
        least = max(drop, thresholds.SHARE_WORTH_FITTING * best)

        def one(effect: Effect, gain: float) -> Candidate:
            worth = gain >= least or late_instead_of_elastic(problem, before, effect) is not None
            return (candidate if worth else _unsearched)(problem, before, effect)

        found = list(pool.map(one, tried, gains))
        worth = thresholds.SHARE_WORTH_SEARCHING * min((c.delta_bic for c in found), default=0.0)
        found = list(pool.map(lambda c: resumed(problem, before, c) if c.delta_bic < worth else c, found))
        # What a law by more numbers came down to lies beyond a valley in which the search for it may have ended.
        paying = (c for c in found if c.delta_bic < worth)
        limits = {nearly_others(c.fitted.damper, problem.scales.force).get(c.effect) for c in paying}
        short = [c.effect in limits and c.delta_bic >= worth for c in found]
        found = list(pool.map(lambda c, ended: converged(problem, before, c) if ended else c, found, short))
    return tuple(sorted(found, key=lambda c: c.delta_bic))


def resumed(problem: Problem, before: FitResult, found: Candidate) -> Candidate:
    """Continue the search for a candidate that was broken off early."""
    return _fitted_from(problem_for(problem, known()[found.effect]), before, found.effect, found.fitted.optimum)


def candidate(problem: Problem, before: FitResult, effect: Effect, start: Array | None = None) -> Candidate:
    """Fit one effect beside those of `before`, from its most promising starting values, or those that are given.

    Others, then ever fainter ones, are tried only while the fit is worse than without the effect: such a search got
    stuck, for being switched off is one of the effect's own values.

    Parameters
    ----------
    problem : observations and starting values
    before : optimum with the effects adopted so far
    effect : to be fitted
    start : (unknowns,) in the units of the search; None for those of the effect

    Returns
    -------
    the best of the optima reached, with what the effect pays
    """
    problem, reached = problem_for(problem, effect), list[Candidate]()
    starts = sorted_starts(problem, before, effect) if start is None else [start]
    faint = (towards_neutral(problem, before, effect, starts[0], share) for share in thresholds.SMALLER_STARTS)
    for each in itertools.chain(starts[: thresholds.STARTS_TRIED], faint):
        whole_start = np.concatenate([_search_start(problem, before), each])
        reached.append(_fitted_from(problem, before, effect.name, whole_start, thresholds.FIRST_EVALUATIONS))
        fitted = reached[-1].fitted
        if fitted.misfit <= before.misfit + thresholds.STUCK_MISFIT or _switched_off(effect, fitted):
            break
    others = [friction_beside_oil(problem, before, effect)]
    if start is None:
        others.append(late_instead_of_elastic(problem, before, effect))
    for other in others:
        if other is not None:
            reached.append(_fitted_from(problem, before, effect.name, other, thresholds.FIRST_EVALUATIONS))
    return min(reached, key=lambda c: c.fitted.misfit)


def late_instead_of_elastic(problem: Problem, before: FitResult, effect: Effect) -> Array | None:
    """Return a start (3 b + e,) at which a delay of the force takes the place of the oil springs.

    A fit without the delay makes springs of it, and beside them no small delay is better: the way over is barred.

    Returns
    -------
    None where the effect is no delay, or the springs do not delay a viscous force by as much as counts
    """
    lag = max(row.C_Ns_per_m / row.k_N_per_m for row in before.damper.base)
    if effect.name != "sensor_delay" or lag < thresholds.TRIVIAL_SIZE[effect.name, "tau"]:
        return None
    (tau,) = _new_unknowns(problem, before, effect)
    rows = _search_start(problem, before).copy()
    rows[2 : 3 * len(problem.base) : 3] = 0.0
    return np.append(rows, tau.to_search(lag))


def friction_beside_oil(problem: Problem, before: FitResult, effect: Effect) -> Array | None:
    """Return a start (3 b + e,) at which the branch takes over the friction that the element has at every voltage.

    T0 acts through the oil spring, that of a seal beside it. A fit without the branch gives all of it to T0, and beside
    that no small branch is better: the way over is barred.

    Returns
    -------
    None where the effect is no branch that slips, or the element has no friction
    """
    friction = np.array([row.T0_N for row in before.damper.base])
    if effect.name != "second_branch" or problem.rigid or min(friction) <= 0.0:
        return None
    unknowns = _new_unknowns(problem, before, effect)
    rows, nodes = _search_start(problem, before), np.array(problem.nodes)
    by_voltage = any(unknown.node is not None for unknown in unknowns)
    taken = friction if by_voltage else np.full(friction.size, min(friction))

    def start(lag: float, give: float) -> Array:
        moved, own = rows.copy(), []
        for i, row in enumerate(before.damper.base):
            elastic = lag > 0.0 and row.C_Ns_per_m > 0.0  # friction alone has no lag
            stiffness = row.C_Ns_per_m / lag if elastic else row.k_N_per_m
            left = problem.coordinates.to_search(row.T0_N - float(taken[i]), row.C_Ns_per_m, stiffness)
            moved[3 * i : 3 * i + 3] = left
        for unknown in unknowns:
            force = float(np.mean(taken if unknown.node is None else taken[nodes == unknown.node]))
            own.append(unknown.to_search(force if unknown.parameter.name == "T0_2" else force / give))
        return np.append(moved, own)

    limits = np.full(rows.size + len(unknowns), -np.inf), np.full(rows.size + len(unknowns), np.inf)
    frictions = range(0, 3 * len(problem.base), 3)
    every = problem.unknowns((*before.effects, effect.name))
    stroke = problem.scales.stroke
    duration = stroke / (problem.scales.speed or 1.0)
    starts = [
        start(lag * duration, give * stroke) for lag in (0.0, *thresholds.LAGS_TRIED) for give in thresholds.GIVES_TRIED
    ]
    misfits = [float(np.sum(linearise(problem, every, each, limits, frictions).stacked ** 2)) for each in starts]
    return starts[int(np.argmin(misfits))]


def _switched_off(effect: Effect, fitted: FitResult) -> bool:
    """Whether the search for an effect's only parameter ended at the limit next to zero, its absence."""
    (only, *more), nearest = effect.parameters, fitted.unknowns[-1].bounds[0]
    vanishes = only.search.logarithmic and only.neutral == 0.0 and not more
    return vanishes and bool(fitted.optimum[-1] - nearest < thresholds.SEARCH_LIMIT_MARGIN)


def _unsearched(problem: Problem, before: FitResult, effect: Effect) -> Candidate:
    """Return an effect at the faintest values tried, without a search."""
    first, share = starts_of(problem, before, effect)[0], thresholds.SMALLER_STARTS[-1]
    start = np.concatenate([before.optimum, towards_neutral(problem, before, effect, first, share)])
    return replace(_fitted_from(problem, before, effect.name, start, 1), searched=False)


def best_confounder(problem: Problem, before: FitResult) -> Candidate:
    """Fit the confounders (laws outside the library) as candidates, and return the best."""
    tried = (converged(problem, before, candidate(problem, before, form)) for form in confounders().values())
    return min(tried, key=lambda c: c.delta_bic)


def per_voltage_candidates(problem: Problem, before: FitResult, jobs: int = 1) -> list[Candidate]:
    """Fit every effect of `before` that may differ by voltage with one value per voltage, `jobs` at the same time."""
    if len(problem.voltages) == 1:
        return []
    shared = [library()[name] for name in before.effects if name not in problem.per_voltage]
    free = [e.name for e in shared if e.place in PLACES_PER_VOLTAGE and not e.same_at_every_voltage]
    with ThreadPoolExecutor(max(jobs, 1)) as pool:
        return list(pool.map(lambda name: _fitted_per_voltage(problem, before, name), free))


def _fitted_per_voltage(
    problem: Problem, before: FitResult, effect: str, evaluations: int = MOST_EVALUATIONS
) -> Candidate:
    wider = replace(problem, per_voltage=problem.per_voltage | {effect})
    fitted = refit(wider, before.damper, evaluations)
    return replace(as_candidate(problem, before, effect, fitted), varies=True)


def as_candidate(
    problem: Problem, before: FitResult, effect: str, fitted: FitResult, pays: float | None = None
) -> Candidate:
    """Describe an optimum with one more effect than `before` as a candidate; `pays` where its criterion is known.

    Parameters
    ----------
    problem : observations and starting values
    before : optimum without the effect
    effect : its name
    fitted : optimum with it
    pays : change of BIC by it, negative where it pays; None where it is to be computed
    """
    pairs = zip(before.residuals, fitted.residuals, strict=True)
    return Candidate(
        effect,
        fitted,
        delta_bic(before, fitted) if pays is None else pays,
        force_change(problem, before.simulated, fitted.simulated),
        sum(float((after - old) @ (after - old)) for old, after in pairs),
        before.misfit - fitted.misfit,
    )


def converged(problem: Problem, before: FitResult, found: Candidate) -> Candidate:
    """Search a candidate to its optimum, from all its starting values.

    Parameters
    ----------
    problem : observations and starting values
    before : optimum with the effects adopted so far
    found : candidate of a shorter search

    Returns
    -------
    the best optimum, with one value per voltage where the candidate has such
    """
    if found.varies:
        return _fitted_per_voltage(problem, before, found.effect, thresholds.MOST_EVALUATIONS_OF_BEST)
    effect = known()[found.effect]
    problem = problem_for(problem, effect)
    others = [np.concatenate([_search_start(problem, before), s]) for s in sorted_starts(problem, before, effect)[1:]]
    fits = [fit(problem, found.fitted.effects, start) for start in others]
    best = min([found.fitted, *fits], key=lambda f: f.misfit)
    return _fitted_from(problem, before, found.effect, best.optimum, thresholds.MOST_EVALUATIONS_OF_BEST)


def nearly_as_good(
    problem: Problem, before: FitResult, chosen: Candidate, tried: Sequence[Candidate]
) -> tuple[Candidate, ...]:
    """Return the candidates of a step, those nearly as good as the chosen one searched to their optimum as well."""
    near = thresholds.NEARLY_AS_GOOD * chosen.delta_bic
    return tuple(
        converged(problem, before, c) if c.effect != chosen.effect and c.delta_bic < near else c for c in tried
    )


def problem_for(problem: Problem, effect: Effect) -> Problem:
    """Return the problem on which an effect is tried: a material effect replaces the temperature axis."""
    return problem.pooled_temperatures() if effect.place == "material" else problem


def _search_start(problem: Problem, before: FitResult) -> Array:
    """Return (3 b + e,) starting values of the base rows and the effects of `before`."""
    rows = before.optimum.size - len(before.unknowns)
    return before.optimum if rows == 3 * len(problem.base) else problem.start_with(before.damper)


def _fitted_from(
    problem: Problem, before: FitResult, effect: str, start: Array, evaluations: int = MOST_EVALUATIONS
) -> Candidate:
    """Fit an effect from a start."""
    fitted = fit(problem, (*before.effects, effect), start, evaluations)
    pays = delta_bic(before, fitted)
    if len(problem.base) < len(before.damper.base):
        # Fewer base rows alone may pay already; that is not the effect's merit, nor are the parameters that they save.
        pooled = refit(problem, before.damper)
        own = len(fitted.unknowns) - len(before.unknowns)
        alone = fitted.misfit - before.misfit + own * float(np.log(fitted.size))
        pays = max(pays, alone, delta_bic(pooled, fitted))
    return as_candidate(problem, before, effect, fitted, pays)


def delta_bic(before: FitResult, after: FitResult) -> float:
    """Change of the Bayesian information criterion.

    Equation: BIC = |r|^2 + p ln n                                  Source: Schwarz 1978
    """
    more = after.optimum.size - before.optimum.size
    return after.misfit - before.misfit + more * float(np.log(after.size))


def force_change(problem: Problem, before: Sequence[Array], after: Sequence[Array]) -> float:
    """Compute the r.m.s. difference of two simulated forces, each record in units of its peak.

    Parameters
    ----------
    problem : observations, for the peak of each record
    before, after : the simulated forces, a (m,) array a record [N], both along the motions of this problem

    Returns
    -------
    share of peak, over all records alike
    """
    squares = [np.mean((a - b) ** 2) / o.peak**2 for o, a, b in zip(problem.observations, after, before, strict=True)]
    return float(np.sqrt(np.mean(squares)))
