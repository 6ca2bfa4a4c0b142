"""A fluid whose structure breaks down in flow and builds up at rest, so that its yield has a memory.

Equation: dl/dt = (1 - l)/tau - beta |w| l,  T0 (1 + a l)
Source: Moore 1959, Trans. Br. Ceram. Soc. 58; Barnes 1997, J. Non-Newtonian Fluid Mech. 70
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "thixotropy"
DESCRIBED_BY: tuple[str, ...] = ()


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a structure that rebuilds in 0.1 to 1 s and adds that share of four times the peak force."""
    return {
        "structure": 4.0 * strength,
        "rebuilding": float(np.exp(draw.uniform(np.log(0.1), np.log(1.0)))),
        "breakdown": float(draw.uniform(3.0, 10.0)) / scale.stroke,
    }


def friction_factor(built: float, structure: float) -> float:
    """Factor on T0 at a structure between 0 (broken) and 1 (built)."""
    return 1.0 + structure * built


def structure_rate(built: float, flow: float, rebuilding: float, breakdown: float) -> float:
    """Rate of the structure [1/s] at a flow speed [m/s]."""
    return (1.0 - built) / rebuilding - breakdown * abs(flow) * built
