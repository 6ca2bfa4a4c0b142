"""A blow-off valve: above its force the characteristic goes on with a flatter slope.

Equation: F = b + C_r (w - w_b) beyond b = max(F_r, T0)         Source: Dixon 2007, The Shock Absorber Handbook
"""

from __future__ import annotations

from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "relief_valve"


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a valve that opens between half and nine tenths of the peak force, the wider the stronger."""
    return {"F_r": float(draw.uniform(0.5, 0.9)) * scale.force, "C_r": scale.damping / (1.0 + 10.0 * strength)}


def opening_force(F_r: float, friction: float) -> float:
    """Force [N] at which the valve opens."""
    return max(F_r, friction)


def flow_beyond(excess: float, C_r: float) -> float:
    """Flow speed [m/s] through the open valve at a force so far above its opening [N]."""
    return excess / C_r
