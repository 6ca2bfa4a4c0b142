"""The samples at which a motion reverses."""

from __future__ import annotations

import numpy as np

from pzd.record import Array

REVERSAL_SHARE = 0.1
"""Share of the range by which a motion must go back: noise and the creep of a servo stay below it."""


def reversals(displacement: Array, share: float = REVERSAL_SHARE) -> list[int]:
    """Samples at which the motion turns, each between strokes larger than a share of the range.

    Parameters
    ----------
    displacement : (n,) motion, in any unit
    share : of its range
    """
    enough = share * float(np.ptp(displacement))
    steps = np.sign(np.diff(displacement))
    candidates = [0, *(np.flatnonzero(steps[1:] != steps[:-1]) + 1).tolist(), displacement.size - 1]
    turns: list[int] = []
    low = high = 0
    direction = 0
    for i in candidates:
        low = i if displacement[i] < displacement[low] else low
        high = i if displacement[i] > displacement[high] else high
        if direction >= 0 and displacement[high] - displacement[i] > enough:
            if direction or displacement[high] - displacement[0] > enough:
                turns.append(high)
            direction, low = -1, i
        elif direction <= 0 and displacement[i] - displacement[low] > enough:
            if direction or displacement[0] - displacement[low] > enough:
                turns.append(low)
            direction, high = 1, i
    return turns
