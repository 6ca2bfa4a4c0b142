"""A Bingham element fitted coarsely to a record: the reference that the checks of the preflight compare it with.

Fine enough to tell an offset or a delay from the damper's own hysteresis, far too coarse to identify.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from pzd.damper.element import element_forces
from pzd.record import Array
from pzd.rig.preflight import Measured
from pzd.signals.cycles import Cycles
from pzd.signals.kinematics import mean_over_period

MOST_SAMPLES = 800
RATE = 250.0
"""A record without cycles is read at about this rate [Hz]."""
VISIBLE = 2e-3
"""Share of the force's squares that is looked into: what is less is noise, or how coarse the element is."""
_GRID = (24, 16)
_ZOOM = (7, 7)
_ZOOMS = 4


@dataclass(frozen=True, eq=False)
class Piece:
    """The part of a record that the reference is fitted to: its average cycle, or its beginning."""

    step: float
    """Interval of the samples [s]."""
    displacement: Array
    """(n,) [m]"""
    force_later: Callable[[Array], Array]
    """Delays (m,) [s] -> the force (m, n) read that much later [N]."""
    closed: bool
    """Whether the end joins the beginning."""


@dataclass(frozen=True)
class ReferenceFit:
    """The element of least squares, and what it leaves of the force that it fits best."""

    left: float
    """Share of the force's squares about its mean that is left."""
    left_without: float
    """The same without the element: what offset, spring and inertia leave by themselves."""
    force: int
    """Index of the force that it fits best."""
    friction_extension: float
    """T0 / k [m]."""
    lag: float
    """C / k [s]."""

    def explains(self) -> bool:
        """Whether something is left without it, and it takes more than half; else its parameters say nothing."""
        return self.left_without > VISIBLE and self.left < 0.5 * self.left_without


class TriedElements(NamedTuple):
    """Elements of many T0 / k and C / k."""

    pairs: Sequence[tuple[float, float]]
    """(g,) T0 / k [m] and C / k [s]."""
    steps: tuple[float, float]
    """From one to the next, in logarithms."""
    forces: Array
    """(g, n) without offset, spring and inertia, of unit length."""


@lru_cache(maxsize=1)
def fit_reference(test: Measured) -> tuple[Piece, ReferenceFit]:
    """Part of a record and the element that fits its force undelayed; remembered for the checks that share it."""
    part = piece(test)
    return part, fitted(part, part.force_later(np.zeros(1)))


def piece(test: Measured) -> Piece:
    """The average cycle of a record, or its beginning where nothing repeats."""
    return _beginning(test) if test.run is None else _average_cycle(test, test.run)


def _beginning(test: Measured) -> Piece:
    record = test.record
    every = max(round(record.rate / RATE), 1)
    rows = slice(0, every * MOST_SAMPLES, every)

    def later(delays: Array) -> Array:
        return np.stack([np.interp(record.time[rows] + delay, record.time, record.force) for delay in delays])

    return Piece(every / record.rate, test.clean.displacement[rows], later, closed=False)


def _average_cycle(test: Measured, run: Cycles) -> Piece:
    record = test.record
    steady = test.clean.displacement - mean_over_period(record.time, test.clean.displacement, run)
    x, cycle = run.mean(record.time, steady), run.mean(record.time, record.force)
    every = -(-x.size // MOST_SAMPLES)
    spectrum, harmonics = np.fft.rfft(cycle), np.arange(cycle.size // 2 + 1)

    def later(delays: Array) -> Array:
        turn = np.exp(2j * np.pi * np.outer(delays, harmonics) * run.frequency)
        values: Array = np.fft.irfft(spectrum * turn, cycle.size, axis=1)[:, ::every]
        return values

    return Piece(every * run.period / x.size, x[::every], later, closed=True)


def fitted(part: Piece, forces: Array) -> ReferenceFit:
    """The Bingham element of least squares over several forces, beside a free offset, spring and inertia.

    Parameters
    ----------
    part : the displacement
    forces : (m, n) [N]
    """
    free = _free_terms(part.displacement)
    targets, unexplained = _unit(forces, free), _unexplained_share(forces, free)

    def closest(tried: TriedElements) -> tuple[int, int, float]:
        """The element and the force that fit best, and the share of the squares that is left."""
        left = unexplained * (1.0 - np.maximum(tried.forces @ targets.T, 0.0) ** 2)
        element, force = (int(i) for i in np.unravel_index(int(np.argmin(left)), left.shape))
        return element, force, float(left[element, force])

    tried = _first_tried(part)
    element, force, left = closest(tried)
    for _ in range(_ZOOMS):
        about = zip(tried.pairs[element], tried.steps, strict=True)
        tried = _tried(part, [(np.log(value) - step, np.log(value) + step) for value, step in about], _ZOOM)
        element, force, left = closest(tried)
    return ReferenceFit(left, float(unexplained[force]), force, *tried.pairs[element])


@lru_cache(maxsize=1)
def _first_tried(part: Piece) -> TriedElements:
    """Every element that a record may show; remembered for the checks that share it."""
    half = 0.5 * float(np.ptp(part.displacement))
    longest = max(2.0 * part.step, min(0.1, 0.1 * part.step * part.displacement.size))
    spans = [(np.log(2e-3 * half), np.log(0.7 * half)), (np.log(0.2 * part.step), np.log(longest))]
    return _tried(part, spans, _GRID)


def _tried(part: Piece, spans: Sequence[tuple[float, float]], counts: tuple[int, int]) -> TriedElements:
    """Elements between the logarithms of two values each."""
    frictions, lags = (np.linspace(*span, count) for span, count in zip(spans, counts, strict=True))
    pairs = [(float(np.exp(u)), float(np.exp(w))) for u in frictions for w in lags]
    forces = unit_forces(part, pairs)
    steps = float(frictions[1] - frictions[0]), float(lags[1] - lags[0])
    return TriedElements(pairs, steps, _unit(forces, _free_terms(part.displacement)))


def unit_forces(part: Piece, pairs: Sequence[tuple[float, float]]) -> Array:
    """Forces (g, n) of elements over their stiffness [m], in the second pass where the motion is closed.

    Parameters
    ----------
    part : the displacement
    pairs : g of T0 / k [m] and C / k [s]
    """
    x = part.displacement
    passes = np.concatenate((x, x)) if part.closed else x
    elements = np.column_stack([np.array(pairs), np.ones(len(pairs))])
    return element_forces(passes, part.step, elements)[:, -x.size :]


def _free_terms(x: Array) -> Array:
    """Orthonormal columns (n, 3) of what is free beside the element: offset, spring, inertia."""
    bend = np.gradient(np.gradient(x))
    result: Array = np.linalg.qr(np.stack([np.ones(x.size), x, bend], axis=1))[0]
    return result


def _unexplained_share(forces: Array, free: Array) -> Array:
    """Share (m,) of each force's squares about its mean that offset, spring and inertia leave without the element."""
    rest = forces - (forces @ free) @ free.T
    about_mean = forces - forces.mean(axis=1, keepdims=True)
    result: Array = np.sum(rest**2, axis=1) / np.maximum(np.sum(about_mean**2, axis=1), 1e-300)
    return result


def _unit(forces: Array, free: Array) -> Array:
    """Rows without their offset, spring and inertia, of unit length."""
    rest = forces - (forces @ free) @ free.T
    result: Array = rest / np.maximum(np.linalg.norm(rest, axis=1, keepdims=True), 1e-300)
    return result
