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
        least = SHARE * 0.5 * float(np.ptp(values))
        for mains in MAINS:
            amplitude = _hum(test, values, mains) if test.record.rate >= LEAST_RATE * mains else 0.0
            if amplitude > least:
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


def _hum(test: Measured, values: Array, mains: float) -> float:
    """Amplitude of the mains, 0 where no line stands out: in the record, or in what its cycles leave."""
    run = test.run
    whole = _line(values, test.record.rate, mains, run.frequency if run else 0.0)
    if whole > 0.0 or run is None or run.count < 3:
        return whole
    time = test.record.time
    inside = run.inside(time)
    average = run.mean(time, values)
    repeated = np.interp(run.phase(time[inside]), np.arange(average.size + 1) / average.size, [*average, average[0]])
    return _line(values[inside] - repeated, test.record.rate, mains, 0.0)


def _line(values: Array, rate: float, frequency: float, cycle: float) -> float:
    """Amplitude of a line that stands out of its neighbourhood, which holds harmonics of the motion; else 0."""
    window = np.hanning(values.size)
    ramp = np.linspace(values[0], values[-1], values.size)
    spectrum = 2.0 * np.abs(np.fft.rfft((values - ramp) * window)) / window.sum()
    resolution = rate / values.size
    off = np.abs(np.fft.rfftfreq(values.size, 1.0 / rate) - frequency)
    wide = max(LINES_OFF, 1.5 * resolution)
    inside, around = off <= wide, (off > wide + 3.0 * resolution) & (off <= max(5.0, 3.0 * cycle, 20.0 * resolution))
    if not inside.any() or not around.any():
        return 0.0
    amplitude = float(spectrum[inside].max())
    return amplitude if amplitude > STANDS_OUT * float(spectrum[around].max()) else 0.0
