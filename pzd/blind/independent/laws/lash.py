"""Free play before the oil spring, as of a worn bushing.

Equation: F = k dz(x - y), dead zone of whole width delta      Source: Slotine and Li 1991, Applied Nonlinear Control
"""

from __future__ import annotations

from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "lash"


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a play of that share of the stroke."""
    return {"delta": strength * 0.3 * scale.stroke}


def spring_extension(deflection: float, delta: float) -> float:
    """What is left of a deflection [m] for the oil spring."""
    half = 0.5 * delta
    if deflection > half:
        return deflection - half
    if deflection < -half:
        return deflection + half
    return 0.0
