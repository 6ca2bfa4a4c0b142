"""The schedule of voltages with which a periodic ride is most comfortable, within a bound on the wheel load."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from pzd.record import Array

_FIRST_STEP = 0.3
"""Of the search, as a share of the range of voltage."""
_LAST_STEP = 0.01
"""The search from one start ends where its step is this small."""
_REFINED = 0.4
"""Share of the evaluations that is kept for the second part, in which both halves of the period are free."""

Rate = Callable[[Array], tuple[float, float]]
"""(2, n) voltages -> discomfort, and load of the wheel with the larger one."""


@dataclass
class ScheduleSearch:
    """What was tried so far, and the best of it within the bound."""

    rate: Rate
    low: float
    high: float
    most_load: float
    tried: int = 0
    best: tuple[float, Array] | None = None
    """Discomfort and voltages (2, n)."""
    kept: dict[bytes, tuple[float, float]] = field(default_factory=dict)

    def rated(self, shares: Array) -> tuple[float, float]:
        """Discomfort and load of a schedule (2, n), as shares of the range of voltage; each is ridden once."""
        within = np.clip(shares, 0.0, 1.0)
        key = within.tobytes()
        if key not in self.kept:
            voltages = self.low + (self.high - self.low) * within
            self.kept[key] = discomfort, load = self.rate(voltages)
            self.tried += 1
            if load <= self.most_load and (self.best is None or discomfort < self.best[0]):
                self.best = discomfort, voltages
        return self.kept[key]

    def descend(self, start: Array, repeats: int, evaluations: int) -> None:
        """Search from a start (2, n), repeated so many times in a period; shares of the range of voltage.

        Source: COBYLA, Powell 1994, a direct search by linear approximations of objective and constraints
        """
        from scipy.optimize import NonlinearConstraint, minimize

        if evaluations <= start.size + 1:  # it begins with one more than there are voltages
            return
        discomfort, _ = self.rated(np.tile(start, repeats))

        def schedule(x: Array) -> Array:
            return np.tile(x.reshape(2, -1), repeats)

        def objective(x: Array) -> float:
            return self.rated(schedule(x))[0] / discomfort

        def load(x: Array) -> Array:
            return np.array([self.rated(schedule(x))[1] / self.most_load])

        minimize(
            objective,
            start.ravel(),
            method="COBYLA",
            bounds=[(0.0, 1.0)] * start.size,
            constraints=NonlinearConstraint(load, -np.inf, 1.0),
            tol=_LAST_STEP,
            options={"maxiter": evaluations - 1, "rhobeg": _FIRST_STEP},
        )


def square_waves(intervals: int, starts: int, late: float) -> list[Array]:
    """Schedules that are hard for a quarter of the period and soft for the next, each with its own lead.

    Parameters
    ----------
    intervals : n of a half of the period
    starts : how many
    late : by which share of the period axle 2 meets the road after axle 1

    Returns
    -------
    (2, n) shares of the range of voltage over a half of the period
    """
    middle = (np.arange(intervals) + 0.5) / (2 * intervals)
    return [
        np.array([(2.0 * (middle - lag) + lead) % 1.0 < 0.5 for lag in (0.0, late)], dtype=np.float64)
        for lead in np.arange(starts) / starts
    ]


def best_schedule(search: ScheduleSearch, starts: Sequence[Array], evaluations: int) -> None:
    """Search from every start, then from the best of all.

    The first part repeats a half of the period, since a sine is mirrored there and so is a damper that is the same in
    both directions; the second frees both halves.

    Parameters
    ----------
    search : holds the best; changed in place
    starts : (2, n) shares of the range of voltage over a half of the period
    evaluations : in all
    """
    first = round((1.0 - _REFINED) * evaluations)
    for n, start in enumerate(starts):
        search.descend(start, 2, (first - search.tried) // (len(starts) - n))
    if search.best is not None:
        span = max(search.high - search.low, np.finfo(np.float64).tiny)
        search.descend((search.best[1] - search.low) / span, 1, evaluations - search.tried)


def sampled(time: Array, voltages: Array, period: float, intervals: int) -> Array:
    """Mean voltage of each interval of a half period of the road, whichever half.

    Parameters
    ----------
    time : (n,) [s]
    voltages : (n, 2) of both axles
    period : of the road [s]
    intervals : of a half period

    Returns
    -------
    (2, intervals) voltages
    """
    place = np.minimum(((2.0 * time / period) % 1.0 * intervals).astype(int), intervals - 1)
    count = np.maximum(np.bincount(place, minlength=intervals), 1)
    return np.array([np.bincount(place, weights=axle, minlength=intervals) / count for axle in voltages.T])
