"""How often a motion turns, noise and ripple left aside."""

from __future__ import annotations

import numpy as np

from pzd.record import Array

REVERSAL_SHARE = 0.1
"""A reversal counts where the motion then goes back by more than this share of the range."""


def reversal_count(x: Array) -> int:
    """Number of turning points after which the motion goes back by more than 10 % of its range."""
    threshold = REVERSAL_SHARE * float(np.ptp(x))
    count, direction, extreme, low, high = 0, 0, float(x[0]), float(x[0]), float(x[0])
    for value in _extremes(x):
        if direction == 0:
            low, high = min(low, value), max(high, value)
            if high - low > threshold:
                direction, extreme = (1, high) if value == high else (-1, low)
        elif (value - extreme) * direction > 0.0:
            extreme = value
        elif (extreme - value) * direction > threshold:
            count, direction, extreme = count + 1, -direction, value
    return count


def _extremes(x: Array) -> list[float]:
    """Turning points of the samples, thinned to the extremes of short blocks in long records."""
    block = max(x.size // 20_000, 1)
    if block > 1:
        whole = x[: x.size // block * block].reshape(-1, block)
        order = np.sort(np.stack((whole.argmin(axis=1), whole.argmax(axis=1)), axis=1), axis=1)
        x = np.concatenate((np.take_along_axis(whole, order, axis=1).ravel(), x[whole.size :]))
    turns: list[float] = x.tolist()
    return turns
