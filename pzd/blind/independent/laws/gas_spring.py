"""The gas charge, linear about the middle of the stroke.

Equation: F = k_g x                                             Source: Dixon 2007, The Shock Absorber Handbook
"""

from __future__ import annotations

from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "gas_spring"


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a spring that reaches that share of the peak force."""
    return {"k_g": strength * scale.force / scale.stroke}


def force(x: float, k_g: float) -> float:
    """Force [N] at an extension from the middle [m]."""
    return k_g * x
