"""Predictive comfort: of many voltages, tried ahead on the identified dampers in the car, the most comfortable.

Every `hold_s` each pair (U_1, U_2) out of a few `voltages` is held on a plant of the car and its dampers for `hold_s`,
followed by each pair out of a few `tails` until `horizon_s`. The pair is set with which J is least:

    J = integral a_w^2 + sum_i lambda_i L_i^2 dt,   lambda_i = load_weight A / B (B_i / B)^4

a_w = Wk a_K, the weighting of ISO 2631-1:1997 with what it remembers; L_i, the dynamic load of each wheel: S_i + T_i,
or where the wheels have mass the force of the tyre, beyond that at rest; B_i the mean square of L_i of late; A and B
those of a_w and of the larger load at the fixed voltage with the least A, which ride along on the plant over the road
that was observed. So one weight serves roads of any height, and loads that leave those of the fixed voltage soon cost
more than comfort brings.

The plant has the state of the oil, the lag of the valve, the adopted effects and the wheels
(`plant` of `pzd.simulate.control.prediction`). Body, wheels, oil, acceleration and the road under each axle are sensed
exactly, or as `simulate.sensors` gives them: then the height of the road is that of body less suspension, joined to its
rise by a steady Kalman filter (`forecast`, in the same folder). The road ahead is known, or forecast from what has
passed under the front axle (`forecast`); the rear axle meets it (a1 + a2) / speed later. Recent forecast errors may
recur: the ride is tried with them added and subtracted, and a choice must beat the best voltage held on by `margin`,
times the share of the road's motion that the forecasts did not predict.

Source: rollout of base policies, those that hold a voltage: Bertsekas 2017, Dynamic Programming and Optimal Control I,
section 6.4; cost and road are ours.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from pzd.schema.model import Frozen
from pzd.simulate.policies import Policy


class ComfortPredictive(Frozen):
    """Parameters of the policy."""

    road: Literal["known", "unknown"] = "unknown"
    """Whether the road ahead is known, or forecast from the motion of the front axle."""
    load_weight: float = Field(default=0.16, ge=0.0)
    """Weight of the wheel loads beside a_w, both in relation to those at the best fixed voltage."""
    margin: float = Field(default=0.003, ge=0.0, lt=1.0)
    """Share of its cost by which a choice must beat that of a voltage held on, where nothing of the road can be
    forecast; less where more can. Without any, what chance makes better now and then raises the wheel load; with a
    hundredth, nothing is gained on random roads."""
    hold_s: float = Field(default=0.01, gt=0.0)
    """The voltages are chosen this often; a whole number of control periods."""
    horizon_s: float = Field(default=0.31, gt=0.0)
    """How far ahead the ride is tried."""
    voltages: int = Field(default=3, ge=2, le=9)
    """Voltages that may be held, evenly spaced over those of the table."""
    tails: int = Field(default=2, ge=1, le=5)
    """Voltages that may follow, evenly spaced; the lowest alone where it is 1."""

    @model_validator(mode="after")
    def _looks_beyond(self) -> ComfortPredictive:
        if self.horizon_s < 2.0 * self.hold_s:
            raise ValueError(f"horizon_s must be twice hold_s or more (got {self.horizon_s:g} and {self.hold_s:g} s)")
        return self


POLICIES = (
    Policy(
        "comfort_predictive",
        "of many voltages ahead, tried on a model of car and dampers, those with the least weighted acceleration",
        "predict",
        controlled=True,
    ),
)
