"""Linear recursions: coloured noise and the warming of a lump are of first order, filters of any."""

from __future__ import annotations

import numpy as np

from pzd.compiled import compiled
from pzd.record import Array

_FORGOTTEN = 1e-18


def recursion(memory: float, inputs: Array) -> Array:
    """What a first-order memory makes of its inputs.

    Equation: y_i = m y_(i-1) + u_i, y_(-1) = 0, that is (1 + m B)(1 + m^2 B^2)(1 + m^4 B^4) ... u
              Source: geometric series of the backward shift B, by doubling

    Parameters
    ----------
    memory : m, from 0 to 1
    inputs : (n,) u

    Returns
    -------
    (n,) y
    """
    values = np.array(inputs, dtype=np.float64)
    shift, share = 1, memory
    while shift < values.size and share > _FORGOTTEN:
        values[shift:] += share * values[:-shift]
        shift, share = 2 * shift, share * share
    return values


def all_pole(coefficients: Array, inputs: Array) -> Array:
    """What a memory of any order makes of its inputs, column by column.

    Equation: y_i = u_i - a_1 y_(i-1) - a_2 y_(i-2) - ..., at rest before the first

    Parameters
    ----------
    coefficients : (order + 1,) 1, a_1, a_2, ...
    inputs : (n, m) u

    Returns
    -------
    (n, m) y
    """
    values = np.array(inputs, dtype=np.float64, order="C")
    _recur(coefficients, values)
    return values


@compiled
def _recur(coefficients: Array, values: Array) -> None:
    for i in range(values.shape[0]):
        for j in range(1, min(coefficients.size, i + 1)):
            for n in range(values.shape[1]):
                values[i, n] -= coefficients[j] * values[i - j, n]
