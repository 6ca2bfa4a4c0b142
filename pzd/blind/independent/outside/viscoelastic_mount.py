"""A rubber bushing beside the damper that relaxes: stiffness and loss depend on the frequency.

Equation: F = k_z (x - z),  c_z dz/dt = F                       Source: standard linear solid; Zener 1948
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "viscoelastic_mount"
DESCRIBED_BY: tuple[str, ...] = ()


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a bushing that relaxes in 20 to 200 ms and reaches that share of the peak force."""
    stiffness = strength * scale.force / scale.stroke
    return {"bushing_stiffness": stiffness, "bushing_time": float(np.exp(draw.uniform(np.log(0.02), np.log(0.2))))}


def force(x: float, relaxed: float, bushing_stiffness: float) -> float:
    """Force [N] at an extension of which so much has relaxed [m]."""
    return bushing_stiffness * (x - relaxed)


def relaxation_rate(x: float, relaxed: float, bushing_time: float) -> float:
    """Rate of what has relaxed [m/s]."""
    return (x - relaxed) / bushing_time
