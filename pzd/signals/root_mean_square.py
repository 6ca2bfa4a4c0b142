"""The size of a signal: its root mean square."""

from __future__ import annotations

import numpy as np

from pzd.record import Array


def rms(values: Array) -> float:
    """Root mean square about zero, in the unit of the values.

    Equation: a = sqrt(1/T int a(t)^2 dt)      Source: ISO 2631-1:1997, eq. (1), for an acceleration

    Parameters
    ----------
    values : (n,) at even steps
    """
    return float(np.sqrt(np.mean(values**2)))
