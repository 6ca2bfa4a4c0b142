"""What all rides on one damper share, and one of them ridden: with the best value where its policy holds one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from pzd.comfort.weighting import weighted
from pzd.record import Array
from pzd.signals.root_mean_square import rms
from pzd.simulate.config import KM_PER_H, SimulateConfig
from pzd.simulate.dynamic_damper import DynamicDamper
from pzd.simulate.outcome import VOLTAGES, Outcome
from pzd.simulate.pieces import PIECE_S, MeanSquare
from pzd.simulate.plan import Case
from pzd.simulate.policies import policies
from pzd.simulate.profile import Profile
from pzd.simulate.ride_model import TableArrays
from pzd.simulate.riding import Held, RideFound, Take, ride_case
from pzd.simulate.schedule_search import ScheduleSearch, best_schedule, sampled, square_waves
from pzd.simulate.tuning import best_value, damping_range
from pzd.simulate.window import event_of

_SHORT_SETTLE, _SHORT_PERIODS = 2.5, 3.0
"""A schedule is tried for so long before its window [s], and for so many periods in it: what the start leaves is then
below 1 % of the motion. The best is ridden in full before it counts."""
_SEARCH_TOLERANCE = 1e-6
"""Of the rides that are only compared: a_w moves by less than 1e-4 of itself."""


@dataclass(frozen=True, eq=False)
class Setup:
    """Config, roads and damper."""

    config: SimulateConfig
    profiles: Mapping[str, Profile]
    """By the name of the road."""
    grid: TableArrays
    oil: DynamicDamper
    ends: bool
    """Whether the table ends where the rig did."""

    def ridden(self, case: Case, take: Take | None = None) -> tuple[Held, Outcome]:
        """Ride one case; what its policy holds constant stands beside the ride; see `ride_case` for `take`.

        Raises
        ------
        DataError : when the ride needs the table where it ends
        """
        held = Held.of(self.config, self.grid)
        if case.policy.tuned == "schedule":
            return self._best_found(case)
        if case.policy.tuned == "voltage":
            low, high = float(self.grid.voltages[0]), float(self.grid.voltages[-1])
            held = replace(held, voltage=best_value(lambda u: self._a_w(case, replace(held, voltage=u)), low, high))
        if case.policy.tuned == "damping":
            low, high = (math.log(c) for c in damping_range(self.grid, self.config.coefficients))
            best = best_value(lambda c: self._a_w(case, replace(held, damping=math.exp(c))), low, high)
            held = replace(held, damping=math.exp(best))
        return held, self._ride(self.config, case, held, take)

    def _ride(self, config: SimulateConfig, case: Case, held: Held, take: Take | None = None) -> Outcome:
        return ride_case(config, case, self.profiles[case.road.name], self.grid, self.oil, self.ends, held, take)

    def _best_found(self, case: Case) -> tuple[Held, Outcome]:
        """The most comfortable of the other policies and of the schedules of a search, within the bound on the load."""
        own = self.config.best_found
        held, fixed = self.ridden(replace(case, policy=policies()["best_fixed_voltage"]))
        most_load = own.most_load * self._rated(fixed, self.config.settle_s)[1]
        names = [name for name in self.config.policies or () if policies()[name].tuned not in ("voltage", "schedule")]
        ridden = [("best_fixed_voltage", fixed)]
        ridden += [(name, self.ridden(replace(case, policy=policies()[name]))[1]) for name in names]
        rated = [(self._rated(outcome, self.config.settle_s), name, outcome) for name, outcome in ridden]
        (discomfort, _), by, best = min((one for one in rated if one[0][1] <= most_load), key=lambda one: one[0][0])
        search = ScheduleSearch(
            lambda voltages: self._short(case, held, voltages),
            float(self.grid.voltages[0]),
            float(self.grid.voltages[-1]),
            most_load,
        )
        best_schedule(search, self._starts(case, best, search), own.evaluations)
        found = RideFound(by, most_load, search.tried)
        if search.best is not None:
            schedule = tuple(tuple(float(u) for u in axle) for axle in search.best[1])
            by_search = replace(held, found=RideFound("search", most_load, search.tried, schedule))
            outcome = self._ride(self.config, case, by_search)
            a, load = self._rated(outcome, self.config.settle_s)
            if a < discomfort and load <= most_load:
                return by_search, outcome
        return replace(held, found=found), best

    def _starts(self, case: Case, best: Outcome, search: ScheduleSearch) -> list[Array]:
        """Where the search starts: at the best of the policies, and at square waves of voltage."""
        own, profile = self.config.best_found, self.profiles[case.road.name]
        speed = self.config.vehicle_speed_km_per_h * KM_PER_H
        period = 2.0 * math.pi / (profile.wavenumber * speed)
        history = np.asarray(best.history)
        settled = history[history[:, 0] >= self.config.settle_s]
        like = sampled(settled[:, 0], settled[:, VOLTAGES], period, own.intervals // 2)
        late = self.config.car.car().wheelbase / speed / period
        shares = (like - search.low) / max(search.high - search.low, np.finfo(np.float64).tiny)
        return [np.clip(shares, 0.0, 1.0), *square_waves(own.intervals // 2, own.starts, late)]

    def _short(self, case: Case, held: Held, voltages: Array) -> tuple[float, float]:
        """Discomfort and load of a schedule, from a ride of a few periods at a lower tolerance."""
        profile, h = self.profiles[case.road.name], self.config.integration_step_s
        period = 2.0 * math.pi / (profile.wavenumber * self.config.vehicle_speed_km_per_h * KM_PER_H)
        control = round(self.config.control_period_s / h)
        steps = control * math.ceil((_SHORT_SETTLE + _SHORT_PERIODS * period) / (h * control))
        config = self.config.model_copy(
            update={"duration_s": steps * h, "tolerance": max(self.config.tolerance, _SEARCH_TOLERANCE)}
        )
        schedule = tuple(tuple(float(u) for u in axle) for axle in voltages)
        outcome = self._ride(config, case, replace(held, found=RideFound("search", 0.0, 0, schedule)))
        return self._rated(outcome, steps * h - _SHORT_PERIODS * period)

    def _rated(self, outcome: Outcome, after: float) -> tuple[float, float]:
        """Discomfort of a ride after a time [s] by the measure of `best_found` [m/s2], and its larger load [N]."""
        first = round(after / outcome.step)
        if self.config.best_found.measure == "a_w":
            felt = weighted(outcome.comfort, 1.0 / outcome.step)
        else:
            felt = outcome.comfort
        return rms(felt[first:]), max(rms(load) for load in outcome.loads[first:].T)

    def _a_w(self, case: Case, held: Held) -> float:
        """Weighted r.m.s. of the acceleration at K of a ride [m/s2], from the settling time or the event on."""
        rough = self.config.model_copy(update={"tolerance": max(self.config.tolerance, _SEARCH_TOLERANCE)})
        event, step = event_of(case.road, self.config), self.config.integration_step_s
        first = round((self.config.settle_s if event is None else event.entry) / step)
        if self.config.duration_s > PIECE_S:
            mean = MeanSquare(first, step)
            self._ride(rough, case, held, mean.take)
            return mean.root()
        return rms(weighted(self._ride(rough, case, held).comfort, 1.0 / step)[first:])
