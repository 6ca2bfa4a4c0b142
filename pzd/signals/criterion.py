"""Criterion (4) of the paper: how badly a simulated force misses the measured one."""

from __future__ import annotations

import numpy as np

from pzd.record import Array

# ----------------------------------------------------------------------------------------------------
# The size of a signal: its root mean square.


def rms(values: Array) -> float:
    """Root mean square about zero, in the unit of the values.

    Equation: a = sqrt(1/T int a(t)^2 dt)      Source: ISO 2631-1:1997, eq. (1), for an acceleration

    Parameters
    ----------
    values : (n,) at even steps
    """
    return float(np.sqrt(np.mean(values**2)))


# ----------------------------------------------------------------------------------------------------


def criterion(residual: Array, measured: Array) -> float:
    """W_s, the squares of the residual as a share of those of the measured force; a pure number.

    Equation: W_s = sum (F - F_sim)^2 / sum F^2      Source: Makowski and Knap 2021, eq. (4)

    Parameters
    ----------
    residual : (n,) measured less simulated force, of one record or of several in a row [N]
    measured : (n,) the measured force of the same samples [N]
    """
    return float(residual @ residual / (measured @ measured))
