"""A blow-off valve: beyond its opening force the characteristic continues with a flatter slope.

Law: where the flow curve passes b = max(F_r, T0) it goes on with slope C_r < C. Range: passenger
car dampers open between 0.05 and 0.3 m/s.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import inf

import numpy as np

from pzd.damper.effect import Effect, Parameter, Scales, Search, Strength


def _hidden(draw: np.random.Generator, scales: Scales) -> Strength:
    beyond = float(draw.uniform(0.2, 0.6)) * scales.damping
    # Below the yield of every condition it would be open always, which is another C.
    friction = max((T0 for T0, _ in scales.flow), default=0.0)
    return lambda s: {"F_r": scales.force - 0.95 * s * max(scales.force - friction, 0.0), "C_r": beyond}


def _flatter(values: Mapping[str, float], damping: float) -> bool:
    """Return whether the open valve is softer than the closed one."""
    return values["C_r"] < damping


# Close to 1 as well: where T0 is most of the force, no step leads on from a start below T0.
_F_R_SEARCH = Search(lambda s: s.force, (0.05, 0.12, 0.3, 0.5, 0.7, 0.8, 0.9), logarithmic=True, flowing=True)

EFFECT = Effect(
    name="relief_valve",
    place="flow",
    law="beyond b = max(F_r, T0) the slope is C_r",
    parameters=(
        Parameter("F_r", "N", inf, 0.0, 1.0e7, "force at which the valve opens", _F_R_SEARCH),
        Parameter(
            "C_r", "N s/m", 0.0, 1.0e-3, 1.0e8, "slope beyond it", Search(lambda s: s.damping, (0.4,), logarithmic=True)
        ),
    ),
    natural=_flatter,
    source="two-stage damper valve; Dixon 2007, The Shock Absorber Handbook",
    tests=(({"F_r": 900.0, "T0": 300.0}, 900.0), ({"F_r": 200.0, "T0": 300.0}, 300.0)),
    hidden=_hidden,
)


def opens_at(F_r: float, T0: float) -> float:
    """Force b [N] beyond which the slope is C_r."""
    return max(F_r, T0)


def slope_beyond(C_r: float) -> float:
    """Slope [N s/m] beyond it."""
    return C_r
