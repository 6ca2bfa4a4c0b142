"""A spring that hardens with the cube of the extension.

Equation: F = k_3 x^3                                           Source: Duffing 1918
"""

from __future__ import annotations

from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "cubic_spring"
DESCRIBED_BY: tuple[str, ...] = ("end_stop", "gas_spring")


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a spring that reaches that share of the peak force."""
    return {"cubic": strength * scale.force / scale.stroke**3}


def force(x: float, cubic: float) -> float:
    """Force [N] at an extension from the middle [m]."""
    return cubic * x**3
