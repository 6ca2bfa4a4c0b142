"""Searches for the most comfortable ride: over one voltage or damping that is held, or over schedules of voltage."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pzd.comfort.weighting import weighted
from pzd.force_table.lookup import table_range
from pzd.record import Array
from pzd.signals.measures import rms
from pzd.simulate.config import SimulateConfig
from pzd.simulate.policies import policies
from pzd.simulate.ride.model import DynamicDamper, TableArrays
from pzd.simulate.ride.outcome import PIECE_S, VOLTAGES, MeanSquare, Outcome, event_of
from pzd.simulate.ride.riding import CourseSink, FixedValues, SearchResult, ride_case
from pzd.simulate.roads import Profile
from pzd.simulate.study.plan import Case

# --- One value that is held ---

_FIRST = 5
"""Values tried first, evenly spaced."""
_CLOSE = 0.02
"""How closely the best one is found, as a share of the whole range."""
_SLOW = 0.1
"""Share of the tested speed at which a damper is hardest: below, dry friction makes any secant steep."""


def best_value(discomfort: Callable[[float], float], low: float, high: float) -> float:
    """Find the value in a range with the least discomfort: the best of a few, then the minimum between its neighbours.

    Parameters
    ----------
    discomfort : of a ride with a value
    low, high : the range

    Returns
    -------
    the value
    """
    from scipy.optimize import minimize_scalar

    if not high > low:
        return low
    tried = np.linspace(low, high, _FIRST)
    found = [discomfort(float(value)) for value in tried]
    best = int(np.argmin(found))
    ends = float(tried[max(best - 1, 0)]), float(tried[min(best + 1, _FIRST - 1)])
    closer = minimize_scalar(discomfort, bounds=ends, method="bounded", options={"xatol": _CLOSE * (high - low)})
    return float(closer.x) if closer.fun < found[best] else float(tried[best])


def damping_range(grid: TableArrays, bounds: tuple[float, float] | None) -> tuple[float, float]:
    """Return the least and the largest damping coefficient that the dampers can stand for [N s/m].

    Parameters
    ----------
    grid : the table
    bounds : c_min and c_max where the config gives them; else the softest force over speed of the table, at the
        fastest tested speed, and the hardest, at a tenth of it
    """
    if bounds is not None:
        return bounds
    fast = float(np.max(grid.reach)) or float(grid.speeds[-2])
    softest, _ = table_range(grid.speeds, grid.rebound, grid.compression, fast)
    _, hardest = table_range(grid.speeds, grid.rebound, grid.compression, _SLOW * fast)
    return softest / fast, hardest / (_SLOW * fast)


# --- The schedule of voltages with which a periodic ride is most comfortable, within a bound on the wheel load ---

_FIRST_STEP = 0.3
"""Of the search, as a share of the range of voltage."""
_LAST_STEP = 0.01
"""The search from one start ends where its step is this small."""
_FEWEST = 3
"""Evaluations a voltage with which a start is worth taking; where there are fewer, fewer starts are taken."""
_REFINED = 0.4
"""Share of the evaluations that is kept for the second part, in which both halves of the period are free."""

Rate = Callable[[Array], tuple[float, float]]
"""(2, n) voltages -> discomfort, and load of the wheel with the larger one."""


@dataclass
class ScheduleSearch:
    """Schedules tried so far, and the best of them within the bound."""

    rate: Rate
    low: float
    high: float
    most_load: float
    tried: int = 0
    best: tuple[float, Array] | None = None
    """Discomfort and voltages (2, n)."""
    kept: dict[bytes, tuple[float, float]] = field(default_factory=dict)

    def rated(self, shares: Array) -> tuple[float, float]:
        """Return discomfort and load of a schedule (2, n) of shares of the range of voltage; each is ridden once."""
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
    """Return schedules that are hard for a quarter of the period and soft for the next, each with its own lead.

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
    starts : (2, n) shares of the range of voltage over a half of the period, one or more, the most promising first
    evaluations : in all
    """
    first = round((1.0 - _REFINED) * evaluations)
    taken = starts[: max(first // (_FEWEST * starts[0].size), 1)]
    for n, start in enumerate(taken):
        search.descend(start, 2, (first - search.tried) // (len(taken) - n))
    if search.best is not None:
        span = max(search.high - search.low, np.finfo(np.float64).tiny)
        search.descend((search.best[1] - search.low) / span, 1, evaluations - search.tried)


def sampled(time: Array, voltages: Array, period: float, intervals: int) -> Array:
    """Average the voltages of a ride over the intervals of a half period of the road, whichever half.

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


# --- Ride a case on one damper, with the best value where its policy holds one ---

_SHORT_SETTLE, _SHORT_PERIODS = 2.5, 3.0
"""A schedule is tried for so long before its window [s], and for so many periods in it: what the start leaves is then
below 1 % of the motion. The best is ridden in full before it counts."""
_SEARCH_TOLERANCE = 1e-6
"""Of the rides that are only compared: a_w moves by less than 1e-4 of itself."""


@dataclass(frozen=True, eq=False)
class Setup:
    """What all rides on one damper share: config, roads and damper."""

    config: SimulateConfig
    profiles: Mapping[str, Profile]
    """By the name of the road."""
    grid: TableArrays
    damper: DynamicDamper
    ends: bool
    """Whether the table ends where the rig did."""
    rear: tuple[TableArrays, DynamicDamper] | None = None
    """Of axle 2, where its damper is another one."""

    def ridden(self, case: Case, sink: CourseSink | None = None) -> tuple[FixedValues, Outcome]:
        """Ride one case, and return what its policy holds constant beside the ride; see `ride_case` for `sink`.

        Raises
        ------
        DataError : when the ride needs the table where it ends
        """
        fixed = FixedValues.of(self.config, self.grid)
        if case.policy.tuned == "schedule":
            return self._best_found(case)
        if case.policy.tuned == "voltage":
            low, high = float(self.grid.voltages[0]), float(self.grid.voltages[-1])
            fixed = replace(fixed, voltage=best_value(lambda u: self._a_w(case, replace(fixed, voltage=u)), low, high))
        if case.policy.tuned == "damping":
            low, high = (math.log(c) for c in damping_range(self.grid, self.config.coefficients))
            best = best_value(lambda c: self._a_w(case, replace(fixed, damping=math.exp(c))), low, high)
            fixed = replace(fixed, damping=math.exp(best))
        return fixed, self._ride(self.config, case, fixed, sink)

    def _ride(self, config: SimulateConfig, case: Case, fixed: FixedValues, sink: CourseSink | None = None) -> Outcome:
        road = self.profiles[case.road.name]
        return ride_case(config, case, road, self.grid, self.damper, self.ends, fixed, sink, self.rear)

    def _best_found(self, case: Case) -> tuple[FixedValues, Outcome]:
        """Find the most comfortable of the other policies and of searched schedules, within the bound on the load."""
        own = self.config.best_found
        fixed, baseline = self.ridden(replace(case, policy=policies()["best_fixed_voltage"]))
        most_load = own.most_load * self._rated(baseline, self.config.settle_s)[1]
        names = [name for name in self.config.policies or () if policies()[name].tuned not in ("voltage", "schedule")]
        ridden = [("best_fixed_voltage", baseline)]
        ridden += [(name, self.ridden(replace(case, policy=policies()[name]))[1]) for name in names]
        rated = [(self._rated(outcome, self.config.settle_s), name, outcome) for name, outcome in ridden]
        (discomfort, _), by, best = min((one for one in rated if one[0][1] <= most_load), key=lambda one: one[0][0])
        low, high = float(self.grid.voltages[0]), float(self.grid.voltages[-1])
        search = ScheduleSearch(lambda voltages: self._short(case, fixed, voltages), low, high, most_load)
        best_schedule(search, self._starts(case, best, search), own.evaluations)
        if search.best is not None:
            searched = SearchResult("search", most_load, search.tried, _schedule(search.best[1]))
            by_search = replace(fixed, searched=searched)
            outcome = self._ride(self.config, case, by_search)
            a, load = self._rated(outcome, self.config.settle_s)
            if a < discomfort and load <= most_load:
                return by_search, outcome
        return replace(fixed, searched=SearchResult(by, most_load, search.tried)), best

    def _starts(self, case: Case, best: Outcome, search: ScheduleSearch) -> list[Array]:
        """Return the starts of the search: the best of the policies, and square waves of voltage."""
        own, period = self.config.best_found, self._period(case)
        history = np.asarray(best.history)
        settled = history[history[:, 0] >= self.config.settle_s]
        like = sampled(settled[:, 0], settled[:, VOLTAGES], period, own.intervals // 2)
        late = self.config.car.car().wheelbase / self.config.vehicle_speed / period
        shares = (like - search.low) / max(search.high - search.low, np.finfo(np.float64).tiny)
        return [np.clip(shares, 0.0, 1.0), *square_waves(own.intervals // 2, own.starts, late)]

    def _short(self, case: Case, fixed: FixedValues, voltages: Array) -> tuple[float, float]:
        """Return discomfort and load of a schedule, from a ride of a few periods at a lower tolerance."""
        h, period = self.config.integration_step_s, self._period(case)
        control = round(self.config.control_period_s / h)
        steps = control * math.ceil((_SHORT_SETTLE + _SHORT_PERIODS * period) / (h * control))
        config = self._rough().model_copy(update={"duration_s": steps * h})
        searched = SearchResult("search", 0.0, 0, _schedule(voltages))
        outcome = self._ride(config, case, replace(fixed, searched=searched))
        return self._rated(outcome, steps * h - _SHORT_PERIODS * period)

    def _period(self, case: Case) -> float:
        """Return the period of a harmonic road [s]."""
        return 2.0 * math.pi / (self.profiles[case.road.name].wavenumber * self.config.vehicle_speed)

    def _rough(self) -> SimulateConfig:
        """Return the config with the tolerance of rides that are only compared."""
        return self.config.model_copy(update={"tolerance": max(self.config.tolerance, _SEARCH_TOLERANCE)})

    def _rated(self, outcome: Outcome, after: float) -> tuple[float, float]:
        """Return discomfort by the measure of `best_found` [m/s2] and larger load [N] of a ride after a time [s]."""
        first, a_K = round(after / outcome.step), outcome.comfort
        judged = weighted(a_K, 1.0 / outcome.step) if self.config.best_found.measure == "a_w" else a_K
        return rms(judged[first:]), max(rms(load) for load in outcome.loads[first:].T)

    def _a_w(self, case: Case, fixed: FixedValues) -> float:
        """Return the weighted r.m.s. of a_K of a ride [m/s2], from the settling time or the event on."""
        rough = self._rough()
        event, step = event_of(case.road, self.config), self.config.integration_step_s
        first = round((self.config.settle_s if event is None else event.entry) / step)
        if self.config.duration_s > PIECE_S:
            mean = MeanSquare(first, step)
            self._ride(rough, case, fixed, mean.add)
            return mean.root()
        return rms(weighted(self._ride(rough, case, fixed).comfort, 1.0 / step)[first:])


def _schedule(voltages: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(float(u) for u in axle) for axle in voltages)
