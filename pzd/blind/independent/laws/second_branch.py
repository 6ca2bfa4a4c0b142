"""A second elasto-plastic element beside the first (Maxwell slip).

Equation: dF_2/dt = k_2 dx/dt, |F_2| <= T0_2                    Source: Iwan 1966, J. Appl. Mech. 33(4)
"""

from __future__ import annotations

from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "second_branch"


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a branch that slips at that share of the peak force."""
    slips = strength * scale.force
    return {"T0_2": slips, "k_2": slips / (float(draw.uniform(0.05, 0.3)) * scale.stroke)}


def next_force(force: float, travel: float, T0_2: float, k_2: float) -> float:
    """Force of the branch [N] after a travel of the rod to one side [m]."""
    return min(T0_2, max(-T0_2, force + k_2 * travel))
