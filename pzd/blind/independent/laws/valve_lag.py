"""The valve answers the control signal late.

Equation: tau dUe/dt + Ue = U                                   Source: first-order lag
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from pzd.blind.independent.bingham import Scale
from pzd.record import Array

NAME = "valve_lag"


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a lag of that many tenths of a second."""
    return {"tau": min(0.1, 0.1 * strength)}


def effective(signal: Array, step: float, tau: float) -> Array:
    """(n,) what the valve has of a control signal that is sampled every so many seconds and linear between."""
    from scipy.signal import lfilter

    # the exact answer to a ramp from one sample to the next: a first-order hold
    fade = np.exp(-step / tau)
    share = tau / step * (1.0 - fade)
    taken, _ = lfilter([1.0 - share, share - fade], [1.0, -fade], signal, zi=[signal[0] * share])
    return np.asarray(taken)
