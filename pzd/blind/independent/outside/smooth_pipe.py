"""Turbulent flow in a smooth duct instead of an orifice.

Equation: F = q w^(7/4)                                         Source: Blasius 1913, friction factor 0.316 Re^(-1/4)
"""

from __future__ import annotations

from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "smooth_pipe"
DESCRIBED_BY: tuple[str, ...] = ("orifice_quadratic",)


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a duct that adds that share of the peak force."""
    return {"duct": strength * scale.force / scale.speed**1.75}


def pressure_force(flow: float, duct: float) -> float:
    """Force [N] that the duct takes at a flow speed >= 0 [m/s]."""
    return float(duct * flow**1.75)
