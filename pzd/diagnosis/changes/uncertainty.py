"""How far fitted changes are known: by noise and tests, what has no name, the first state, and changes left out.

All of `pzd.fit.intervals`, of what changed and of what did not alike. Four things beside the covariance of the fit make
a change uncertain, each a standard error: a force without a name may be of its kind; a damper that misses a share of
the force knows to that share how the force follows a coordinate; so do the parameters of the first state in which it
changed; and one more quantity of the damper may have changed, too little to be adopted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pzd.diagnosis.changes.candidates import ELEMENT_COLUMNS, Candidate, Coordinate, excludes
from pzd.diagnosis.changes.pairs import Comparison, stacked
from pzd.diagnosis.changes.regression import Fitted, Regression
from pzd.diagnosis.changes.selection import Search
from pzd.fit.intervals import LEVEL, SINGULAR, by_what_was_left_out
from pzd.record import Array

LEAST_APART = 1e-3
"""Share of its own force by which each coordinate differs from all others, at least.

Reason: two that do the same to a thousandth (mean square) are already known thirty times as badly as either alone."""
CROSS_STEP = 0.03
"""Step of a coordinate of the first state over which the force of a change is differenced.

Reason: such a force is often a percent of the whole, so that the tolerance of a simulation counts a hundred times as
much as in a slope; a few percent are still a small step."""


@dataclass(frozen=True)
class IfChanged:
    """What is known of a coordinate that was not taken to have changed."""

    value: float
    alone: float
    """Its standard error, had nothing else changed that was not adopted either: whether its change would have shown."""
    error: float
    """Its standard error, small changes of others counted."""
    force: float
    """R.m.s. force by one unit of it, in units of each test's peak."""


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Standard errors of fitted changes, and of what was not taken to have changed beside them."""

    search: Search
    fitted: Fitted

    @property
    def _regression(self) -> Regression:
        return self.search.regression

    @property
    def _comparisons(self) -> tuple[Comparison, ...]:
        return self.search.regression.comparisons

    @cached_property
    def errors(self) -> Array:
        """(p,) standard errors of the fitted coordinates."""
        if not self.fitted.coordinates:
            return np.zeros(0)
        whole_sizes = np.array([c.logarithmic and c.absent for c in self.fitted.coordinates])
        # Of a coordinate that is a logarithm of the whole size, not of its change, the error is the share itself.
        sizes = np.where(whole_sizes, 1.0, self.fitted.values)
        alone, left_out = self._errors(self.fitted.coordinates, sizes, self._columns, self.fitted.residuals)
        return np.hypot(alone, left_out)

    def if_changed(self, candidate: Candidate) -> IfChanged:
        """Return what is known of one more coordinate, to first order about the fit, all others fitted again."""
        (c,) = candidate.coordinates
        columns = [np.column_stack(pair) for pair in zip(self._columns, self._alone[candidate], strict=True)]
        J, r = self._whitened(columns), self._whitened(self.fitted.residuals)
        force = float(self.slopes(columns)[-1])
        scale = np.linalg.norm(J, axis=0)
        scale = np.where(scale > 0.0, scale, 1.0)
        own = J[:, -1] / scale[-1]
        own = own - J[:, :-1] @ np.linalg.lstsq(J[:, :-1], own, rcond=SINGULAR)[0]
        if not own @ own > SINGULAR:  # another one does the same
            return IfChanged(0.0, np.inf, np.inf, force)
        step = np.linalg.lstsq(J / scale, r, rcond=1e-6)[0] / scale
        left = [each - own @ step for each, own in zip(self.fitted.residuals, columns, strict=True)]
        coordinates = (*self.fitted.coordinates, c)
        values = np.append(self.fitted.values, 0.0) + step
        alone, left_out = (float(each[-1]) for each in self._errors(coordinates, values, columns, left))
        return IfChanged(float(values[-1]), alone, float(np.hypot(alone, left_out)), force)

    @cached_property
    def _columns(self) -> list[Array]:
        return self._regression.columns(self.fitted.coordinates, self.fitted.values)

    @cached_property
    def _alone(self) -> dict[Candidate, list[Array]]:
        """(2 H + 1,) slopes of each candidate of the damper that has one coordinate and did not change, at the fit."""
        found = {}
        for candidate in self.search.candidates:
            if not self.tells(candidate):
                continue
            together = (*self.fitted.coordinates, *candidate.coordinates)
            columns = self._regression.columns(together, np.append(self.fitted.values, 0.0))
            found[candidate] = [own[:, -1] for own in columns]
        return found

    def tells(self, candidate: Candidate) -> bool:
        """Whether one number is linear about no change and stands for a candidate of the damper that did not change."""
        if candidate.of == "stand" or candidate.per_voltage or len(candidate.coordinates) > 1:
            return False
        (c,) = candidate.coordinates
        if c.name == "temperature" or (candidate.absent and c.logarithmic):
            return False
        changed = {key for each in self.fitted.candidates for key in each.key}
        return candidate.key[0] not in changed

    def _whitened(self, columns: Sequence[Array]) -> Array:
        return np.concatenate([W @ own for W, own in zip(self._whiteners, columns, strict=True)])

    @cached_property
    def _whiteners(self) -> list[Array]:
        return self._regression.likelihood.whiteners(self.fitted.scatter)

    # --- The parts

    def _errors(
        self, coordinates: Sequence[Coordinate], values: Array, columns: Sequence[Array], residuals: Sequence[Array]
    ) -> tuple[Array, Array]:
        """Return (p,) the standard errors were nothing left out, and (p,) those by what was."""
        covariance = self._regression.covariance(columns, residuals, self.fitted.scatter)
        slopes = self.slopes(columns)
        unnamed = hides(self.search.left(self.fitted), slopes) * self._told_apart(columns)
        missed = self._missed_of_response(coordinates, slopes) * values
        through = self.through_first_state(columns)
        alone = np.maximum(np.diag(covariance), 0.0) + unnamed**2 + missed**2 + through**2
        return np.sqrt(alone), np.sqrt(self._by_what_was_left_out(coordinates, columns, residuals))

    def slopes(self, columns: Sequence[Array]) -> Array:
        """Return (p,) the r.m.s. force by one unit of every coordinate, each test in units of its peak."""
        squares = [np.sum(own**2, axis=0) / c.peak**2 for own, c in zip(columns, self._comparisons, strict=True)]
        return np.asarray(np.sqrt(np.mean(squares, axis=0)))

    def _told_apart(self, columns: Sequence[Array]) -> Array:
        """Return the (p,) factors by which the correlation with the others widens the error of each coordinate.

        All of it may lie in any one direction: where a valve opens and how far go together, and each is known as badly
        as the tests tell them apart.

        Equation: sqrt(diag R^-1), R the correlation of the slopes
        """
        power = np.mean([own.T @ own / c.peak**2 for own, c in zip(columns, self._comparisons, strict=True)], axis=0)
        size = np.sqrt(np.diag(power))
        size = np.where(size > 0.0, size, 1.0)
        alike = power / np.outer(size, size) + LEAST_APART * np.eye(size.size)
        return np.asarray(np.sqrt(np.diag(np.linalg.inv(alike))))

    def _missed_of_response(self, coordinates: Sequence[Coordinate], slopes: Array) -> Array:
        """Return (p,) the share to which it is not known how the force follows a coordinate.

        A model that misses a share of the force knows this to that share. T0, C and k themselves are no better known
        in the first state than what it misses there leaves open, and the force follows them in proportion.
        """
        share = self._regression.likelihood.known_discrepancy
        force = [np.sum(stacked(c.reference) ** 2) / c.peak**2 for c in self._comparisons]
        own = np.minimum(hides(share * float(np.sqrt(np.mean(force))), slopes), 1.0)
        of_element = np.array([c.name in ELEMENT_COLUMNS for c in coordinates])
        return np.where(of_element, np.maximum(own, share), share)

    @cached_property
    def of_first_state(self) -> tuple[tuple[Coordinate, ...], Array]:
        """The (m,) coordinates of the damper of the first state, and their (m, m) covariance.

        They are known but for what the damper misses, all of which may lie in any one direction of them: two that do
        nearly the same are each known as badly as the tests tell them apart. None is open by more than its own size.

        Equation: (J' J / s^2 + 1)^-1, s = share |F| / 1.96, J the slopes; r.m.s. over the tests, in units of the peaks
        """
        known = {*ELEMENT_COLUMNS, *self._regression.response.first.damper.effects}
        single = [c for c in self.search.candidates if c.name in known and not (c.absent or c.per_voltage)]
        own = tuple(c.coordinates[0] for c in single if len(c.coordinates) == 1)
        columns = self._regression.columns(own, np.zeros(len(own)))
        power = np.mean([c.T @ c / each.peak**2 for c, each in zip(columns, self._comparisons, strict=True)], axis=0)
        force = np.mean([np.sum(stacked(c.reference) ** 2) / c.peak**2 for c in self._comparisons])
        missed = self._regression.likelihood.known_discrepancy**2 * force / LEVEL**2
        return own, missed * np.linalg.inv(power + missed * np.eye(len(own))) if missed > 0.0 else np.zeros_like(power)

    @cached_property
    def _cross(self) -> Array:
        """(w, m) change of the whitened difference by one unit of what is not known of the first state."""
        regression, own = self._regression, self.of_first_state[0]
        pairs = zip(self.fitted.coordinates, self.fitted.values, strict=True)
        moved = [(c, float(x)) for c, x in pairs if c.of == "damper"]
        changed, values = [c for c, _ in moved], [x for _, x in moved]
        keys = {(c.name, c.parameter) for c in changed}
        made = regression.response.of(changed, values)
        cross = np.zeros((regression.likelihood.size, len(own)))
        for j, c in enumerate(own):
            if (c.name, c.parameter) in keys:  # its change is counted from it, so that it moves with it
                continue
            step = CROSS_STEP if c.high > CROSS_STEP else -CROSS_STEP
            there = regression.response.of([c, *changed], [step, *values])
            alone = regression.response.of([c], [step])
            cross[:, j] = self._whitened([(t - a - m) / step for t, a, m in zip(there, alone, made, strict=True)])
        return cross

    def through_first_state(self, columns: Sequence[Array]) -> Array:
        """Return the (p,) standard error of coordinates by what is not known of the damper in which they changed.

        An exponent of C shows only in its product with C: one that was found too small makes the change too large.

        Equation: dx = -(J' J)^-1 J' (d^2 F / dx dt) x dt, of the whitened differences; t of the first state
        """
        slopes = np.linalg.pinv(self._whitened(columns)) @ self._cross
        return np.asarray(np.sqrt(np.sum((slopes @ self.of_first_state[1]) * slopes, axis=1)))

    def _by_what_was_left_out(
        self, coordinates: Sequence[Coordinate], columns: Sequence[Array], residuals: Sequence[Array]
    ) -> Array:
        """Return the (p,) variance by one more quantity that changed by less than what is adopted.

        What the stand does to all tests alike is none of them: each has an offset, gain and delay in the covariance.
        """
        own = {(c.name, c.parameter) for c in coordinates}

        def may_have_changed(candidate: Candidate) -> bool:
            return candidate.key[0] not in own and not any(excludes(candidate, c) for c in self.fitted.candidates)

        others = [slopes for candidate, slopes in self._alone.items() if may_have_changed(candidate)]
        if not others:
            return np.zeros(len(coordinates))
        stacks = [np.column_stack(each) for each in zip(*others, strict=True)]
        sizes = hides(self.search.adoptable(self.fitted), self.slopes(stacks))
        J, r = self._whitened(columns), self._whitened(residuals)
        return by_what_was_left_out(J, r, self._whitened(stacks), sizes)


def hides(force: float, slopes: Array) -> Array:
    """Return the (p,) standard errors of coordinates if a force without a name were wholly due to each of them."""
    return np.where(slopes > 0.0, force / LEVEL / np.where(slopes > 0.0, slopes, 1.0), 0.0)
