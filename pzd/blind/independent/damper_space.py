"""Where the dampers of a benchmark come from: friction alone to viscous alone, rigid to a fifth of the stroke."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.random import Generator

from pzd.record import Array

PEAK_FORCE = (50.0, 2e4)
"""Of a damper without a control signal [N]: from a seat's to a lorry's."""
LIMIT_SHARE = 0.12
"""Share of the dampers at either end of an axis that ends in a limit."""
STIFFEST, SOFTEST = 1e-6, 0.2
"""T0/k over the stroke."""
QUICKEST, SLOWEST = 1e-6, 0.05
"""C/k [s]."""
MOST_GAIN = 4.0
"""T0 under the highest control signal, over that under none."""
GROWTH = (-0.2, 0.5)
"""Change of C and k up to the highest control signal."""
BETWEEN_LIMITS = (1e-3, 0.98)
"""Share of the friction in the peak force where neither T0 nor C may be none: refits of a benchmark scale them."""


def log_between(share: float, low: float, high: float) -> float:
    """Return a number at a share of the way on a logarithmic scale."""
    return float(low * (high / low) ** share)


def with_ends(share: float) -> float:
    """Return a share whose ends 0 and 1 have a weight of their own."""
    return float(np.clip((share - LIMIT_SHARE) / (1.0 - 2.0 * LIMIT_SHARE), 0.0, 1.0))


def elastic_levels(rng: Generator, levels: int, speed: float, stroke: float, quickest: float = QUICKEST) -> Array:
    """Draw T0 [N], C [N s/m] and k [N/m] (levels, 3) of a damper with friction, damping and an oil spring.

    Parameters
    ----------
    rng : of every draw
    levels : of the control signal
    speed : largest of the tests [m/s]
    stroke : least of the tests, from end to end [m]
    quickest : least C/k [s], which an integration follows
    """
    u, growth = rng.random(6), rng.uniform(*GROWTH, 2)
    share = float(np.clip(with_ends(u[1]), *BETWEEN_LIMITS))
    found = levels_of(share, log_between(u[0], *PEAK_FORCE), u[2:].tolist(), growth.tolist(), levels, speed, stroke)
    # A damper of friction has an oil spring that the integration follows and that the tests overcome.
    found[:, 1] = np.maximum(found[:, 1], quickest * found[:, 0] / (SOFTEST * stroke))
    found[:, 2] = np.minimum(found[:, 2], found[:, 1] / quickest)
    return found


def levels_of(
    share: float, peak: float, u: Sequence[float], growth: Sequence[float], levels: int, speed: float, stroke: float
) -> Array:
    """Return T0 [N], C [N s/m] and k [N/m] (levels, 3) of a damper; an infinite k is a rigid one.

    Parameters
    ----------
    share : of the friction in the peak force
    peak : force under no control signal, at the largest speed [N]
    u : (4,) a point of the unit cube: how rigid, by friction or damping, gain, and whether friction or damping says
        what is rigid
    growth : (2,) change of C and k up to the highest level
    levels : of the control signal
    speed : largest of the tests [m/s]
    stroke : least of the tests, from end to end [m]
    """
    rigid, elasticity, of_gain, by_friction = u
    friction, damping = share * peak, (1.0 - share) * peak / speed
    gain = 1.0 + (MOST_GAIN - 1.0) * of_gain if levels > 1 else 1.0
    # The oil spring of the strongest level is no softer than that of any damper.
    stiffness = _stiffness(gain * friction, (1.0 + GROWTH[1]) * damping, stroke, rigid, elasticity, by_friction < 0.5)
    rising = np.linspace(0.0, 1.0, levels)
    rows = [
        (friction * (1.0 + (gain - 1.0) * s), damping * (1.0 + growth[0] * s), stiffness * (1.0 + growth[1] * s))
        for s in rising
    ]
    return np.array(rows)


def _stiffness(friction: float, damping: float, stroke: float, rigid: float, share: float, by_friction: bool) -> float:
    """Return k by T0/k over the least stroke or by C/k, neither beyond what a damper has."""
    if rigid < LIMIT_SHARE:
        return np.inf
    softest = max(friction / (stroke * SOFTEST), damping / SLOWEST)
    wanted = (
        friction / (stroke * log_between(share, STIFFEST, SOFTEST))
        if (by_friction and friction > 0.0) or damping == 0.0
        else damping / log_between(share, QUICKEST, SLOWEST)
    )
    return float(max(wanted, softest))
