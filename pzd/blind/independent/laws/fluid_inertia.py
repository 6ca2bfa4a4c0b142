"""Oil accelerated in a duct, or a mass that moves with the rod.

Equation: F = m a                               Source: Swift et al. 2013, Vehicle System Dynamics 51(11)
"""

from __future__ import annotations

from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "fluid_inertia"


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a mass that takes that share of the peak force at the largest acceleration."""
    return {"m": strength * scale.force / scale.acceleration}


def force(acceleration: float, m: float) -> float:
    """Force [N] at an acceleration of the rod [m/s2]."""
    return m * acceleration
