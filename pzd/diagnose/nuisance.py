"""What may differ from test to test without being an effect: offset, gain and delay of the force."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pzd.diagnose.config import NuisanceConfig

Array = NDArray[np.float64]

AT_MOST = 2.0
"""A nuisance explains at most this many of its standard deviations: 1 % of peak, 1 ms, 4 %; more is a gap."""


def nuisance(residual: Array, predicted: Array, rate: float, variance: float, config: NuisanceConfig) -> Array:
    """The part of a residual that offset, gain and delay of the test explain within their priors.

    Equation: min_b |r - A b|^2 / s^2 + |b|^2, |b_i| <= 2, A = [sd_o peak, sd_g F, -sd_d dF/dt]
                                                                    Source: Gaussian prior, truncated

    Parameters
    ----------
    residual : (n,) measured less predicted force [N]
    predicted : (n,) force [N]
    rate : sampling rate [Hz]
    variance : of the noise [N^2]
    config : standard deviations of the priors

    Returns
    -------
    (n,) force [N]
    """
    peak = float(np.max(np.abs(predicted)))
    columns = np.column_stack(
        [
            np.full(residual.size, config.offset * peak),
            config.gain * predicted,
            -config.delay_s * np.gradient(predicted) * rate,
        ]
    )
    weight = max(variance, 1e-12 * peak**2)
    normal = columns.T @ columns / weight + np.eye(3)
    estimate = np.linalg.solve(normal, columns.T @ residual / weight)
    explained: Array = columns @ np.clip(estimate, -AT_MOST, AT_MOST)
    return explained
