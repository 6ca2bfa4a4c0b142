"""Whether the mains hum in a channel."""

from __future__ import annotations

import numpy as np

from pzd.artefacts import Finding
from pzd.record import Array
from pzd.rig.measured import Measured

MAINS = (50.0, 60.0)
LINES_OFF = 0.2
"""The mains may be off by this much [Hz]."""
STANDS_OUT = 3.0
"""The line is this many times as large as anything in its neighbourhood."""
SHARE = 0.002
"""Smallest amplitude that is said, as a share of half the range."""
LEAST_RATE = 2.5
"""Sampling rate over the frequency of the mains from which it can be seen."""


def check(test: Measured) -> list[Finding]:
    """A line at 50 or 60 Hz in force or displacement that stands out of its neighbourhood."""
    found: list[Finding] = []
    for name, unit, values in (("force", "N", test.record.force), ("displacement", "m", test.record.displacement)):
        for mains in MAINS:
            if test.record.rate < LEAST_RATE * mains:
                continue
            amplitude, around = _line(values, test.record.rate, mains, test.run.frequency if test.run else 0.0)
            if amplitude > max(STANDS_OUT * around, SHARE * 0.5 * float(np.ptp(values))):
                found.append(
                    Finding(
                        check="hum",
                        where=f"{name}, the whole record, at {mains:g} Hz",
                        size=amplitude,
                        unit=unit,
                        follows="amplitude of the mains in this channel; it may be taken for a gap of the model",
                    )
                )
    return found


def _line(values: Array, rate: float, frequency: float, cycle: float) -> tuple[float, float]:
    """Amplitude of the line, and the largest in its neighbourhood, which holds harmonics of the motion."""
    window = np.hanning(values.size)
    line = np.linspace(values[0], values[-1], values.size)
    spectrum = 2.0 * np.abs(np.fft.rfft((values - line) * window)) / window.sum()
    at = np.fft.rfftfreq(values.size, 1.0 / rate)
    resolution = rate / values.size
    off = np.abs(at - frequency)
    inside = off <= max(LINES_OFF, 1.5 * resolution)
    around = (off > max(LINES_OFF, 1.5 * resolution) + 3.0 * resolution) & (
        off <= max(5.0, 3.0 * cycle, 20.0 * resolution)
    )
    return (
        (float(spectrum[inside].max()), float(spectrum[around].max())) if inside.any() and around.any() else (0.0, 0.0)
    )
