"""What the passenger feels of a ride, from every step: weighted measures, and what the vibration is made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pzd.artefacts import SpectrumRow, WeightedRow
from pzd.comfort.iso2631_1997 import evaluate
from pzd.comfort.measures import maximum_transient
from pzd.comfort.spectrum import Components, harmonics, third_octaves
from pzd.comfort.weighting import WK, weighted
from pzd.record import Array
from pzd.signals.root_mean_square import rms
from pzd.simulate.window import Window

_PERIODIC = 0.98
"""Share of the mean square that the harmonics of the road must carry for the ride to count as periodic."""
_TONE = 0.999
"""Share of the mean square in one harmonic that makes a ride a tone."""


@dataclass(frozen=True)
class Vibration:
    """The weighted measures of a ride, and its components."""

    weighted: WeightedRow
    spectrum: tuple[SpectrumRow, ...]


def vibration(
    case: str, point: str, acceleration: Array, step: float, window: Window, fundamental: float | None, lead: int = 0
) -> Vibration:
    """Weight the whole ride from its start, then keep the window.

    Parameters
    ----------
    case, point : of the ride
    acceleration : (m,) of the whole ride from rest, at every step [m/s2]
    step : [s]
    window : in which the ride is judged
    fundamental : frequency of the road, None where it is not harmonic [Hz]
    lead : steps before the window into which the running r.m.s. of its first second reaches

    Returns
    -------
    what the passenger feels
    """
    rate = 1.0 / step
    history = weighted(acceleration, rate)
    found = evaluate(history[window.steps], rate)
    row = WeightedRow(
        case=case,
        point=point,
        weighting=WK.name,
        duration_s=found.duration,
        a_w_m_per_s2=found.a_w,
        peak_m_per_s2=found.peak,
        MTVV_m_per_s2=maximum_transient(history[window.first - lead : window.last + 1], rate) if lead else found.mtvv,
        VDV_m_per_s1_75=found.vdv,
    )
    parts, method = components(acceleration[window.steps], rate, fundamental)
    spectrum = tuple(
        SpectrumRow(case=case, point=point, method=method, frequency_Hz=float(f), rms_m_per_s2=float(level))
        for f, level in zip(parts.frequency, parts.rms, strict=True)
    )
    return Vibration(row, spectrum)


def components(acceleration: Array, rate: float, fundamental: float | None) -> tuple[Components, str]:
    """What an acceleration is made of, and how that was found.

    Parameters
    ----------
    acceleration : (n,) in the window [m/s2]
    rate : [Hz]
    fundamental : frequency of the road, None where it is not harmonic [Hz]

    Returns
    -------
    harmonics of the road where they carry the motion, else third-octave bands; and which
    """
    if fundamental is None or acceleration.size * fundamental < rate:  # less than one period
        return third_octaves(acceleration, rate), "third-octave bands"
    parts = harmonics(acceleration, rate, fundamental)
    if parts.share < _PERIODIC:
        return third_octaves(acceleration, rate), "third-octave bands, since the ride does not repeat with the road"
    total = rms(acceleration - np.mean(acceleration))
    tone = total > 0.0 and float(parts.rms.max()) ** 2 >= _TONE * total**2
    return parts, "a tone at its own frequency" if tone else "harmonic by harmonic"
