"""Air mixes with the oil while a test runs, and the damping fades; no temperature says so.

Equation: C (1 - a (1 - exp(-t/tau)))           Source: Duym, Stiens and Reybrouck 1997, Vehicle System Dynamics 27
"""

from __future__ import annotations

import math

from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "aeration"
DESCRIBED_BY: tuple[str, ...] = ()


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of an oil that loses that share of C within some seconds."""
    return {"fade": min(0.7, strength), "fade_time": float(draw.uniform(1.0, 4.0))}


def damping_factor(time: float, fade: float, fade_time: float) -> float:
    """Factor on C at a time from the beginning of the recording [s]."""
    return 1.0 - fade * (1.0 - math.exp(-max(time, 0.0) / fade_time))
