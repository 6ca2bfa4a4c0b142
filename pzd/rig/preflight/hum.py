"""Whether the mains hum in a channel."""

from __future__ import annotations

import numpy as np

from pzd.artefacts import Finding
from pzd.record import Array, is_constant, voltage_scale
from pzd.rig.preflight import Measured
from pzd.signals.harmonics import LEAST_RATE, MAINS, line_amplitudes

SHARE = 0.002
"""Smallest amplitude that is said, as a share of half the range."""
LABEL_SHARE = 50.0
"""A control signal, temperature or pressure hums where the line is a tenth of what makes another condition."""


def check(test: Measured) -> list[Finding]:
    """A line at 50 or 60 Hz in a channel that stands out of its neighbourhood."""
    found: list[Finding] = []
    moving = not is_constant(test.record, voltage_scale([test.record]))
    for channel in test.channels():
        if channel.name == test.control.name and moving:
            continue  # a stepped signal has lines of its own
        least = SHARE * (0.5 * float(np.ptp(channel.values)) + LABEL_SHARE * (channel.least or 0.0))
        left = _left_by_cycles(test, channel.values)
        wanted = [mains for mains in MAINS if test.record.rate >= LEAST_RATE * mains]
        whole = line_amplitudes(channel.values, test.record.rate, wanted, test.run.frequency if test.run else 0.0)
        beside = line_amplitudes(left, test.record.rate, wanted, 0.0)
        for mains, of_whole, of_left in zip(wanted, whole, beside, strict=True):
            amplitude = of_whole or of_left
            if amplitude > least:
                found.append(
                    Finding(
                        check="hum",
                        where=f"{channel.name}, the whole record, at {mains:g} Hz",
                        size=amplitude,
                        unit=channel.unit,
                        follows="amplitude of the mains in this channel; it may be taken for a gap of the model",
                    )
                )
    return found


def _left_by_cycles(test: Measured, values: Array) -> Array:
    """What the average cycle leaves of a channel inside the run; nothing where there is no run to average."""
    run, time = test.run, test.record.time
    if run is None or run.count < 3:
        return values[:0]
    inside = run.inside(time)
    average = run.mean(time, values)
    phases = np.arange(average.size + 1) / average.size
    left: Array = values[inside] - np.interp(run.phase(time[inside]), phases, np.append(average, average[0]))
    return left
