"""Viscosity of warm oil: T0 and C fall exponentially with the recorded temperature.

Law: T0 exp(-beta_T0 (T - T_ref)), C exp(-beta_C (T - T_ref)). Range: hydraulic oil loses
1-4 % of its viscosity a kelvin near room temperature.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pzd.damper.effect import Effect, Parameter, Scales, Search, Strength

Numbers = NDArray[np.float64] | float


def _hidden(draw: np.random.Generator, scales: Scales) -> Strength:
    ratio = float(draw.uniform(0.5, 1.5))
    return lambda s: {"beta_T0": 0.06 * ratio * s, "beta_C": 0.06 * s}


EFFECT = Effect(
    name="temperature_drift",
    place="material",
    law="T0 exp(-beta_T0 (T - T_ref)), C exp(-beta_C (T - T_ref))",
    parameters=(
        Parameter("beta_T0", "1/K", 0.0, -0.2, 0.2, "relative fall of T0 a kelvin", Search(lambda _: 0.01, (0.0,))),
        Parameter("beta_C", "1/K", 0.0, -0.2, 0.2, "relative fall of C a kelvin", Search(lambda _: 0.01, (0.0,))),
    ),
    source="Reynolds' viscosity law, 1886; falls with heat in Makowski and Knap 2021, fig. 8 and 9",
    tests=(
        ({"temperature": 43.0, "reference": 23.0, "beta_T0": 0.01}, 0.8187307530779818),
        ({"temperature": 43.0, "reference": 23.0, "beta_C": 0.01}, 0.8187307530779818),
    ),
    needs="temperature",
    hidden=_hidden,
)


def friction_factor(temperature: Numbers, reference: float, beta_T0: Numbers) -> NDArray[np.float64]:
    """Factor on T0 at one or more temperatures [degC]."""
    return np.asarray(np.exp(-beta_T0 * (temperature - reference)))


def damping_factor(temperature: Numbers, reference: float, beta_C: Numbers) -> NDArray[np.float64]:
    """Factor on C at one or more temperatures [degC]."""
    return np.asarray(np.exp(-beta_C * (temperature - reference)))
