"""Residuals of observations at a point of the search, and their slopes by the searched variables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from pzd.diagnose.fit.forces import Directions, alike_at_one_voltage, directions, sensitivities
from pzd.diagnose.fit.likelihood import RecordLikelihood
from pzd.diagnose.fit.parameters import Problem, Unknown
from pzd.record import Array

STEP = 1e-4
"""Step of a searched variable to either side, over which its parameter, the effective voltage and what stands beside
the element are differenced.

Reason: far above rounding, and so short that a branch begins to slip at the same sample on either side; the path of the
oil, whose own errors a longer step would have to drown, is not differenced."""


@dataclass(frozen=True, eq=False)
class BlockSlopes:
    """Slopes of the residuals of observations, each by the variables that move it: a test has one voltage of many."""

    free: int
    """How many variables the search moves."""
    blocks: tuple[tuple[tuple[int, ...], Array], ...]
    """Of every observation the columns of the variables, and (w_o, columns) the slopes."""

    def dense(self, columns: Sequence[int] | None = None) -> Array:
        """(w, columns) slopes by some variables, or by all, zero where an observation does not move with one."""
        wanted = range(self.free) if columns is None else columns
        place = {j: i for i, j in enumerate(wanted)}
        found = np.zeros((sum(len(block) for _, block in self.blocks), len(place)))
        begin = 0
        for own, block in self.blocks:
            here = [i for i, j in enumerate(own) if j in place]
            found[begin : begin + len(block), [place[own[i]] for i in here]] = block[:, here]
            begin += len(block)
        return found


@dataclass(frozen=True, eq=False)
class Left:
    """What a point of the search leaves, and how that goes with the searched variables."""

    residuals: tuple[Array, ...]
    """(w_o,) an observation, in units of noise."""
    simulated: tuple[Array, ...]
    """(n,) an observation, force at the compared samples [N]."""
    slopes: BlockSlopes
    """Of all residuals by the searched variables."""

    @property
    def whole(self) -> Array:
        """(w,) all residuals."""
        return np.concatenate(self.residuals)


def left_at(
    problem: Problem,
    unknowns: Sequence[Unknown],
    x: Array,
    limits: tuple[Array, Array],
    wanted: Sequence[int] | None = None,
) -> Left:
    """Residuals and slopes at a point: together they cost little more than the residuals alone.

    Parameters
    ----------
    problem : what is fitted to what
    unknowns : of the effects
    x : (3 b + e,) where they are taken, in the units of the search
    limits : (free,) least and largest values of the variables that the search moves
    wanted : the columns asked for, the others being zero; all where none are given
    """
    residuals, forces, blocks = [], [], []
    for o, columns, force, slopes in _sensitivities_at(problem, unknowns, x, limits, wanted):
        counted = o.in_noise(np.column_stack([o.measured - force, -slopes]))
        residuals.append(counted[:, 0].copy())
        forces.append(force)
        blocks.append((columns, counted[:, 1:].copy()))
    return Left(tuple(residuals), tuple(forces), BlockSlopes(limits[0].size, tuple(blocks)))


def force_slopes(problem: Problem, unknowns: Sequence[Unknown], x: Array) -> BlockSlopes:
    """Slopes of the force at the compared samples [N] by all searched variables; parameters as in `left_at`."""
    limits = np.full(x.size, -np.inf), np.full(x.size, np.inf)
    found = _sensitivities_at(problem, unknowns, x, limits, None)
    return BlockSlopes(x.size, tuple((columns, slopes) for _, columns, _, slopes in found))


def _sensitivities_at(
    problem: Problem, unknowns: Sequence[Unknown], x: Array, limits: tuple[Array, Array], wanted: Sequence[int] | None
) -> Iterator[tuple[RecordLikelihood, tuple[int, ...], Array, Array]]:
    """Each observation with the variables that move it, the force (n,) and its slopes (n, columns); see `left_at`."""
    low, high = limits
    free = low.size
    point, below, above = (
        problem.point(x, unknowns),
        np.maximum(x[:free] - STEP, low),
        np.minimum(x[:free] + STEP, high),
    )
    asked = range(free) if wanted is None else wanted
    beside = {
        j: (
            problem.point(_with(x, j, below[j]), unknowns),
            problem.point(_with(x, j, above[j]), unknowns),
            float(above[j] - below[j]),
        )
        for j in asked
    }
    alike, known = alike_at_one_voltage(point), dict[int, Directions]()
    for o in problem.observations:
        columns = tuple(j for j in moving(problem, unknowns, o, free) if j in beside)
        if o.place not in known or o.place < 0 or not alike:
            known[o.place] = directions(point, [beside[j] for j in columns], o)
        yield o, columns, *sensitivities(known[o.place], o, problem.work)


def moving(problem: Problem, unknowns: Sequence[Unknown], o: RecordLikelihood, free: int) -> list[int]:
    """Which of the first `free` variables move the force of an observation: a test moves with its own voltage alone.

    Parameters
    ----------
    problem : what is fitted to what
    unknowns : of the effects
    o : the observation
    free : how many variables the search moves
    """
    rows = 3 * len(problem.base)
    own = range(3 * o.place, 3 * o.place + 3) if o.place >= 0 else range(rows)
    effects = [j for j, u in enumerate(unknowns) if u.node is None or o.place < 0 or u.node == problem.nodes[o.place]]
    return [*own, *(rows + j for j in effects if rows + j < free)]


def _with(x: Array, j: int, value: float) -> Array:
    moved = x.copy()
    moved[j] = value
    return moved
