"""Coarse fit of a Bingham element to a few cycles of a record, which the checks of the whole force share.

It is fitted to the average cycle where an instant is asked for, which many cycles together show between two samples,
and to the first cycles as they are where the shape is: where a rigid damper turns, its force jumps between two samples,
and an average smears the jump. There the samples beside each reversal do not count.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from pzd.damper.element import element_forces
from pzd.record import Array
from pzd.rig.preflight import PreflightRecord
from pzd.signals.cycles import Cycles
from pzd.signals.kinematics import mean_over_period
from pzd.signals.measures import despiked

MOST_AVERAGES, MOST_SAMPLES = 800, 1200
"""Samples of a section at most, averages of a cycle or those of some cycles: enough for the shape of the loops."""
CYCLES = 4.0
"""Cycles of the section: one for what was before the record to fade, and three that are fitted."""
WITHOUT_CYCLES = 3.0
"""Length of the section where the motion does not repeat [s]."""
FADED = 0.25
"""Share of the section after which the force from before it has faded."""
BESIDE_REVERSAL = (-1, 0, 1, 2)
"""Samples about a reversal at which the force of a rigid damper is between its two signs."""
LEAST_RESIDUAL = 2e-3
"""Share of the force's squares worth explaining: less is noise, or how coarse the element is."""
WORTH = 3e-4
"""The same for a delay or a low-pass, which has to explain nearly all of it; the grid of the search leaves a tenth."""
AGAIN = 1e-4
"""Share of the force's squares left at which the search begins again elsewhere: at a C / k on the other side of a
sample, and at another T0 / k.

Reason: what is shorter than a sample looks alike, and the best point of the coarse first grid may lie in a wrong
valley."""
RIGID = 1e-5
"""Least T0 / k that is tried, as a share of half the stroke: the flank then takes less than a sample."""
PROMPT = 1e-5
"""Least C / k that is tried, in samples: with `RIGID` it leaves friction alone."""
_GRID = (22, 18)
"""Values of T0 / k and of C / k in the first search, one to three times the last each."""
_ZOOM = (7, 7)
_ZOOMS = 4
"""Each zoom divides the steps by three: four of them leave about 1 %, finer than the element is true."""


@dataclass(frozen=True, eq=False)
class Section:
    """Section of a record that the reference is fitted to: its first cycles, or its beginning."""

    step: float
    """Sampling interval [s]."""
    displacement: Array
    """(n,) [m]"""
    delayed: Callable[[Array], Array]
    """Delays (m,) [s] -> the force (m, n) read that much later [N]."""
    shown: NDArray[np.bool_]
    """(n,) samples that count."""
    periodic: bool = False
    """Whether the end joins the beginning."""
    passed: Callable[[Array], Array] | None = None
    """Forces (m, n) of elements -> what the channel shows of them; None where it shows them as they are."""
    weights: Array | float = 1.0
    """(n,) of each sample in the least squares."""

    @cached_property
    def force(self) -> Array:
        """(n,) as recorded [N]."""
        return np.asarray(self.delayed(np.zeros(1))[0])

    @cached_property
    def squares(self) -> float:
        """Sum of the squares of the force about its mean, of the samples that count [N2]."""
        force = self.force[self.shown]
        return max(float(np.sum((force - force.mean()) ** 2)), 1e-300)

    def counted(self, rows: Array) -> Array:
        """Return the samples that count of (m, n) rows, with their weights."""
        weighed = rows if isinstance(self.weights, float) and self.weights == 1.0 else rows * self.weights
        return weighed if self.shown.all() else np.asarray(weighed[:, self.shown])

    def recorded(self, rows: Array) -> Array:
        """Return what the channel of the force shows of (m, n) forces."""
        return rows if self.passed is None else self.passed(rows)

    @cached_property
    def free(self) -> Array:
        """Orthonormal columns (s, 3) of offset, spring and inertia, of the samples that count."""
        x = self.displacement
        rows = self.recorded(np.stack([np.ones(x.size), x, _bend(x)]))
        return np.asarray(np.linalg.qr(self.counted(rows).T)[0])


@dataclass(frozen=True)
class ReferenceFit:
    """Element of least squares over several forces."""

    residual: float
    """Share of the recorded force's squares about its mean that is left."""
    residual_without_element: float
    """The same of offset, spring and inertia alone."""
    number: int
    """Index of the force that fits best."""
    friction_extension: float
    """T0 / k [m]."""
    lag: float
    """C / k [s]."""

    def explains(self) -> bool:
        """Whether the element takes more than half of a visible residual; else its parameters mean nothing."""
        return self.residual_without_element > LEAST_RESIDUAL and self.residual < 0.5 * self.residual_without_element


_Found = tuple[float, int, tuple[float, float]]
"""What is left, the index of the force, and the element."""


@dataclass(frozen=True, eq=False)
class _Grid:
    """Elements of many T0 / k [m] and C / k [s]."""

    pairs: list[tuple[float, float]]
    steps: tuple[float, float]
    """From one value to the next, in logarithms."""
    forces: Array = field(repr=False)
    """(g, n) without offset, spring and inertia, of unit length."""


@lru_cache(maxsize=1)
def reference_fit(test: PreflightRecord) -> tuple[Section, ReferenceFit]:
    """Fit the element to the average cycle of a record, or its beginning; remembered, as several checks ask for it."""
    section = _first_cycles(test) if test.cycles is None else _average_cycle(test, test.cycles)
    return section, fit_element(section, section.force[None])


@lru_cache(maxsize=1)
def sampled_fit(test: PreflightRecord) -> tuple[Section, ReferenceFit]:
    """Fit the element to the first samples of a record, but for those beside reversals; remembered likewise."""
    section = _first_cycles(test)
    return section, fit_element(section, section.force[None])


def _average_cycle(test: PreflightRecord, cycles: Cycles) -> Section:
    record = test.record
    steady = test.clean.displacement - mean_over_period(record.time, test.clean.displacement, cycles)
    x, force = cycles.mean(record.time, steady), cycles.mean(record.time, record.force)
    every = -(-x.size // MOST_AVERAGES)
    spectrum, harmonics = np.fft.rfft(force), np.arange(force.size // 2 + 1)

    def delayed(delays: Array) -> Array:
        turn = np.exp(2j * np.pi * np.outer(delays, harmonics) * cycles.frequency)
        return np.asarray(np.fft.irfft(spectrum * turn, force.size, axis=1)[:, ::every])

    shown = np.ones(x[::every].size, dtype=np.bool_)
    return Section(every * cycles.period / x.size, x[::every], delayed, shown, periodic=True)


def _first_cycles(test: PreflightRecord) -> Section:
    record, run = test.record, test.cycles
    start, length = (run.start, CYCLES * run.period) if run else (float(record.time[0]), WITHOUT_CYCLES)
    first = int(np.searchsorted(record.time, start - 0.5 / record.rate))
    # Half a cycle more for the delays, where there is one.
    end = record.time[-1] - (0.5 * run.period if run else 0.0)
    count = int(min(length, max(end - start, 0.5 * (record.time[-1] - start))) * record.rate)
    every = -(-count // MOST_SAMPLES)
    # A steady clock, whatever that of the record; a sample that jumps away is reported as that.
    time = record.time[first] + np.arange(0, count, every) / record.rate
    x, force = np.interp(time, record.time, test.clean.displacement), despiked(record.force)
    shown = np.arange(x.size) >= int(FADED * x.size)
    turns = np.flatnonzero(np.diff(np.sign(np.interp(time, record.time, test.clean.velocity))) != 0.0)
    for beside in BESIDE_REVERSAL:
        shown[np.clip(turns + beside, 0, x.size - 1)] = False
    if np.count_nonzero(shown) < 0.25 * x.size:  # too few samples a cycle to leave some out
        shown = np.arange(x.size) >= int(FADED * x.size)

    def delayed(delays: Array) -> Array:
        return np.stack([np.interp(time + delay, record.time, force) for delay in delays])

    return Section(every / record.rate, x, delayed, shown)


def fit_element(
    section: Section, forces: Array, zooms: int = _ZOOMS, start: tuple[float, float] | None = None
) -> ReferenceFit:
    """Fit a Bingham element beside a free offset, spring and inertia, by a grid search that zooms in.

    Parameters
    ----------
    section : the displacement, what the channel shows, and which samples count
    forces : (m, n) [N]; the fit is that of the force that is explained best
    zooms : how often the grid becomes finer
    start : T0 / k [m] and C / k [s] about which is searched alone; None for everywhere
    """
    rest = _projected_out(section.counted(forces), section.free)
    targets = _normalised(rest)
    unexplained: Array = np.sum(rest**2, axis=1) / section.squares

    def left_by(elements: Array) -> Array:
        """Return the share (g, m) of the squares that is left of each force by each element (g, s)."""
        return np.asarray(unexplained * (1.0 - np.maximum(elements @ targets.T, 0.0) ** 2))

    def closest(left: Array, grid: _Grid) -> _Found:
        element, force = (int(i) for i in np.unravel_index(int(np.argmin(left)), left.shape))
        return float(left[element, force]), force, grid.pairs[element]

    def zoomed(best: _Found, steps: tuple[float, float]) -> _Found:
        for _ in range(zooms):
            spans = [(np.log(v) - step, np.log(v) + step) for v, step in zip(best[2], steps, strict=True)]
            grid = _grid(section, spans, _ZOOM)
            best, steps = min(best, closest(left_by(grid.forces), grid)), grid.steps
        return best

    grid = _first_grid(section)
    if start is not None:
        best = zoomed((np.inf, 0, start), grid.steps)
        return ReferenceFit(best[0], float(unexplained[best[1]]), best[1], *best[2])
    left = left_by(grid.forces)
    first = closest(left, grid)
    best = zoomed(first, grid.steps)
    if best[0] > AGAIN:
        frictions, lags = np.transpose(grid.pairs)
        same_side = (lags < section.step) == (first[2][1] < section.step)
        near = np.abs(np.log(frictions / first[2][0])) < 1.5 * grid.steps[0]
        for tried in (same_side, near):
            if not tried.all():
                best = min(best, zoomed(closest(np.where(tried[:, None], np.inf, left), grid), grid.steps))
    return ReferenceFit(best[0], float(unexplained[best[1]]), best[1], *best[2])


def columns(section: Section, fit: ReferenceFit) -> Array:
    """Compute the columns (n, 4) that a reference is made of: offset, element over its stiffness [m], spring, inertia.

    The spring counts from the middle of the stroke.
    """
    x = section.displacement
    middle = 0.5 * float(x.max() + x.min())
    rows = np.stack(
        [np.ones(x.size), _unit_forces(section, [(fit.friction_extension, fit.lag)])[0], x - middle, _bend(x)]
    )
    return section.recorded(rows).T


@lru_cache(maxsize=1)
def _first_grid(section: Section) -> _Grid:
    """Every element that a record may show; remembered, as both fits of a record begin with it."""
    half = 0.5 * float(np.ptp(section.displacement))
    longest = max(2.0 * section.step, min(0.1, 0.1 * section.step * section.displacement.size))
    spans = [(np.log(RIGID * half), np.log(0.7 * half)), (np.log(PROMPT * section.step), np.log(longest))]
    return _grid(section, spans, _GRID)


def _grid(section: Section, spans: Sequence[tuple[float, float]], counts: tuple[int, int]) -> _Grid:
    """Elements between the logarithms of two values each."""
    frictions, lags = (np.linspace(*span, count) for span, count in zip(spans, counts, strict=True))
    pairs = [(float(np.exp(u)), float(np.exp(w))) for u in frictions for w in lags]
    forces = _projected_out(section.counted(section.recorded(_unit_forces(section, pairs))), section.free)
    return _Grid(pairs, (float(frictions[1] - frictions[0]), float(lags[1] - lags[0])), _normalised(forces))


def _unit_forces(section: Section, pairs: Sequence[tuple[float, float]]) -> Array:
    """Compute forces (g, n) of elements over their stiffness [m], in the second pass where the motion is periodic."""
    x = section.displacement
    passes = np.concatenate((x, x)) if section.periodic else x
    elements = np.column_stack([np.array(pairs), np.ones(len(pairs))])
    return element_forces(passes, section.step, elements)[:, -x.size :]


def _bend(x: Array) -> Array:
    return np.asarray(np.gradient(np.gradient(x)))


def _projected_out(forces: Array, free: Array) -> Array:
    """Rows (m, s) without their offset, spring and inertia."""
    return np.asarray(forces - (forces @ free) @ free.T)


def _normalised(rows: Array) -> Array:
    """Rows (m, s) of unit length."""
    return np.asarray(rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300))


CHECKS = ()
