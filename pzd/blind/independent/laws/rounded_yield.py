"""The yield of a magneto-rheological fluid builds up over a flow speed instead of at once.

Equation: T0 tanh(w/w_s)                                        Source: Kwok et al. 2006, J. Sound Vib. 296
"""

from __future__ import annotations

import math

from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "rounded_yield"


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a law of that strength, 1 rounding the yield over the whole range of speeds."""
    return {"w_s": min(0.5, strength) * scale.speed}


def yield_force(flow: float, friction: float, w_s: float) -> float:
    """Force [N] of the yield at a flow speed > 0 [m/s]."""
    return friction * math.tanh(flow / w_s) if w_s > 0.0 else friction
