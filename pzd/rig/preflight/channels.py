"""Checks of each channel by itself: saturation, spikes, and hum of the mains."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pzd.artefacts import Finding
from pzd.record import Array, Rows, deviation_from_median, glitches
from pzd.rig.preflight import PreflightRecord
from pzd.schema.errors import counted
from pzd.signals.harmonics import LEAST_RATE, MAINS, line_amplitudes

# --- Saturation ---

LONGEST_PEAK = 4
"""Up to this many equal samples at an extreme may be the peak itself."""
STEEP = 20.0
"""A plateau is entered steeply where the third sample before it lies this many digitisation steps away."""
LEAST_PLATEAUS = 2
"""One plateau may be chance; a channel beyond its range is cut off in every cycle."""
BENT = 0.1
"""A control signal that bends at fewer of its samples than this share is a programme of straight lines."""


def saturation(test: PreflightRecord) -> Iterator[Finding]:
    """Find plateaus of equal samples at the extremes of a channel that are entered steeply."""
    for channel in test.channels():
        name, unit, values = channel.name, channel.unit, channel.values
        if name == test.control.name and _is_programme(values):
            continue
        for side, signed in (("top", values), ("bottom", -values)):
            starts, lengths = _plateaus(signed)
            if starts.size >= LEAST_PLATEAUS:
                at, level = test.record.time[starts[0]], values[starts[0]]
                yield Finding(
                    check="saturation",
                    where=f"{name}, {starts.size} plateaus at {level:.6g} {unit}, the first at {at:.4g} s",
                    size=float(lengths.sum() / values.size),
                    unit="-",
                    follows=f"this share of the samples is cut off at the {side} of the range; the peak is unknown",
                )


def _is_programme(values: Array) -> bool:
    """Whether a control signal consists of straight lines, steps and ramps: then it is held, not saturated."""
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
    cut_off = (lengths > LONGEST_PEAK) & (starts >= 3) & steep
    return starts[cut_off], lengths[cut_off]


# --- Spikes ---

EDGE = 3
"""Samples at either end of force and displacement that have too few neighbours to tell a spike from a kink."""


def spikes(test: PreflightRecord) -> Iterator[Finding]:
    """Find samples of a channel that jump away from their neighbours and back."""
    for channel in test.channels():
        away = deviation_from_median(channel.values)
        deviation, rows = np.abs(away), glitches(channel.values, away)
        if channel.same_condition is None:
            rows = rows[(rows >= EDGE) & (rows < deviation.size - EDGE)]
            why = "in the displacement a spike spoils the speed nearby as well"
        else:
            rows = rows[deviation[rows] > channel.same_condition]
            why = "the record's label is the median, which it does not move"
        if rows.size:
            worst = int(rows[np.argmax(deviation[rows])])
            yield Finding(
                check="spikes",
                where=f"{channel.name}, {counted(rows.size, 'sample')}, the largest at {test.record.time[worst]:.6g} s",
                size=float(away[worst]),
                unit=channel.unit,
                follows=f"not corrected; {why}",
            )


# --- Hum ---

HUM_SHARE = 0.002
"""Smallest amplitude that is reported, as a share of half the range."""
LABEL_SHARE = 50.0
"""A control signal, temperature or pressure hums where the line is a tenth of what makes another condition."""


def hum(test: PreflightRecord) -> Iterator[Finding]:
    """Find a line at 50 or 60 Hz that stands out of its neighbourhood in the spectrum of a channel."""
    frequency = test.cycles.frequency if test.cycles else 0.0
    moving = not test.constant_control
    for channel in test.channels():
        if channel.name == test.control.name and moving:
            continue  # a stepped signal has lines of its own
        least = HUM_SHARE * (0.5 * float(np.ptp(channel.values)) + LABEL_SHARE * (channel.same_condition or 0.0))
        mains = [line for line in MAINS if test.record.rate >= LEAST_RATE * line]
        # A line that the harmonics of the motion hide shows once the average cycle is taken out.
        whole = line_amplitudes(channel.values, test.record.rate, mains, frequency)
        aperiodic = line_amplitudes(_without_average_cycle(test, channel.values), test.record.rate, mains, 0.0)
        for line, of_whole, of_aperiodic in zip(mains, whole, aperiodic, strict=True):
            amplitude = of_whole or of_aperiodic
            if amplitude > least:
                yield Finding(
                    check="hum",
                    where=f"{channel.name}, the whole record, at {line:g} Hz",
                    size=amplitude,
                    unit=channel.unit,
                    follows="amplitude of the mains in this channel; it may be taken for a gap of the model",
                )


def _without_average_cycle(test: PreflightRecord, values: Array) -> Array:
    """Residual of a channel about its average cycle; empty where there are too few cycles to average."""
    cycles, time = test.cycles, test.record.time
    if cycles is None or cycles.count < 3:
        return values[:0]
    inside = cycles.inside(time)
    average = cycles.mean(time, values)
    phases = np.arange(average.size + 1) / average.size
    residual: Array = values[inside] - np.interp(cycles.phase(time[inside]), phases, np.append(average, average[0]))
    return residual


CHECKS = (saturation, spikes, hum)
