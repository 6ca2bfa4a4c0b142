"""Slopes of the residuals of observations by central differences of the searched variables."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.diagnose.fit.likelihood import RecordLikelihood
from pzd.diagnose.fit.parameters import Problem, Unknown, simulated
from pzd.record import Array

DIFFERENCE = 3e-3
"""Step of the searched variables to either side for their slopes.

Reason: the gain of the tests leaves T0, C and k open along one direction, common to them all, so that what forward
differences leave of the curvature ends a search up to a standard deviation away from the optimum. A smaller step shows
the errors of the simulation, see `likelihood.SIMULATION_TOLERANCE`."""


def blocks(problem: Problem, unknowns: Sequence[Unknown], free: int) -> list[tuple[slice, list[int]]]:
    """The residuals of each observation, and which of the first `free` variables move them.

    Parameters
    ----------
    problem : what is fitted to what
    unknowns : of the effects
    free : how many of the searched variables, (3 b + e,), the search moves
    """
    ends = np.cumsum([0, *(o.residuals for o in problem.observations)])
    return [
        (slice(int(begin), int(end)), _moving(problem, unknowns, o, free))
        for o, begin, end in zip(problem.observations, ends[:-1], ends[1:], strict=True)
    ]


def _moving(problem: Problem, unknowns: Sequence[Unknown], o: RecordLikelihood, free: int) -> list[int]:
    """Which of the first `free` variables move the force of an observation: a test moves with its own voltage alone."""
    rows = 3 * len(problem.base)
    own = range(3 * o.place, 3 * o.place + 3) if o.place >= 0 else range(rows)
    effects = [j for j, u in enumerate(unknowns) if u.node is None or o.place < 0 or u.node == problem.nodes[o.place]]
    return [*own, *(rows + j for j in effects if rows + j < free)]


def differences(
    problem: Problem,
    unknowns: Sequence[Unknown],
    x: Array,
    limits: tuple[Array, Array],
    wanted: Sequence[int] | None = None,
) -> Array:
    """(w, free) derivatives of the residuals by central differences, one-sided at the limits of the search.

    Parameters
    ----------
    problem : what is fitted to what
    unknowns : of the effects
    x : (3 b + e,) where they are taken, in the units of the search
    limits : (free,) least and largest values of the variables that the search moves
    wanted : the columns asked for, the others being zero; all where none are given
    """
    low, high = limits
    free = low.size
    below, above = np.maximum(x[:free] - DIFFERENCE, low), np.minimum(x[:free] + DIFFERENCE, high)
    asked = range(free) if wanted is None else wanted
    points = {j: tuple(problem.point(_with(x, j, at[j]), unknowns) for at in (below, above)) for j in asked}
    blocks = []
    for o in problem.observations:
        columns = [j for j in _moving(problem, unknowns, o, free) if j in points]
        change = [np.subtract(*(simulated(point, o) for point in points[j])) for j in columns]
        block = np.zeros((o.residuals, free))
        if columns:
            block[:, columns] = o.in_noise(np.stack(change, axis=-1) / (above - below)[columns])
        blocks.append(block)
    return np.concatenate(blocks)


def _with(x: Array, j: int, value: float) -> Array:
    moved = x.copy()
    moved[j] = value
    return moved
