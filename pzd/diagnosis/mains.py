"""Hum of the mains in the force channel: what it adds to the cycles of tests that are in step with it.

There it stands in every cycle alike, as what a damper does would, and no scatter between cycles shows it. But the mains
hum alike in all tests of a stand, and in slow ones the line is a high harmonic of the motion, where it is prominent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pzd.damper.model import Damper
from pzd.diagnosis import thresholds
from pzd.diagnosis.cleaned_records import CleanedRecord
from pzd.diagnosis.fit.prediction import comparable_samples, predicted_force
from pzd.signals.harmonics import Line, hum_variance, mains_amplitudes
from pzd.signals.noise import harmonics_of


def with_hum(cleaned: Sequence[CleanedRecord], damper: Damper) -> tuple[CleanedRecord, ...]:
    """Allow in every test that repeats for the largest hum that any of the tests shows.

    Parameters
    ----------
    cleaned : the records of one setting
    damper : baseline, whose residual is searched for the lines of the mains
    """
    largest: dict[Line, float] = {}
    for p in cleaned:
        for line, amplitude in _amplitudes(p, damper).items():
            largest[line] = max(largest.get(line, 0.0), amplitude)
    return tuple(_allowing_for(p, largest) for p in cleaned)


def _amplitudes(cleaned: CleanedRecord, damper: Damper) -> dict[Line, float]:
    """Return the amplitudes of the lines of the mains that are prominent in the residual of one record [N]."""
    record, kept = cleaned.record, np.flatnonzero(comparable_samples(cleaned))
    if not kept.size:
        return {}
    between = slice(int(kept[0]), int(kept[-1]) + 1)
    residual = (record.force - predicted_force(damper, cleaned))[between]
    cycle = 0.0 if cleaned.cycles is None else cleaned.cycles.frequency
    return mains_amplitudes(residual, record.rate, cycle, thresholds.LEAST_HUM * float(np.max(np.abs(record.force))))


def _allowing_for(cleaned: CleanedRecord, amplitudes: dict[Line, float]) -> CleanedRecord:
    run = cleaned.cycles
    if run is None or not amplitudes:
        return cleaned
    count, points = cleaned.folded.shape
    variance = hum_variance(amplitudes, run.frequency, harmonics_of(points), run.frequency / count)
    return replace(cleaned, hum_variance=variance)
