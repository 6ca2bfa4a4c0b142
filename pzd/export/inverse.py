"""The control signal for a force, on a regular grid: over velocity and share of the range of forces there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pzd.export.content import Content
from pzd.record import Array


@dataclass(frozen=True, eq=False)
class Inverse:
    """The inverse at one temperature; every point of it lies within reach."""

    shares: Array
    """(s,) from 0, the lowest force that the damper gives at a velocity, to 1, the highest."""
    low: Array
    """(n,) lowest force at each velocity of the grid [N]."""
    high: Array
    """(n,) highest force [N]."""
    signals: Array
    """(n, s) lowest control signal that gives the force [V]; NaN where the table is empty."""


def inverses(content: Content) -> tuple[Inverse, ...]:
    """The inverse at each temperature of the table."""
    velocities = content.grid.velocities
    shares = np.linspace(0.0, 1.0, content.force_levels)
    found = []
    for lookup in content.lookups:
        least, most = lookup.range(velocities)
        low, high = np.where(least <= most, least, np.nan), np.where(least <= most, most, np.nan)
        wanted = low[:, np.newaxis] + shares * (high - low)[:, np.newaxis]
        found.append(Inverse(shares, low, high, lookup.nearest_voltage_for(wanted, velocities[:, np.newaxis])))
    return tuple(found)
