"""An oil that thins under shear: power law of Ostwald and de Waele about 0.3 m/s.

Equation: C w_r (w/w_r)^n                       Source: Bird, Stewart and Lightfoot 2002, Transport Phenomena
"""

from __future__ import annotations

from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "shear_thinning"
REFERENCE = 0.3
"""Flow speed at which the oil takes the force C w whatever n [m/s]; part of the law's definition in `pzd effects`."""


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a law of that strength."""
    return {"n": max(0.3, 1.0 - strength)}


def viscous_force(flow: float, damping: float, n: float) -> float:
    """Force [N] of the oil at a flow speed >= 0 [m/s]."""
    return damping * flow if n == 1.0 else damping * REFERENCE * (flow / REFERENCE) ** n
