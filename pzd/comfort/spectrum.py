"""Frequency components of a ride: harmonics over a periodic road, third-octave bands over any other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pzd.record import Array

_MOST_HARMONICS = 200  # more would be slow, and lie far beyond the 80 Hz of any standard
_TRUE_CENTRE = 10.0
"""True centres are 10^(n/10) Hz, edges 10^((n +- 1/2)/10) Hz."""
_NOMINAL = (1.0, 1.25, 1.6, 2.0, 2.5, 3.15, 4.0, 5.0, 6.3, 8.0)
"""Nominal centres of a decade, ISO 266."""
_LOWEST_BAND = -10
"""The band at 0.1 Hz, which includes all below."""


@dataclass(frozen=True, eq=False)
class Components:
    """Components of a vibration, each at one frequency."""

    frequency: Array
    """(n,) [Hz]"""
    rms: Array
    """(n,) [m/s2]"""
    share: float
    """Share of the mean square in all of them."""


def harmonics(acceleration: Array, rate: float, fundamental: float) -> Components:
    """Fit harmonics to a ride over a periodic road by least squares, whole number of periods or not.

    Equation: a(t_n) = sum_k c_k exp(j k p n), |k| <= K, p = 2 pi f / rate; the normal equations are Toeplitz
    with the geometric sums g_m = (1 - exp(j m p N)) / (1 - exp(j m p)); r.m.s. of harmonic k = sqrt(2) |c_k|

    Parameters
    ----------
    acceleration : (n,) settled ride, one period or more [m/s2]
    rate : sampling rate [Hz]
    fundamental : frequency of the road [Hz]

    Returns
    -------
    one component per harmonic, from the fundamental up to the Nyquist frequency, or to the 200th
    """
    from scipy.linalg import solve_toeplitz

    count = min(max(int(0.49 * rate / fundamental + 1e-9), 1), _MOST_HARMONICS)
    step = 2.0 * np.pi * fundamental / rate
    upper = _projections(acceleration, step, count)
    right = np.concatenate([upper[:0:-1].conj(), upper])
    weights = solve_toeplitz(_gram(step, count, acceleration.size), right)
    total = acceleration.size * float(np.var(acceleration))
    left = float(acceleration @ acceleration) - float((right.conj() @ weights).real)
    rms = (np.sqrt(2.0) * np.abs(weights[count + 1 :])).astype(np.float64)
    return Components(fundamental * np.arange(1.0, count + 1.0), rms, 1.0 - left / total if total > 0.0 else 1.0)


def _projections(acceleration: Array, step: float, count: int) -> NDArray[np.complex128]:
    """Compute the (count + 1,) sums of a(n) exp(-j k step n) over the samples, k from 0."""
    turn = np.exp(-1j * step * np.arange(acceleration.size))
    part = acceleration.astype(np.complex128)
    sums = np.empty(count + 1, dtype=np.complex128)
    for k in range(count + 1):
        sums[k] = np.sum(part)
        part *= turn
    return sums


def _gram(step: float, count: int, samples: int) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Compute first column and row (2 count + 1,) of the sums of exp(j (k - i) step n) over the samples."""
    apart = step * np.arange(1.0, 2.0 * count + 1.0)
    row = np.empty(2 * count + 1, dtype=np.complex128)
    row[0] = samples
    row[1:] = (1.0 - np.exp(1j * apart * samples)) / (1.0 - np.exp(1j * apart))
    return row.conj(), row


def third_octaves(acceleration: Array, rate: float) -> Components:
    """Compute the r.m.s. in third-octave bands from the mean square of the spectral lines between true edges.

    Parameters
    ----------
    acceleration : (n,) settled ride [m/s2]
    rate : sampling rate [Hz]

    Returns
    -------
    one component per band, at its nominal centre, from 0.1 Hz to the Nyquist frequency
    """
    number = np.arange(_LOWEST_BAND, int(np.floor(_TRUE_CENTRE * np.log10(0.5 * rate) + 0.5)) + 1)
    nominal = np.array([_NOMINAL[n % 10] * 10.0 ** (n // 10) for n in number])
    lines = np.fft.rfft(acceleration - acceleration.mean())
    mean_square = 2.0 * np.abs(lines) ** 2 / acceleration.size**2
    if acceleration.size % 2 == 0:
        mean_square[-1] *= 0.5
    frequency = np.fft.rfftfreq(acceleration.size, 1.0 / rate)
    low, high = 10.0 ** ((number - 0.5) / _TRUE_CENTRE), 10.0 ** ((number + 0.5) / _TRUE_CENTRE)
    low[0] = 0.0
    bands = np.array([mean_square[(frequency >= a) & (frequency < b)].sum() for a, b in zip(low, high, strict=True)])
    total = float(mean_square.sum())
    return Components(nominal, np.sqrt(bands), float(bands.sum()) / total if total > 0.0 else 1.0)
