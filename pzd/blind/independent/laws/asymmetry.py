"""Other ports or shims for the two directions: rebound is harder, or softer, than compression.

Equation: T0 and C times (1 + alpha sign(F))                     Source: Dixon 2007, The Shock Absorber Handbook
"""

from __future__ import annotations

from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "asymmetry"


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a law of that strength, 1 changing the force about as much as the plain damper has."""
    return {"alpha": float(draw.choice([-1.0, 1.0])) * min(0.7, strength)}


def side_factor(rebound: bool, alpha: float) -> float:
    """Factor on T0 and C of the direction in which the oil flows."""
    return 1.0 + alpha if rebound else 1.0 - alpha
