"""Whether a channel was cut off at the end of its range."""

from __future__ import annotations

import numpy as np

from pzd.artefacts import Finding
from pzd.record import Array, Rows
from pzd.rig.preflight import Measured

LONGEST_PEAK = 4
"""Equal samples at an extreme up to this many may be the peak itself."""
STEEP = 20.0
"""A plateau is entered steeply where three samples before it lie this many digitisation steps away."""
LEAST_PLATEAUS = 2
BENT = 0.1
"""A control signal that bends at fewer of its samples than this share is a programme of straight lines."""


def check(test: Measured) -> list[Finding]:
    """Plateaus of equal samples at the extremes of a channel, entered steeply."""
    found: list[Finding] = []
    for name, unit, values in ((channel.name, channel.unit, channel.values) for channel in test.channels()):
        if name == test.control.name and _programmed(values):
            continue
        for side, signed in (("top", values), ("bottom", -values)):
            starts, lengths = _plateaus(signed)
            if starts.size >= LEAST_PLATEAUS:
                at, level = test.record.time[starts[0]], values[starts[0]]
                found.append(
                    Finding(
                        check="saturation",
                        where=f"{name}, {starts.size} plateaus at {level:.6g} {unit}, the first at {at:.4g} s",
                        size=float(lengths.sum() / values.size),
                        unit="-",
                        follows=f"this share of the samples is cut off at the {side} of the range; the peak is unknown",
                    )
                )
    return found


def _programmed(values: Array) -> bool:
    """Whether a control signal moves in straight lines, steps and ramps: then it is held, not cut off."""
    bends = np.abs(np.diff(values, 2))
    return bool(np.mean(bends > 1e-9 * float(np.ptp(values))) < BENT)


def _plateaus(values: Array) -> tuple[Rows, Rows]:
    """First samples and lengths of the plateaus at the maximum that are entered steeply."""
    top = values == values.max()
    edges = np.flatnonzero(np.diff(np.concatenate(([0], top.astype(np.int8), [0]))))
    starts, lengths = edges[::2], edges[1::2] - edges[::2]
    moves = np.abs(np.diff(values))
    digit = float(moves[moves > 0.0].min())
    steep = values[starts] - values[np.maximum(starts - 3, 0)] > STEEP * digit
    kept = (lengths > LONGEST_PEAK) & (starts >= 3) & steep
    return starts[kept], lengths[kept]
