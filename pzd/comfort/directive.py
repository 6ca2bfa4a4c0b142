"""Directive 2002/44/EC: daily exposure of a professional driver."""

from __future__ import annotations

EDITION = "Directive 2002/44/EC"

REFERENCE_H = 8.0
ACTION, LIMIT = 0.5, 1.15
"""A(8) [m/s2]."""
ACTION_VDV, LIMIT_VDV = 9.1, 21.0
"""[m/s^1.75]"""


def daily_exposure(a_w: float, hours: float) -> float:
    """Compute the daily exposure normalised to 8 h, from the vertical direction alone (its factor is 1).

    Equation: A(8) = k a_w sqrt(T / 8 h), k = 1 for z    Source: Directive 2002/44/EC, Annex B

    Parameters
    ----------
    a_w : weighted r.m.s. [m/s2]
    hours : of riding per day [h]

    Returns
    -------
    [m/s2]

    Examples
    --------
    >>> daily_exposure(0.6, 2.0)
    0.3
    """
    return float(a_w * (hours / REFERENCE_H) ** 0.5)


def daily_dose(vdv: float, duration: float, hours: float) -> float:
    """Compute the vibration dose of a day of riding.

    Equation: VDV_day = VDV (T_day / T)^(1/4)            Source: Directive 2002/44/EC, Annex B

    Parameters
    ----------
    vdv : dose of the ride [m/s^1.75]
    duration : of the ride [s]
    hours : of riding per day [h]

    Returns
    -------
    [m/s^1.75]
    """
    return float(vdv * (hours * 3600.0 / duration) ** 0.25)


def hours_until(value: float, a_w: float) -> float | None:
    """Compute the daily time after which A(8) reaches a value [h]; None for a vehicle at rest."""
    return REFERENCE_H * (value / a_w) ** 2 if a_w > 0.0 else None


def zone(value: float, action: float, limit: float) -> str:
    """Describe a daily value relative to the action and the limit value."""
    if value > limit:
        return f"above the limit value {limit:g}"
    return f"above the action value {action:g}" if value > action else f"below the action value {action:g}"
