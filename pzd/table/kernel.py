"""The table as regular arrays, read by compiled code: the one place where it is interpolated.

Between nodes the force is linear in the voltage and linear in the speed, as the damper's own
parameters are linear in the voltage: it never overshoots, keeps every rise, and its inverse at a
given speed is a line as well, so that force and inverse agree to rounding. The branches v >= +0
and v <= -0 are two arrays: nothing is ever interpolated across v = 0.
"""

from __future__ import annotations

import math

import numpy as np

from pzd.compiled import compiled
from pzd.record import Array


@compiled
def bracket(nodes: Array, value: float) -> int:
    """Index i of the interval nodes[i] <= value <= nodes[i + 1], the outermost one beyond the ends."""
    low, high = 0, nodes.size - 1
    while high - low > 1:
        middle = (low + high) // 2
        if nodes[middle] <= value:
            low = middle
        else:
            high = middle
    return low


@compiled
def table_force(
    voltages: Array, speeds: Array, rebound: Array, compression: Array, voltage: float, velocity: float
) -> float:
    """Force at one voltage and velocity; held beyond the outermost nodes.

    Equation: F = sum over the cell's corners of w_U w_v F_ij, w linear      Source: bilinear interpolation

    Parameters
    ----------
    voltages : (m,) rising [V]
    speeds : (n,) rising from 0 [m/s]
    rebound : (m, n) force at +speed, its first column at v = +0 [N]
    compression : (m, n) force at -speed, its first column at v = -0 [N]
    voltage : control signal [V]
    velocity : rate of extension; the sign bit of 0 picks the side [m/s]

    Returns
    -------
    force [N], NaN where the table has no value
    """
    side = compression if math.copysign(1.0, velocity) < 0.0 else rebound
    j = bracket(speeds, abs(velocity))
    share = min((abs(velocity) - speeds[j]) / (speeds[j + 1] - speeds[j]), 1.0)
    if voltages.size == 1 or voltage <= voltages[0]:
        return _along(side[0], j, share)
    if voltage >= voltages[-1]:
        return _along(side[-1], j, share)
    i = bracket(voltages, voltage)
    weight = (voltage - voltages[i]) / (voltages[i + 1] - voltages[i])
    low, high = _along(side[i], j, share), _along(side[i + 1], j, share)
    return float(low + weight * (high - low))


@compiled
def table_voltage(
    voltages: Array, speeds: Array, rebound: Array, compression: Array, force: float, velocity: float
) -> float:
    """Lowest voltage that gives a force at a velocity.

    Equation: U = U_i + (F - F_i) (U_i+1 - U_i) / (F_i+1 - F_i) in the first interval that holds F
                                                                Source: inverse of the linear interpolation

    Parameters
    ----------
    voltages, speeds, rebound, compression : the table, as for `table_force`
    force : wanted force [N]
    velocity : rate of extension; the sign bit of 0 picks the side [m/s]

    Returns
    -------
    voltage [V], NaN where none gives the force
    """
    side = compression if math.copysign(1.0, velocity) < 0.0 else rebound
    j = bracket(speeds, abs(velocity))
    share = min((abs(velocity) - speeds[j]) / (speeds[j + 1] - speeds[j]), 1.0)
    before = _along(side[0], j, share)
    if force == before:
        return float(voltages[0])
    for i in range(voltages.size - 1):
        after = _along(side[i + 1], j, share)
        if min(before, after) <= force <= max(before, after):
            step = (force - before) / (after - before) if after != before else 0.0
            return float(voltages[i] + step * (voltages[i + 1] - voltages[i]))
        if force == after:  # beside an empty cell
            return float(voltages[i + 1])
        before = after
    return float(np.nan)


@compiled
def table_range(speeds: Array, rebound: Array, compression: Array, velocity: float) -> tuple[float, float]:
    """Lowest and highest force that any voltage gives at a velocity.

    Parameters
    ----------
    speeds, rebound, compression : the table, as for `table_force`
    velocity : rate of extension; the sign bit of 0 picks the side [m/s]

    Returns
    -------
    lowest and highest force [N], infinite the wrong way round (inf, -inf) where the table has no value
    """
    side = compression if math.copysign(1.0, velocity) < 0.0 else rebound
    j = bracket(speeds, abs(velocity))
    share = min((abs(velocity) - speeds[j]) / (speeds[j + 1] - speeds[j]), 1.0)
    low, high = np.inf, -np.inf
    for i in range(side.shape[0]):
        force = _along(side[i], j, share)
        if not math.isnan(force):
            low, high = min(low, force), max(high, force)
    return low, high


@compiled
def _along(column: Array, j: int, share: float) -> float:
    """Force between two speeds of one voltage; exact at the nodes, also beside an empty cell."""
    if share <= 0.0:
        return float(column[j])
    if share >= 1.0:
        return float(column[j + 1])
    return float(column[j] + share * (column[j + 1] - column[j]))


@compiled
def table_forces(
    voltages: Array, speeds: Array, rebound: Array, compression: Array, voltage: Array, velocity: Array, out: Array
) -> None:
    """Fill `out` (n,) with `table_force` of (n,) voltages and velocities."""
    for i in range(out.size):
        out[i] = table_force(voltages, speeds, rebound, compression, voltage[i], velocity[i])


@compiled
def table_voltages(
    voltages: Array, speeds: Array, rebound: Array, compression: Array, force: Array, velocity: Array, out: Array
) -> None:
    """Fill `out` (n,) with `table_voltage` of (n,) forces and velocities."""
    for i in range(out.size):
        out[i] = table_voltage(voltages, speeds, rebound, compression, force[i], velocity[i])


@compiled
def table_ranges(speeds: Array, rebound: Array, compression: Array, velocity: Array, low: Array, high: Array) -> None:
    """Fill `low` and `high` (n,) with `table_range` of (n,) velocities."""
    for i in range(velocity.size):
        low[i], high[i] = table_range(speeds, rebound, compression, velocity[i])
