"""Measures of a vibration history beside its r.m.s.: peak, VDV and MTVV."""

from __future__ import annotations

import numpy as np

from pzd.record import Array

INTEGRATION_TIME_S = 1.0
"""tau of the running r.m.s. behind MTVV, ISO 2631-1:1997, 6.3.1."""


def peak(acceleration: Array) -> float:
    """Largest magnitude [m/s2] of (n,) accelerations [m/s2]."""
    return float(np.max(np.abs(acceleration)))


def vibration_dose(acceleration: Array, rate: float) -> float:
    """Fourth power vibration dose value; it grows with the length of the ride and is not divided by it.

    Equation: VDV = (int a(t)^4 dt)^(1/4)                Source: ISO 2631-1:1997, eq. (5)

    Parameters
    ----------
    acceleration : (n,) weighted acceleration [m/s2]
    rate : sampling rate [Hz]

    Returns
    -------
    [m/s^1.75]
    """
    return float((np.sum(acceleration**4) / rate) ** 0.25)


def maximum_transient(acceleration: Array, rate: float) -> float:
    """Maximum transient vibration value: the largest running r.m.s. over 1 s.

    Equation: MTVV = max sqrt(1/tau int_(t0-tau)^t0 a(t)^2 dt), tau = 1 s
                                                         Source: ISO 2631-1:1997, eq. (2), (4)

    Parameters
    ----------
    acceleration : (n,) weighted acceleration; shorter than 1 s, its r.m.s. is taken [m/s2]
    rate : sampling rate [Hz]

    Returns
    -------
    [m/s2]
    """
    window = min(max(round(INTEGRATION_TIME_S * rate), 1), acceleration.size)
    total = np.concatenate([[0.0], np.cumsum(acceleration**2)])
    return float(np.sqrt(np.max(total[window:] - total[:-window]) / window))
