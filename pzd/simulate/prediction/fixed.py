"""What the ride would be, had a voltage been held from its start: the measure of how much load comfort may cost."""

from __future__ import annotations

import math

from pzd.compiled import compiled
from pzd.simulate.prediction.plant import predicted
from pzd.simulate.prediction.predictor import MEAN_LOAD_1, OBSERVED, WEIGHTED, Predictor
from pzd.simulate.ride_model import Vehicle

_STEEPNESS = 4.0
"""Power with which the weight of a load rises as it leaves that of the best fixed voltage: a tenth more load has
twice the weight."""


@compiled
def ride_fixed(car: Vehicle, plan: Predictor) -> None:
    """Bring the ride at each fixed voltage to the present, over the road that was met since the last observation."""
    for n in range(plan.fixed.shape[0]):
        state, levels = plan.fixed[n], plan.fixed_levels[n]
        predicted(car, plan, state, levels, levels, plan.met, OBSERVED, math.inf)
        for i in range(3):
            square = state[WEIGHTED + i] * state[WEIGHTED + i]
            plan.fixed_means[n, i] += (1.0 - plan.forgotten) * (square - plan.fixed_means[n, i])


@compiled
def weigh_loads(plan: Predictor) -> None:
    """Fill the weights of the wheel loads in this choice.

    Equation: lambda_i = w A / B (B_i / B)^q, B_i = <L_i^2>; A = <a_w^2> and B = max <L_i^2> of the ride at the fixed
    voltage with the least A

    Both terms of the cost are shares of what a fixed voltage does on the same road, so that one weight w serves
    roads of any height; the power holds the loads where they are at the fixed voltage.
    """
    best = 0
    for n in range(1, plan.fixed.shape[0]):
        if plan.fixed_means[n, 0] < plan.fixed_means[best, 0]:
            best = n
    load = max(plan.fixed_means[best, 1], plan.fixed_means[best, 2])
    for i in range(2):
        rise = plan.felt[MEAN_LOAD_1 + i] / load
        plan.load_weights[i] = plan.load_weight * plan.fixed_means[best, 0] / load * rise**_STEEPNESS
