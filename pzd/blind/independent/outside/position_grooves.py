"""Grooves in the tube let oil past the piston about the middle of the stroke.

Equation: C (1 - a / (1 + exp((|x| - x_g)/b)))
Source: position-sensitive damping by bypass grooves; Lee and Moon 2005, Vehicle System Dynamics 43(9)
"""

from __future__ import annotations

import math

from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "position_grooves"
DESCRIBED_BY: tuple[str, ...] = ()


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of grooves that take that share of C away over a quarter to two thirds of the stroke."""
    return {
        "groove": min(0.8, strength),
        "groove_end": float(draw.uniform(0.25, 0.65)) * scale.stroke,
        "groove_run_out": 0.04 * scale.stroke,
    }


def damping_factor(x: float, groove: float, groove_end: float, groove_run_out: float) -> float:
    """Factor on C at an extension from the middle [m]."""
    beyond = min(50.0, (abs(x) - groove_end) / groove_run_out)
    return 1.0 - groove / (1.0 + math.exp(beyond))
