"""Warm oil is thin.

Equation: T0 exp(-beta_T0 (T - T_ref)), C exp(-beta_C (T - T_ref))    Source: Reynolds 1886, Phil. Trans. R. Soc. 177
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from pzd.blind.independent.bingham import Scale
from pzd.record import Array

NAME = "temperature_drift"


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of an oil that loses that share over 10 K."""
    beta = min(0.06, strength / 10.0)
    return {"beta_T0": beta * float(draw.uniform(0.6, 1.4)), "beta_C": beta}


def factor(temperature: Array, reference: float, beta: float) -> Array:
    """(n,) factor on T0 or C at temperatures [degC]."""
    return np.asarray(np.exp(-beta * (temperature - reference)))
