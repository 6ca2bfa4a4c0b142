"""The value with which a ride is most comfortable, of a policy that holds one value: a voltage, or a damping."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pzd.simulate.ride_model import TableArrays
from pzd.table.kernel import table_range

_FIRST = 5
"""Values tried first, evenly spaced."""
_CLOSE = 0.02
"""How closely the best one is found, as a share of the whole range."""
_SLOW = 0.1
"""Share of the tested speed at which a damper is hardest: below, dry friction makes any secant steep."""


def best_value(discomfort: Callable[[float], float], low: float, high: float) -> float:
    """The value in a range with the least discomfort: the best of a few, and the minimum between its neighbours.

    Parameters
    ----------
    discomfort : of a ride with a value
    low, high : the range

    Returns
    -------
    the value
    """
    from scipy.optimize import minimize_scalar

    if not high > low:
        return low
    tried = np.linspace(low, high, _FIRST)
    found = [discomfort(float(value)) for value in tried]
    best = int(np.argmin(found))
    ends = float(tried[max(best - 1, 0)]), float(tried[min(best + 1, _FIRST - 1)])
    closer = minimize_scalar(discomfort, bounds=ends, method="bounded", options={"xatol": _CLOSE * (high - low)})
    return float(closer.x) if closer.fun < found[best] else float(tried[best])


def damping_range(grid: TableArrays, bounds: tuple[float, float] | None) -> tuple[float, float]:
    """Least and largest damping coefficient that the dampers can stand for [N s/m].

    Parameters
    ----------
    grid : the table
    bounds : c_min and c_max where the config gives them; else the softest force over speed of the table, at the
        fastest tested speed, and the hardest, at a tenth of it
    """
    if bounds is not None:
        return bounds
    fast = float(np.max(grid.reach)) or float(grid.speeds[-2])
    softest, _ = table_range(grid.speeds, grid.rebound, grid.compression, fast)
    _, hardest = table_range(grid.speeds, grid.rebound, grid.compression, _SLOW * fast)
    return softest / fast, hardest / (_SLOW * fast)
