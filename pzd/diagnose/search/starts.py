"""Where the search for an effect starts: its starting values, and what a linearised step promises from each."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from pzd.damper.effect import Effect
from pzd.diagnose.fit.least_squares import Fitted, not_taken_up
from pzd.diagnose.fit.parameters import BOUND, Problem, Unknown
from pzd.diagnose.fit.slopes import left_at
from pzd.diagnose.thresholds import FAINT
from pzd.record import Array


def promising_starts(problem: Problem, before: Fitted, effect: Effect) -> list[Array]:
    """All starting values of an effect, first those from which one linearised step promises the smallest misfit.

    Equation: min_b,d |r_s - J_b b - J_s d|^2 at each start s, J_b of the base rows at `before`
                                                                Source: Gauss-Newton step
    """
    starts = starts_of(problem, before, effect)
    if len(starts) == 1:
        return starts
    promised = [_promised_misfit(problem, before, effect, start) for start in starts]
    return [starts[i] for i in np.argsort(promised, kind="stable")]


def most_promising(problem: Problem, before: Fitted, effects: Sequence[Effect], count: int) -> list[Effect]:
    """The effects from whose starting values one linearised step promises the smallest misfits, best first."""
    promised = []
    for effect in effects:
        own = problem.growing(effect)
        starts = starts_of(own, before, effect)
        promised.append(min(_promised_misfit(own, before, effect, start) for start in starts))
    return [effects[i] for i in np.argsort(promised, kind="stable")[:count]]


def promise(problem: Problem, before: Fitted, effect: Effect) -> float:
    """By how much a linearised step lowers the misfit at most, from an effect's starting values or from near none."""
    starts = starts_of(problem, before, effect)
    faint = (*starts, *(fainter(problem, before, effect, start, FAINT) for start in starts))
    return before.misfit - min(_promised_misfit(problem, before, effect, start) for start in faint)


def starts_of(problem: Problem, before: Fitted, effect: Effect) -> list[Array]:
    """All combinations of the starting values of an effect, each (unknowns,) in the units of the search.

    What is looked for by voltage starts at every one of them alike, or in proportion to T0.
    """
    unknowns = _new(problem, before, effect)
    own = {u.parameter.name: u.parameter for u in unknowns}
    grid = itertools.product(*(parameter.search.starts for parameter in own.values()))
    starts = [dict(zip(own, values, strict=True)) for values in grid]
    return [np.array([_searched(u, s[u.parameter.name] * _share(problem, u)) for u in unknowns]) for s in starts]


def _share(problem: Problem, unknown: Unknown) -> float:
    """The share of its largest value at which an unknown starts at its voltage."""
    scaled = unknown.node is not None and unknown.parameter.with_friction
    return problem.friction_at(unknown.node or 0) if scaled else 1.0


def fainter(problem: Problem, before: Fitted, effect: Effect, start: Array, share: float) -> Array:
    """Starting values that lie so much nearer to those that switch the effect off."""
    unknowns = _new(problem, before, effect)
    return np.array([u.searched(u.fainter(float(x), share)) for u, x in zip(unknowns, start, strict=True)])


def _new(problem: Problem, before: Fitted, effect: Effect) -> tuple[Unknown, ...]:
    """What is looked for with an effect beside those of `before`."""
    return problem.unknowns((*before.effects, effect.name))[len(before.unknowns) :]


def _searched(unknown: Unknown, start: float) -> float:
    return float(np.log(max(start, 1.0 / BOUND))) if unknown.parameter.search.logarithmic else start


def _promised_misfit(problem: Problem, before: Fitted, effect: Effect, start: Array) -> float:
    """Sum of squares after one linearised step from a start; infinite where the slopes there are not."""
    effects = (*before.effects, effect.name)
    unknowns = problem.unknowns(effects)
    here = np.concatenate([before.searched, start])
    new = range(before.searched.size, here.size)
    limits = np.full(here.size, -np.inf), np.full(here.size, np.inf)
    left = left_at(problem, unknowns, here, limits, new)
    r, columns = (not_taken_up(before.frame, values) for values in (left.whole, left.slopes.dense(new)))
    if not np.all(np.isfinite(columns)):
        return np.inf  # a power law whose flow stands still at a sample has no slope there
    size = np.linalg.norm(columns, axis=0)
    columns = columns / np.where(size > 0.0, size, 1.0)
    rest = r - columns @ np.linalg.lstsq(columns, r, rcond=1e-6)[0]
    return float(rest @ rest)
