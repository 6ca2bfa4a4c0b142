"""Rubber or hydraulic stops near the ends of the stroke.

Law: k_e (|x| - x_e)^2 sign(x) beyond x_e, x counted from the middle between both stops.
Range: the last 10-30 % of the stroke.
"""

from __future__ import annotations

import math

import numpy as np

from pzd.damper.effect import Effect, Parameter, Scales, Search, Strength


def _hidden(draw: np.random.Generator, scales: Scales) -> Strength:
    begins = float(draw.uniform(0.5, 0.85)) * scales.stroke
    stiffness = scales.force / (scales.stroke - begins) ** 2
    return lambda s: {"k_e": stiffness * s, "x_e": begins}


_K_E_SEARCH = Search(lambda s: s.force / s.stroke**2, (0.5,))
_X_E_SEARCH = Search(lambda s: s.stroke, (0.35, 0.7, 0.9), within=(0.3, 0.99))

EFFECT = Effect(
    name="end_stop",
    place="parallel",
    law="k_e (|x| - x_e)^2 sign(x) beyond x_e",
    parameters=(
        Parameter("k_e", "N/m2", 0.0, 0.0, 1.0e12, "progressive stiffness of the stop", _K_E_SEARCH),
        Parameter(
            "x_e", "m", 0.02, 0.0, 1.0, "displacement at which it begins", _X_E_SEARCH, position="to either side of"
        ),
    ),
    needs_displacement_zero=True,
    same_at_every_voltage=True,
    source="quadratic bump stop; Dixon 2007, The Shock Absorber Handbook",
    tests=(
        ({"x": 0.03, "v": 0.0, "a": 0.0, "k_e": 1.0e6, "x_e": 0.02}, 100.0),
        ({"x": -0.03, "v": 0.0, "a": 0.0, "k_e": 1.0e6, "x_e": 0.02}, -100.0),
        ({"x": 0.01, "v": 0.0, "a": 0.0, "k_e": 1.0e6, "x_e": 0.02}, 0.0),
    ),
    hidden=_hidden,
)


def law(x: float, v: float, a: float, k_e: float, x_e: float) -> float:
    """Force [N] parallel to the element at a displacement x [m]."""
    beyond = max(abs(x) - x_e, 0.0)
    return math.copysign(k_e * beyond * beyond, x)
