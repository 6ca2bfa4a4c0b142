"""The stack follows the control signal with play.

Equation: Ue = max(U - r, min(U + r, Ue))       Source: Brokate and Sprekels 1996, Hysteresis and Phase Transitions
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from pzd.blind.independent.bingham import Scale
from pzd.record import Array

NAME = "piezo_hysteresis"


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a play of that share of the range of the control signal."""
    return {"r": min(0.2, strength) * scale.voltage}


def effective(signal: Array, r: float) -> Array:
    """(n,) where the stack stands, from the first sample on in the middle of its play."""
    taken = np.empty_like(signal)
    now = float(signal[0])
    for i, asked in enumerate(signal):
        now = min(max(now, asked - r), asked + r)
        taken[i] = now
    return taken
