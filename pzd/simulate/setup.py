"""What all rides on one damper share, and one of them ridden: with the best value where its policy holds one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from pzd.comfort.weighting import weighted
from pzd.signals.root_mean_square import rms
from pzd.simulate.config import SimulateConfig
from pzd.simulate.dynamic_damper import DynamicDamper
from pzd.simulate.outcome import Outcome
from pzd.simulate.plan import Case
from pzd.simulate.profile import Profile
from pzd.simulate.ride_model import TableArrays
from pzd.simulate.riding import Held, ride_case
from pzd.simulate.tuning import best_value, damping_range
from pzd.simulate.window import event_of

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

    def ridden(self, case: Case) -> tuple[Held, Outcome]:
        """Ride one case; what its policy holds constant stands beside the ride.

        Raises
        ------
        DataError : when the ride needs the table where it ends
        """
        held = Held.of(self.config, self.grid)
        if case.policy.tuned == "voltage":
            low, high = float(self.grid.voltages[0]), float(self.grid.voltages[-1])
            held = replace(held, voltage=best_value(lambda u: self._a_w(case, replace(held, voltage=u)), low, high))
        if case.policy.tuned == "damping":
            low, high = (math.log(c) for c in damping_range(self.grid, self.config.coefficients))
            best = best_value(lambda c: self._a_w(case, replace(held, damping=math.exp(c))), low, high)
            held = replace(held, damping=math.exp(best))
        return held, self._ride(self.config, case, held)

    def _ride(self, config: SimulateConfig, case: Case, held: Held) -> Outcome:
        return ride_case(config, case, self.profiles[case.road.name], self.grid, self.oil, self.ends, held)

    def _a_w(self, case: Case, held: Held) -> float:
        """Weighted r.m.s. of the acceleration at K of a ride [m/s2], from the settling time or the event on."""
        rough = self.config.model_copy(update={"tolerance": max(self.config.tolerance, _SEARCH_TOLERANCE)})
        outcome = self._ride(rough, case, held)
        event = event_of(case.road, self.config)
        first = round((self.config.settle_s if event is None else event.entry) / outcome.step)
        return rms(weighted(outcome.comfort, 1.0 / outcome.step)[first:])
