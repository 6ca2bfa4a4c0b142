"""A first-order recursion without a loop: coloured noise and the warming of a lump are both one."""

from __future__ import annotations

import numpy as np

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
