"""What a ride is made of: harmonics of a periodic one, third-octave bands of any other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pzd.record import Array

_TRUE_CENTRE = 10.0
"""True centres are 10^(n/10) Hz, edges 10^((n +- 1/2)/10) Hz."""


@dataclass(frozen=True, eq=False)
class Components:
    """Parts of a vibration, each at one frequency."""

    frequency: Array
    """(n,) [Hz]"""
    rms: Array
    """(n,) [m/s2]"""
    share: float
    """Share of the mean square that all of them carry together."""


def harmonics(acceleration: Array, rate: float, fundamental: float, highest: float) -> Components:
    """Least-squares harmonics of a ride over a periodic road.

    Parameters
    ----------
    acceleration : (n,) settled ride, any number of periods from one up [m/s2]
    rate : sampling rate [Hz]
    fundamental : frequency of the road [Hz]
    highest : no harmonic above this, nor above the Nyquist frequency [Hz]

    Returns
    -------
    one component a harmonic, from the fundamental up
    """
    count = max(int(min(highest, 0.49 * rate) / fundamental + 1e-9), 1)
    order = np.arange(1.0, count + 1.0)
    phase = 2.0 * np.pi * fundamental / rate * np.outer(np.arange(acceleration.size), order)
    design = np.hstack([np.ones((acceleration.size, 1)), np.cos(phase), np.sin(phase)])
    weights = np.linalg.solve(design.T @ design, design.T @ acceleration)
    amplitude = np.hypot(weights[1 : count + 1], weights[count + 1 :])
    total = float(np.var(acceleration))
    share = 1.0 - float(np.var(acceleration - design @ weights)) / total if total > 0.0 else 1.0
    frequency: Array = fundamental * order
    return Components(frequency, amplitude / np.sqrt(2.0), share)


def third_octaves(acceleration: Array, rate: float, nominal: Array) -> Components:
    """R.m.s. in third-octave bands, by adding up the mean square of the spectral lines between true edges.

    Parameters
    ----------
    acceleration : (n,) settled ride [m/s2]
    rate : sampling rate [Hz]
    nominal : (m,) nominal centres of the bands [Hz]

    Returns
    -------
    one component a band, at its nominal centre
    """
    lines = np.fft.rfft(acceleration - acceleration.mean())
    mean_square = 2.0 * np.abs(lines) ** 2 / acceleration.size**2
    if acceleration.size % 2 == 0:
        mean_square[-1] *= 0.5
    frequency = np.fft.rfftfreq(acceleration.size, 1.0 / rate)
    number = np.round(_TRUE_CENTRE * np.log10(nominal))
    low, high = 10.0 ** ((number - 0.5) / _TRUE_CENTRE), 10.0 ** ((number + 0.5) / _TRUE_CENTRE)
    bands = np.array([mean_square[(frequency >= a) & (frequency < b)].sum() for a, b in zip(low, high, strict=True)])
    total = float(mean_square.sum())
    return Components(nominal, np.sqrt(bands), float(bands.sum()) / total if total > 0.0 else 1.0)
