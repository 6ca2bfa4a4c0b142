"""Best found: on a periodic road, the most comfortable of all policies and of a search over whole schedules of voltage.

Both axles follow a schedule of voltages that repeats with the road. It is searched for so that a_w (or the r.m.s. of
a_K) is least while the r.m.s. load of the wheel with the larger one stays within `most_load` of that at the best fixed
voltage. No sensor or controller is asked whether it could: this shows how much room there is above those that can.
A search in so many voltages finds a good schedule, and does not prove that there is none better.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from pzd.schema.model import Frozen
from pzd.simulate.policies import Policy


class BestFound(Frozen):
    """Parameters of the policy."""

    measure: Literal["a_w", "rms_aK"] = "a_w"
    """What is to be least: the weighted acceleration at K, or the r.m.s. of that at K itself."""
    most_load: float = Field(default=1.1, ge=1.0)
    """Largest r.m.s. wheel load, in relation to that at the best fixed voltage of the road."""
    intervals: int = Field(default=16, ge=4, multiple_of=2)
    """Voltages in a period of the road, at each axle."""
    starts: int = Field(default=4, ge=1)
    """Square waves of voltage from which the search starts, beside the best of the policies."""
    evaluations: int = Field(default=600, ge=10)
    """Short rides that the search may take, for each road."""


POLICIES = (
    Policy(
        "best_found",
        "the most comfortable of all policies and of the schedules of voltage that a search tried, within a bound on "
        "the wheel load",
        "schedule",
        tuned="schedule",
    ),
)
