"""Gas force and friction: what is left of the force at mid-stroke when the speed goes to zero.

Equation: F_gas = (F_r + F_c) / 2, F_friction = (F_r - F_c) / 2, both at v -> 0
Source: definition; F_r and F_c are the forces in rebound and compression, compression being negative
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.artefacts.characteristics import GasAndFrictionRow, Method, PeakVelocityRow
from pzd.artefacts.matching import same_motion

SLOW_M_PER_S = 0.01
"""Up to this speed a test counts as static: labs measure gas force and friction at 1 to 10 mm/s."""
APART = 1.5
"""The second speed of a line to rest is at least so many times the first, or the line hangs on noise."""


def gas_and_friction(rows: Sequence[PeakVelocityRow]) -> tuple[GasAndFrictionRow, ...]:
    """One row for each condition that has a test in both directions.

    Read from the slowest test. Where that is not static, a line through it and the next speed leads to rest, which
    leaves out what the damping adds; where there is no other speed the row says so.

    Parameters
    ----------
    rows : of the peak-velocity plot, of any conditions
    """
    by_condition: dict[tuple[str | None, float | None, float | None], list[PeakVelocityRow]] = {}
    for row in rows:
        if row.rebound_force_N is not None and row.compression_force_N is not None:
            by_condition.setdefault((row.setting, row.voltage_V, row.temperature_degC), []).append(row)
    return tuple(_of_condition(sorted(mine, key=lambda row: row.speed)) for mine in by_condition.values())


def _of_condition(rows: Sequence[PeakVelocityRow]) -> GasAndFrictionRow:
    """Of the rows of one condition, slowest first."""
    slowest = _same_speed(rows, rows[0])
    speed, gas, friction = _at_one_speed(slowest)
    method: Method = "slow test" if speed <= SLOW_M_PER_S else "at the lowest speed"
    faster = [row for row in rows if row.speed >= APART * speed]
    if speed > SLOW_M_PER_S and faster:
        next_speed, next_gas, next_friction = _at_one_speed(_same_speed(faster, faster[0]))
        share = speed / (next_speed - speed)
        gas, friction = gas - share * (next_gas - gas), friction - share * (next_friction - friction)
        method = "extrapolated to rest"
    return GasAndFrictionRow(
        setting=rows[0].setting,
        voltage_V=rows[0].voltage_V,
        temperature_degC=rows[0].temperature_degC,
        gas_force_N=gas,
        friction_N=friction,
        velocity_m_per_s=speed,
        middle_m=float(np.mean([row.middle_m for row in slowest])),
        method=method,
    )


def _same_speed(rows: Sequence[PeakVelocityRow], first: PeakVelocityRow) -> list[PeakVelocityRow]:
    return [row for row in rows if same_motion(row.speed, first.speed)]


def _at_one_speed(rows: Sequence[PeakVelocityRow]) -> tuple[float, float, float]:
    """Speed [m/s], and mean and half difference of rebound and compression [N]."""
    rebound = float(np.mean([row.rebound_force_N for row in rows]))
    compression = float(np.mean([row.compression_force_N for row in rows]))
    return float(np.mean([row.speed for row in rows])), 0.5 * (rebound + compression), 0.5 * (rebound - compression)
