"""A chamber that fills late on one side: its force begins only after some stroke behind a reversal.

Equation: F = k dz(x - y), a dead zone from 0 to delta         Source: Duym, Stiens and Reybrouck 1997, VSD 27
"""

from __future__ import annotations

from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "late_filling"
DESCRIBED_BY: tuple[str, ...] = ("lash",)


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a gap of that share of the stroke."""
    return {"gap": strength * 0.3 * scale.stroke}


def spring_extension(deflection: float, gap: float) -> float:
    """What is left of a deflection [m] for the oil spring."""
    if deflection > gap:
        return deflection - gap
    return min(deflection, 0.0)
