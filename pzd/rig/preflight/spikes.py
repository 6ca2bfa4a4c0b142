"""Whether single samples jump away and back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pzd.artefacts import Finding
from pzd.record import Array
from pzd.rig.preflight import Measured

DEVIATIONS = 10.0
"""A spike stands out of the median of its neighbours by this many robust standard deviations,"""
SLOPES = 4.0
"""and by this many times the steepest usual step from one sample to the next,"""
SHARE = 0.02
"""and by this share of the channel's range."""
NEIGHBOURS = 7


def check(test: Measured) -> list[Finding]:
    """Samples of force and displacement that jump away from their neighbours and back."""
    found: list[Finding] = []
    for name, unit, values in (("force", "N", test.record.force), ("displacement", "m", test.record.displacement)):
        deviation = _from_neighbours(values)
        rows = _spikes(values, deviation)
        if rows.size:
            worst = int(rows[np.argmax(np.abs(deviation[rows]))])
            found.append(
                Finding(
                    check="spikes",
                    where=f"{name}, {rows.size} samples, the largest at {test.record.time[worst]:.6g} s",
                    size=float(deviation[worst]),
                    unit=unit,
                    follows="not corrected; in the displacement a spike spoils the speed nearby as well",
                )
            )
    return found


def _from_neighbours(values: Array) -> Array:
    """Deviation (n,) from the running median; zero at the ends."""
    deviation = np.zeros_like(values)
    if values.size >= NEIGHBOURS:
        half = NEIGHBOURS // 2
        windows = np.lib.stride_tricks.sliding_window_view(values, NEIGHBOURS)
        deviation[half:-half] = values[half:-half] - np.median(windows, axis=1)
    return deviation


def _spikes(values: Array, deviation: Array) -> NDArray[np.int64]:
    size = np.abs(deviation)
    noise = 1.4826 * float(np.median(size))
    steps = np.abs(np.diff(values))
    steepest = float(np.percentile(steps, 99.0))
    low, high = np.percentile(values, (0.5, 99.5))
    rows: NDArray[np.int64] = np.flatnonzero(
        size > max(DEVIATIONS * noise, SLOPES * steepest, SHARE * float(high - low), 1e-300)
    )
    return rows
