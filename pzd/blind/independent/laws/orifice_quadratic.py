"""Turbulent flow through a sharp orifice.

Equation: dp = rho Q^2 / (2 Cd^2 A^2), so F = q w^2             Source: Merritt 1967, Hydraulic Control Systems
"""

from __future__ import annotations

from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "orifice_quadratic"


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a law of that strength, 1 adding about the peak force of the plain damper."""
    return {"q": strength * scale.force / scale.speed**2}


def pressure_force(flow: float, q: float) -> float:
    """Force [N] that the orifice takes at a flow speed >= 0 [m/s]."""
    return q * flow * flow
