"""Fit of changes to the difference of force: noise, what the tests differ by themselves, and least squares.

The covariance of a stacked difference has three parts: noise from the cycles; offset, gain and delay that any test has
of its own, a share of the priors of `NuisanceConfig`; and what no candidate explains, a share of the difference in
every octave, and of its mean for moments of the cycle. The shares are estimated with the changes, so that a difference
without a name is not given one.

Equation: -2 ln L = sum_t r' V^-1 r + ln det V, V = diag(v + g^2 s + m^2 d) + u^2 A A'
                                                    Source: Gaussian likelihood; A of `pzd.signals.nuisance`
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pzd.diagnosis.changes.candidates import Candidate, Coordinate, Response
from pzd.diagnosis.changes.pairs import Comparison, octave_mean, stacked
from pzd.fit.intervals import LEVEL, covariance, disagreement, widening
from pzd.fit.least_squares import minimise
from pzd.record import Array, Complex
from pzd.signals.nuisance import NUISANCE_LIMIT, NuisanceConfig

USUAL_SHARE = 0.3
"""Share of the priors on offset, gain and delay by which tests of one stand usually differ.

Reason: the priors allow for any stand; a good one repeats its force within half a per cent."""
SHARE_SCATTER = 0.4
"""Standard deviation of the logarithm of that share from stand to stand: the whole prior lies three of them away."""
SHARES = (0.1, 0.17, 0.3, 0.5, 0.75, 1.0)
"""Shares that are tried."""
DISCREPANCIES = (0.0, *(float(x) for x in np.geomspace(3e-3, 1.5, 20)))
"""Shares of the difference without a name that are tried, from nothing to all of it."""
MOMENTS = (0.0, *(float(x) for x in np.geomspace(0.01, 0.6, 10)))
"""Shares of the difference without a name for moments alone that are tried.

Reason: a law that turns sharply where the damper does so smoothly is off for a moment of the cycle, which is white over
the harmonics, and at the high ones as large as the difference; without it all of the difference would count as little
known as these."""
LEAST_VARIANCE = 1e-10
"""Variance of every number besides, as a share of the squared peak force: 1e-5 of it, the error of a simulation."""
MUCH_OF_TESTS = 0.5
"""Share of the prior that the tests have each of their own from which a fit is begun with little of it too."""
MUCH_WITHOUT_NAME = 0.15
"""Share of the difference without a name from which a fit is begun with all but none of it too.

Reason: what is left by a change that explains the difference is a few hundredths, or a moment; not tuned."""
STEP = 1e-3
"""Step of a coordinate over which the force is differenced: far above the tolerance of the simulations."""
EVALUATIONS = 12
"""Evaluations of a fit at most; each is a simulation of all comparisons for each coordinate."""
ROUNDS = 3
"""Fits with the scatter that the last one left, at most."""
PRECISION = 1e-5
"""Relative change at which a fit ends: the steps of the differences leave no more of the slopes."""


@dataclass(frozen=True)
class Scatter:
    """Shares of the covariance that are estimated."""

    tests: float
    """u: of the priors on offset, gain and delay."""
    discrepancy: float
    """g: of the difference, what no candidate explains."""
    moment: float = 0.0
    """m: of the difference, what no candidate explains for moments alone, as where the rod turns round."""


ALL_BUT_KNOWN = Scatter(SHARES[0], DISCREPANCIES[1], 0.15)
"""Scatter of a law that explains the difference but where the rod turns round.

Reason: a friction that slips sharply where the damper's does over 3 mm/s leaves such a share; it is where a fit begins,
and no limit. Not tuned."""


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Likelihood of the differences of force."""

    comparisons: tuple[Comparison, ...]
    nuisance: NuisanceConfig
    known_discrepancy: float
    """Share of the force that the damper of the first state misses in its own tests, and of a difference as well."""

    @cached_property
    def size(self) -> int:
        """Number of compared numbers."""
        return sum(c.difference.size for c in self.comparisons)

    @cached_property
    def _shapes(self) -> tuple[Array, ...]:
        """(2 H + 1,) mean square of the difference in the octave about every harmonic [N^2]."""
        return tuple(_by_octave(c.measured - c.reference) for c in self.comparisons)

    @cached_property
    def columns(self) -> tuple[Array, ...]:
        """(2 H + 1, 3) difference by one standard deviation of offset, gain and delay of each of two tests [N]."""
        found = []
        for c in self.comparisons:
            offset = np.zeros(c.difference.size)
            offset[0] = self.nuisance.offset * c.peak
            late = stacked(-1j * c.rate * c.reference) * self.nuisance.delay_s
            tests = np.sqrt(2.0) if c.before is not None else 1.0
            found.append(tests * np.column_stack([offset, self.nuisance.gain * stacked(c.reference), late]))
        return tuple(found)

    @cached_property
    def _floors(self) -> tuple[Array, ...]:
        """(2 H + 1,) variance of every comparison whatever has no name [N^2]."""
        # A damper misses the same in all tests that it stands for, so that their number does not average it out.
        alike = sum(each.before is None for each in self.comparisons)
        return tuple(
            c.variance + self.known_discrepancy**2 * self._shapes[i] + alike * self.missed_by_model(i)
            + LEAST_VARIANCE * c.peak**2
            for i, c in enumerate(self.comparisons)
        )  # fmt: skip

    def diagonals(self, at: int, scatters: Sequence[Scatter]) -> Array:
        """Return (s, 2 H + 1) variance of one comparison by noise and discrepancy [N^2]."""
        difference = self.comparisons[at].difference
        squares = np.array([(scatter.discrepancy**2, scatter.moment**2) for scatter in scatters])
        even = np.full(difference.size, difference @ difference / difference.size)
        return np.asarray(self._floors[at] + squares @ np.stack([self._shapes[at], even]))

    def missed_by_model(self, at: int) -> Array:
        """Return (2 H + 1,) mean square that the damper of the first state misses where it stands for a test [N^2]."""
        missed = self.comparisons[at].missed
        return np.zeros(self.comparisons[at].difference.size) if missed is None else missed

    def own_of_tests(self, residuals: Sequence[Array], scatter: Scatter) -> list[Array]:
        """Return (2 H + 1,) what of each residual the test's own offset, gain, delay and jumps explain [N].

        What all tests share beyond chance is none of their own.
        """
        columns, own = [], []
        for i, (r, A) in enumerate(zip(residuals, self.columns, strict=True)):
            U = np.column_stack([scatter.tests * A, self.comparisons[i].jumps])
            weighed = U / self.diagonals(i, [scatter])[0][:, None]
            columns.append(U)
            own.append(np.linalg.solve(np.eye(U.shape[1]) + U.T @ weighed, weighed.T @ r))
        of_test = self.columns[0].shape[1]
        shared = np.mean([mean[:of_test] for mean in own], axis=0)
        chance = LEVEL / np.sqrt(len(own))
        shared -= np.clip(shared, -chance, chance)
        for mean in own:
            mean[:of_test] -= shared
        return [U @ np.clip(mean, -NUISANCE_LIMIT, NUISANCE_LIMIT) for U, mean in zip(columns, own, strict=True)]

    @cached_property
    def _products(self) -> tuple[Array, ...]:
        """(2 H + 1, m, m) products of what each test may have of its own, offset, gain, delay and jumps [N^2]."""
        shared = (np.hstack([A, c.jumps]) for A, c in zip(self.columns, self.comparisons, strict=True))
        return tuple(U[:, :, None] * U[:, None, :] for U in shared)

    def deviances(self, residuals: Sequence[Array], scatters: Sequence[Scatter]) -> Array:
        """Return (s,) -2 ln L of (2 H + 1,) residuals, up to a constant, with the prior on how tests differ.

        Equation: r' V^-1 r = r' D^-1 r - b' M^-1 b, ln det V = ln det D + ln det M, M = I + U' D^-1 U, b = U' D^-1 r
                                                    Source: Woodbury's identity; the determinant lemma
        """
        tests = np.array([each.tests for each in scatters])
        total = (np.log(tests / USUAL_SHARE) / SHARE_SCATTER) ** 2
        for i, (r, A, products) in enumerate(zip(residuals, self.columns, self._products, strict=True)):
            U = np.hstack([A, self.comparisons[i].jumps])
            D = self.diagonals(i, scatters)
            size = np.ones((tests.size, U.shape[1]))
            size[:, : A.shape[1]] = tests[:, None]
            inner = np.tensordot(1.0 / D, products, 1) * size[:, :, None] * size[:, None, :] + np.eye(U.shape[1])
            pull = (r / D) @ U * size
            total += np.sum(r**2 / D + np.log(D), axis=1) + np.linalg.slogdet(inner)[1]
            total -= np.sum(pull * np.linalg.solve(inner, pull[:, :, None])[:, :, 0], axis=1)
        return np.asarray(total)

    def best_scatter(self, residuals: Sequence[Array]) -> tuple[Scatter, float]:
        """Return the likeliest scatter of some residuals on a grid, and -2 ln L there."""
        best, least = Scatter(USUAL_SHARE, 0.0), np.inf
        for _ in range(2):  # one after the other: they are all but independent
            without_name = [Scatter(best.tests, g, m) for g in DISCREPANCIES for m in MOMENTS]
            for tried in (without_name, [replace(best, tests=u) for u in SHARES]):
                found = self.deviances(residuals, tried)
                if np.min(found) < least:
                    least = float(np.min(found))
                    best = tried[int(np.argmin(found))]
        return best, least

    def whiteners(self, scatter: Scatter) -> list[Array]:
        """Return for every comparison the (2 H + 1, 2 H + 1) matrix that makes its residual white."""
        found = []
        for i, A in enumerate(self.columns):
            J = self.comparisons[i].jumps
            V = np.diag(self.diagonals(i, [scatter])[0]) + scatter.tests**2 * A @ A.T + J @ J.T
            found.append(np.linalg.inv(np.linalg.cholesky(V)))
        return found


def _by_octave(spectrum: Complex) -> Array:
    """Return the (2 H + 1,) mean square of a spectrum in the octave about every harmonic, and no less than of a jump.

    Laws change at once where a damper does so smoothly: that a valve opens earlier, or a friction is more, makes
    harmonics of a jump, falling with the order, where the measured difference has none. So none holds less than that.
    """
    power = octave_mean(np.abs(spectrum) ** 2)
    falling = np.maximum(np.arange(power.size), 1.0) ** 2
    power = np.maximum.accumulate(power * falling) / falling
    return np.concatenate([power, power[1:]])


@dataclass(frozen=True, eq=False)
class Fitted:
    """Some changes fitted together."""

    candidates: tuple[Candidate, ...]
    values: Array
    """(p,) of their coordinates."""
    differences: tuple[Array, ...]
    """(2 H + 1,) difference that they make in every comparison [N]."""
    residuals: tuple[Array, ...]
    """(2 H + 1,) what they leave [N]."""
    scatter: Scatter
    bic: float

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """All coordinates."""
        return coordinates_of(self.candidates)

    @property
    def mean_square(self) -> float:
        """Mean square of what is left, over the comparisons [N^2]."""
        return float(np.mean([r @ r for r in self.residuals]))

    def in_order(self, candidates: Sequence[Candidate]) -> Fitted:
        """Return the same fit with its changes in another order; the last one is that which is asked about."""
        if self.candidates == tuple(candidates):
            return self
        return replace(
            self, candidates=tuple(candidates), values=np.concatenate([self.values_of(c) for c in candidates])
        )

    def values_of(self, candidate: Candidate) -> Array:
        """Return the values of one candidate's coordinates."""
        return self.values[[self.coordinates.index(c) for c in candidate.coordinates]]


def coordinates_of(candidates: Sequence[Candidate]) -> tuple[Coordinate, ...]:
    """Return the coordinates of several candidates."""
    return tuple(c for candidate in candidates for c in candidate.coordinates)


@dataclass(eq=False)
class Regression:
    """Fits of changes to the differences of force."""

    likelihood: Likelihood
    response: Response

    @property
    def comparisons(self) -> tuple[Comparison, ...]:
        """What is compared."""
        return self.likelihood.comparisons

    def fit(self, candidates: Sequence[Candidate], start: Array, scatter: Scatter) -> Fitted:
        """Fit some changes by least squares, the scatter estimated in turn.

        Parameters
        ----------
        candidates : which
        start : (p,) values of the coordinates
        scatter : with which the fit begins
        """
        candidates = tuple(candidates)
        found = self._fitted(candidates, start, scatter)
        if not candidates:
            return found
        # What the tests are taken to have each of their own, or to have no name, may be the change, which then has
        # nothing to explain.
        ends = [found]
        if found.scatter.tests >= MUCH_OF_TESTS:
            ends.append(self._fitted(candidates, start, replace(scatter, tests=SHARES[0])))
        if found.scatter.discrepancy >= MUCH_WITHOUT_NAME:
            nearer = self._stepped(found, ALL_BUT_KNOWN)
            if nearer.bic < found.bic:
                ends.append(self._fitted(candidates, nearer.values, nearer.scatter))
        return min(ends, key=lambda each: each.bic)

    def _stepped(self, found: Fitted, scatter: Scatter) -> Fitted:
        """Return a fit after one linear step with another scatter."""
        coordinates = found.coordinates
        whiteners = self.likelihood.whiteners(scatter)
        r = np.concatenate([W @ each for W, each in zip(whiteners, found.residuals, strict=True)])
        step = np.linalg.lstsq(self.jacobian(coordinates, found.values, whiteners), r, rcond=STEP)[0]
        limits = [c.low for c in coordinates], [c.high for c in coordinates]
        return self._described(found.candidates, np.clip(found.values + step, *limits))

    def _fitted(self, candidates: tuple[Candidate, ...], start: Array, scatter: Scatter) -> Fitted:
        """Fit by least squares and estimate the scatter in turn: the optimum is that near the scatter begun with."""
        coordinates = coordinates_of(candidates)
        x = start
        if coordinates:
            low = np.array([c.low for c in coordinates])
            high = np.array([c.high for c in coordinates])
            for _ in range(ROUNDS):
                whiteners = self.likelihood.whiteners(scatter)

                def residual(x: Array, whiteners: list[Array] = whiteners) -> Array:
                    made = self.response.of(coordinates, x.tolist())
                    return np.concatenate(
                        [W @ (c.difference - d) for W, c, d in zip(whiteners, self.comparisons, made, strict=True)]
                    )

                def slopes(x: Array, whiteners: list[Array] = whiteners) -> Array:
                    return -self.jacobian(coordinates, x, whiteners)

                found = minimise(residual, x, slopes, (low, high), precision=PRECISION, evaluations=EVALUATIONS)
                x = found.x
                left = self._left(coordinates, x)
                new, _ = self.likelihood.best_scatter(left[1])
                if new == scatter:
                    break
                scatter = new
        return self._described(candidates, x)

    def _described(self, candidates: tuple[Candidate, ...], x: Array) -> Fitted:
        """Return what (p,) values of the coordinates leave, with its scatter and criterion."""
        coordinates = coordinates_of(candidates)
        made, residuals = self._left(coordinates, x)
        scatter, deviance = self.likelihood.best_scatter(residuals)
        penalty = len(coordinates) * float(np.log(self.likelihood.size))
        return Fitted(candidates, x, made, residuals, scatter, deviance + penalty)

    def _left(self, coordinates: Sequence[Coordinate], x: Array) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
        made = self.response.of(coordinates, x.tolist())
        return made, tuple(c.difference - d for c, d in zip(self.comparisons, made, strict=True))

    def jacobian(self, coordinates: Sequence[Coordinate], x: Array, whiteners: Sequence[Array]) -> Array:
        """Compute the (w, p) derivatives of the whitened difference by the coordinates."""
        columns = self.columns(coordinates, x)
        return np.concatenate([W @ own for W, own in zip(whiteners, columns, strict=True)])

    def columns(self, coordinates: Sequence[Coordinate], x: Array) -> list[Array]:
        """Compute for every comparison the (2 H + 1, p) derivatives of the difference by the coordinates [N]."""
        if not coordinates:
            return [np.zeros((c.difference.size, 0)) for c in self.comparisons]
        per_coordinate = []
        here = self.response.of(coordinates, x.tolist())
        for j, c in enumerate(coordinates):
            width = STEP if x[j] + STEP <= c.high else -STEP
            there = self.response.of(coordinates, [*x[:j].tolist(), float(x[j] + width), *x[j + 1 :].tolist()])
            per_coordinate.append([(b - a) / width for a, b in zip(here, there, strict=True)])
        return [np.column_stack([each[i] for each in per_coordinate]) for i in range(len(self.comparisons))]

    def covariance(self, columns: Sequence[Array], residuals: Sequence[Array], scatter: Scatter) -> Array:
        """Compute the (p, p) covariance of coordinates, wider where the tests disagree by more than the scatter.

        Equation: (J' J)^-1 sqrt(w_i w_j), w as in `pzd.fit.intervals.widening`

        Parameters
        ----------
        columns : (2 H + 1, p) derivatives of the difference of every comparison by the coordinates [N]
        residuals : (2 H + 1,) what they leave [N]
        scatter : with which they were fitted
        """
        whiteners = self.likelihood.whiteners(scatter)
        J = [W @ own for W, own in zip(whiteners, columns, strict=True)]
        r = [W @ each for W, each in zip(whiteners, residuals, strict=True)]
        alone = covariance(np.concatenate(J))
        squares, freedom = float(sum(each @ each for each in r)), self.likelihood.size - alone.shape[0]
        spread = np.sqrt(widening(disagreement(J, r, alone), squares, freedom))
        return np.asarray(alone * np.outer(spread, spread))
