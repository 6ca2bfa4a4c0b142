"""A gas charge that is compressed polytropically: it hardens towards compression.

Equation: F = F_g (1 - (1 + x/L)^-1.3)          Source: polytropic gas law, exponent between 1 and 1.4; Dixon 2007
"""

from __future__ import annotations

from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "polytropic_gas"
DESCRIBED_BY: tuple[str, ...] = ("gas_spring",)


EXPONENT = 1.3


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a charge whose column is two to eight times the stroke."""
    length = float(draw.uniform(2.0, 8.0)) * scale.stroke
    return {"charge": strength * scale.force * length / (EXPONENT * scale.stroke), "column": length}


def force(x: float, charge: float, column: float) -> float:
    """Force [N] at an extension from the middle [m]."""
    return float(charge * (1.0 - (1.0 + x / column) ** -EXPONENT))
