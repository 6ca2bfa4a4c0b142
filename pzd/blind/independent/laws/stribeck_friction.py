"""Seal friction that falls as the lip floats up.

Equation: F = F_s exp(-(v/v_s)^2) sign(v)     Source: Armstrong-Helouvry, Dupont and Canudas de Wit 1994, Automatica 30
"""

from __future__ import annotations

import math

from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "stribeck_friction"


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a friction of that share of the peak, that falls between 5 and 30 % of the largest speed."""
    return {"F_s": strength * scale.force, "v_s": float(draw.uniform(0.05, 0.3)) * scale.speed}


def force(speed: float, F_s: float, v_s: float) -> float:
    """Force [N] at a speed of the rod [m/s]."""
    size = F_s * math.exp(-((speed / v_s) ** 2))
    return size if speed > 0.0 else -size if speed < 0.0 else 0.0
