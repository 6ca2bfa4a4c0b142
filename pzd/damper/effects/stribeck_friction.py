"""Seal friction that falls with speed, as the lip begins to float on its oil film.

Law: F_s exp(-(v/v_s)^2) sign(v). Range: 10-200 N, v_s 5-50 mm/s.
"""

from __future__ import annotations

import math

import numpy as np

from pzd.damper.effect import Effect, Parameter, Scales, Search, Strength


def _hidden(draw: np.random.Generator, scales: Scales) -> Strength:
    speed = float(np.exp(draw.uniform(np.log(0.03), np.log(0.3)))) * scales.speed
    return lambda s: {"F_s": 0.5 * scales.force * s, "v_s": speed}


_V_S_SEARCH = Search(lambda s: s.speed, (0.03, 0.15, 0.5), logarithmic=True)

EFFECT = Effect(
    name="stribeck_friction",
    place="parallel",
    law="F_s exp(-(v/v_s)^2) sign(v)",
    parameters=(
        Parameter(
            "F_s", "N", 0.0, 0.0, 1.0e6, "friction at rest above that at speed", Search(lambda s: s.force, (0.02,))
        ),
        Parameter("v_s", "m/s", 0.02, 1.0e-4, 2.0, "speed over which it falls", _V_S_SEARCH),
    ),
    source="Armstrong-Helouvry, Dupont and Canudas de Wit 1994, Automatica 30(7)",
    tests=(
        ({"x": 0.0, "v": 0.02, "a": 0.0, "F_s": 100.0, "v_s": 0.02}, 36.787944117144235),
        ({"x": 0.0, "v": -0.02, "a": 0.0, "F_s": 100.0, "v_s": 0.02}, -36.787944117144235),
        ({"x": 0.0, "v": 0.0, "a": 0.0, "F_s": 100.0, "v_s": 0.02}, 0.0),
    ),
    by_speed_alone=True,
    hidden=_hidden,
)


def law(x: float, v: float, a: float, F_s: float, v_s: float) -> float:
    """Force [N] parallel to the element at a piston speed v [m/s]."""
    if v == 0.0:
        return 0.0
    return math.copysign(F_s * math.exp(-((v / v_s) ** 2)), v)
