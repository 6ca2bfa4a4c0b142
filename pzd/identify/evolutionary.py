"""The evolutionary method, for the paper's genetic algorithm: differential evolution, then least squares."""

from __future__ import annotations

import numpy as np

from pzd.identify.config import EvolutionaryConfig
from pzd.identify.objective import Bingham, Fit, Objective
from pzd.identify.separable import descend
from pzd.record import Array

LEAST_FRICTION = 1e-4
"""Smallest friction of the search, as a share of the peak force: its logarithm needs one."""
OUTSIDE = 10.0
"""What the search sees for a parameter set that the bounds of the other method leave out."""
LEAST_SPREAD = 1e-8
"""Spread of the criterion over the population at which the search ends in any case; the rest is polish."""


def fit_evolutionary(objective: Objective, config: EvolutionaryConfig, seed: int) -> Fit:
    """The optimum that the evolutionary search finds, brought to the bottom by least squares."""
    return descend(objective, search(objective, config, seed))


def search(objective: Objective, config: EvolutionaryConfig, seed: int) -> Bingham:
    """The best member of the last generation of a differential evolution on the criterion.

    Equation: minimise W_s over log T0, log C, log k      Source: Makowski and Knap 2021, eq. (4); Storn and Price 1997

    Parameters
    ----------
    objective : criterion and bounds, the same as of the separable method
    config : population, generations, tolerance
    seed : of the random draws

    Returns
    -------
    parameters, not yet polished
    """
    from scipy.optimize import Bounds, differential_evolution

    low, high = objective.bounds
    low = low._replace(friction=LEAST_FRICTION * high.friction)

    def criterion(logarithms: Array) -> float:
        parameters = Bingham(*(float(p) for p in np.exp(logarithms)))
        return objective.criterion(parameters) if objective.slips(parameters) else OUTSIDE

    found = differential_evolution(
        criterion,
        Bounds(np.log(low), np.log(high)),
        popsize=config.population,
        maxiter=config.generations,
        tol=config.tolerance,
        atol=LEAST_SPREAD,
        seed=seed,
        init="sobol",
        polish=False,
    )
    return Bingham(*(float(p) for p in np.exp(found.x)))
