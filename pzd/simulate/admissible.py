"""The box Omega(V) of admissible forces, equation (11) of the paper, by either of its two bounds."""

from __future__ import annotations

from pzd.compiled import inlined
from pzd.record import Array
from pzd.table.kernel import table_range


@inlined
def coefficient_bounds(velocity: float, c_min: float, c_max: float) -> tuple[float, float]:
    """Lowest and highest force between two damping coefficients.

    Equation: T_i in [c_min V_i, c_max V_i]      Source: Makowski and Knap 2021, eq. (11) and section 5

    Parameters
    ----------
    velocity : suspension speed V_i [m/s]
    c_min, c_max : smallest and largest damping coefficient of the axle [N s/m]

    Returns
    -------
    lowest and highest force of the axle [N]
    """
    if velocity >= 0.0:
        return c_min * velocity, c_max * velocity
    return c_max * velocity, c_min * velocity


@inlined
def table_bounds(
    velocity: float, motion_ratio: float, dampers: float, speeds: Array, rebound: Array, compression: Array
) -> tuple[float, float]:
    """Lowest and highest force that the table has between its lowest and highest voltage.

    Equation: T_i in {n r F(U, r V_i): U_min <= U <= U_max}      Source: Makowski and Knap 2021, eq. (11)

    Parameters
    ----------
    velocity : suspension speed V_i; the sign bit of 0 picks the side [m/s]
    motion_ratio : r, damper extension over suspension deflection
    dampers : n, number of dampers at the axle
    speeds, rebound, compression : the table, see `pzd.table.kernel.table_force`

    Returns
    -------
    lowest and highest force of the axle [N]
    """
    low, high = table_range(speeds, rebound, compression, motion_ratio * velocity)
    return dampers * motion_ratio * low, dampers * motion_ratio * high
