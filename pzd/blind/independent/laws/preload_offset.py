"""A constant force: the gas pressure on the rod, or a load cell off zero.

Equation: F = F_0                                               Source: Dixon 2007, The Shock Absorber Handbook
"""

from __future__ import annotations

from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "preload_offset"


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a force of that share of the peak, to either side."""
    return {"F_0": float(draw.choice([-1.0, 1.0])) * strength * scale.force}


def force(F_0: float) -> float:
    """Force [N]."""
    return F_0
