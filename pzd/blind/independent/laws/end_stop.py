"""Progressive stops near both ends of the stroke.

Equation: F = k_e (|x| - x_e)^2 sign(x) beyond x_e, x from the middle between them     Source: Dixon 2007
"""

from __future__ import annotations

from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "end_stop"


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of stops that reach that share of the peak force at the end of the longest stroke."""
    begins = float(draw.uniform(0.5, 0.85)) * scale.stroke
    return {"k_e": strength * scale.force / (scale.stroke - begins) ** 2, "x_e": begins}


def force(x: float, k_e: float, x_e: float) -> float:
    """Force [N] at an extension from the middle [m]."""
    if x > x_e:
        return k_e * (x - x_e) ** 2
    if x < -x_e:
        return -k_e * (-x - x_e) ** 2
    return 0.0
