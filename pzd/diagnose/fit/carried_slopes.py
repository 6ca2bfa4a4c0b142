"""Slopes of the residuals along a search: by differences where they must be, carried from point to point elsewhere.

Equation: J+ = J + (r+ - r - J d) (D^2 d)' / (d' D^2 d), D^2 the squared lengths of the columns of J
Source: Broyden 1965, Math. Comp. 19, 577-593; a record at a time as in Griewank and Toint 1982, Numer. Math. 39, 119

Differences cost two simulations for each variable and record, a step that shows how the force has bent one a record.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pzd.record import Array

TRUSTED = 0.1
"""Slopes are carried while they miss less than this share of a step [r.m.s. of the residuals].

Reason: with seven effects fitted to a damper that has another one, first fits cost half as much as with differences at
every point and end within 1 % of what they gain; at 0.3 the search for a relief valve got stuck."""
SAME_PLACE = 0.1
"""Over so little [standard errors, all variables together] the slopes are the same.

Reason: what ends a search that near its optimum moves nothing that is told; not tuned."""


class CarriedSlopes:
    """The derivatives (w, p) that a search asks for at one point after another."""

    def __init__(
        self,
        residuals: Callable[[Array], Array],
        differences: Callable[[Array], Array],
        blocks: Sequence[tuple[slice, Sequence[int]]],
        known: tuple[Array, Array] | None = None,
    ) -> None:
        """Begin without slopes, or with some that are known about.

        Parameters
        ----------
        residuals : (w,) at a point (p,), in units of noise
        differences : (w, p) derivatives at a point, exact
        blocks : the residuals of each record, and the variables that move them
        known : a point and (w, p) derivatives about there
        """
        self._residuals, self._differences, self._blocks = residuals, differences, blocks
        self._at: Array | None = None
        self._slopes: Array | None = None
        if known is not None:
            self._at, self._slopes = known
        self.exact = False
        """Whether the slopes asked for last are differences at that point, or as good as."""

    def renew(self) -> None:
        """Take differences at the next point, wherever it is."""
        self._at = None

    def __call__(self, x: Array) -> Array:
        """(w, p) slopes at a point (p,)."""
        if self._at is None or self._slopes is None:
            return self._taken(x)
        step = x - self._at
        along = self._slopes @ step
        moved = float(np.linalg.norm(along))
        if moved <= SAME_PLACE:
            return self._slopes
        miss = self._residuals(x) - self._residuals(self._at) - along
        if float(np.linalg.norm(miss)) > TRUSTED * moved:
            return self._taken(x)
        self._slopes = self._carried(self._slopes, step, miss)
        self._at, self.exact = x.copy(), False
        return self._slopes

    def _taken(self, x: Array) -> Array:
        self._at, self._slopes, self.exact = x.copy(), self._differences(x), True
        return self._slopes

    def _carried(self, slopes: Array, step: Array, miss: Array) -> Array:
        carried = slopes.copy()
        for rows, columns in self._blocks:
            own = step[columns]
            weighted = np.sum(slopes[rows][:, columns] ** 2, axis=0) * own
            size = float(own @ weighted)
            if size > 0.0:
                carried[rows, columns] += np.outer(miss[rows], weighted / size)
        return carried
