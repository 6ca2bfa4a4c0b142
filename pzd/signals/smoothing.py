"""Smoothing spline for a displacement, its corner chosen by generalised cross-validation."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pzd.record import Array, Complex
from pzd.signals.measures import found_once

HIGHEST = 20.0
"""Highest corner of the smoothing [rad/sample]: it leaves a record without noise unchanged."""
_CORNERS = 60
"""Corners that are compared: 16 % apart for a record of a thousand samples, 30 % for one of a million."""
_BINS = 2000
"""Bands of frequency in which the spectrum is summed, so that a score does not cost a pass over all samples."""
_HALVINGS = 6
"""Halvings of the band examined, down to 1/64 of half the sampling rate: no sensor is sampled faster than that."""
CLEAR = 2.0
"""Multiple of the corner above which the filter removes all but 1.5 %: what lies there is noise."""
_FEWEST = 50
"""Fewest frequencies for a noise level: its standard error is then below 15 %."""
_FAINT = 1e-6
"""Largest power of noise, as a share of that of the motion: a thousandth of its r.m.s.

Reason: a displacement sensor is better than that, and a sweep fills its band as evenly as noise."""
_STANDS_OUT = 3.0
"""Multiple of ln(n) times the mean that no power of white noise exceeds: of n powers one does so in n^2 records."""
_LONG = 131_072
"""Samples from which the memory and time of a transform matter."""


@found_once
def low_pass(values: Array, highest: float) -> Array:
    """Smooth a signal on a regular grid by a spline of the sixth order, its corner chosen by cross-validation.

    Equation: gain = 1 / (1 + (2 sin(w/2) / w_c)^6), w_c minimising sum((1 - g)^2 P) / sum(1 - g)^2
              Source: Craven and Wahba 1979, in the frequency domain

    Parameters
    ----------
    values : (n,) at a regular step
    highest : largest corner [rad/sample]

    Returns
    -------
    (n,) smoothed; the ends are continued by point reflection
    """
    from scipy.fft import irfft

    line, spectrum, s = _reflected(values)
    gain = 1.0 / (1.0 + (s / _corner(s, np.abs(spectrum) ** 2, highest)) ** 6)
    smooth: Array = irfft(spectrum * gain, 2 * (line.size - 1))[: values.size]
    return smooth + line[: values.size]


def motion_below(values: Array) -> float:
    """Return the frequency [rad/sample] above which a motion (n,) is below its noise; pi where it never is."""
    _, spectrum, s = _reflected(values)
    return min(_corner(s, np.abs(spectrum) ** 2, HIGHEST), float(np.pi))


# --- Steps ---
#
# Where a step takes several samples, or the samples meet it at the same places in each cycle, its error is no white
# noise, and its lines would count as motion.


@found_once
def without_steps(values: Array, step: float) -> Array:
    """Return a channel (n,) on a regular grid without the lines that hold no more than its steps add."""
    if step <= 0.0:
        return values
    from scipy.fft import irfft

    line, spectrum, _ = _reflected(values)
    spectrum[_resolved_lines_of(spectrum, step) + 1 :] = 0.0
    return np.asarray(irfft(spectrum, 2 * (line.size - 1))[: values.size] + line[: values.size])


def resolved_below(values: Array, step: float) -> float:
    """Return the frequency above which a channel (n,) holds no more than its steps add [rad/sample]."""
    line, spectrum, _ = _reflected(values)
    return min(_resolved_lines_of(spectrum, step) * np.pi / (line.size - 1), np.pi)


def _resolved_lines_of(spectrum: Complex, step: float) -> int:
    """Return the number of the first lines (m,) of a reflected channel that hold more than its steps add."""
    return resolved_lines(np.abs(spectrum) ** 2 * (0.5 / (spectrum.size - 1) ** 2), step)


def resolved_lines(power: Array, step: float) -> int:
    """Return the number of the first lines (h,) of a spectrum [m^2] beyond which there is no more than steps [m] add.

    Equation: the least h with sum_(>= h) p_h <= q^2 / 12        Source: Morozov 1966, discrepancy principle
    """
    beyond = np.cumsum(power[::-1])[::-1]
    return int(np.searchsorted(-beyond, -(step**2) / 12.0))


def cut_above(displacement: Array, corner: float) -> tuple[Array, float]:
    """Return a displacement (n,) without what is above a corner [rad/sample], and its noise [m].

    The noise is that of the octave above the corner, where what the motion loses is counted with it.
    """
    line, spectrum, _ = _reflected(displacement)
    size = 2 * (line.size - 1)
    frequency = np.arange(spectrum.size) * (2.0 * np.pi / size)
    octave = spectrum[(frequency > corner) & (frequency <= 2.0 * corner)]
    spectrum[frequency > corner] = 0.0
    noise = float(np.sqrt(np.mean(np.abs(octave) ** 2) / size)) if octave.size else 0.0
    return (np.fft.irfft(spectrum, size)[: displacement.size] + line[: displacement.size]), noise


# --- Corner by cross-validation ---


def _reflected(values: Array) -> tuple[Array, Complex, Array]:
    """Return the line (m,) through both ends, the spectrum (m,) of the reflected rest, and 2 sin(w/2) (m,); m >= n.

    By scipy, which takes half of numpy's time for a length of large prime factors.
    """
    from scipy.fft import rfft

    values = _of_fast_length(values)
    line = np.linspace(values[0], values[-1], values.size)
    flat = values - line
    return line, rfft(np.concatenate((flat, -flat[-2:0:-1]))), _sines(values.size)


@lru_cache(maxsize=2)
def _sines(size: int) -> Array:
    """Return 2 sin(w/2) (size,) of the frequencies of a signal of so many samples, reflected."""
    return np.asarray(2.0 * np.sin(np.pi * np.arange(size) / (2 * (size - 1))))


class _Bands(NamedTuple):
    """Bands of frequency in which a spectrum is summed, and what the filter takes of them."""

    edges: NDArray[np.int64]
    """(b,) first line of each."""
    counts: Array
    """(b,) lines of each."""
    middle: Array
    """(b,) mean 2 sin(w/2) of each."""
    corners: Array
    """(c,) corners [rad/sample]."""
    taken: Array
    """(c, b) share that each corner takes of each band."""


@lru_cache(maxsize=2)
def _bands(size: int, highest: float) -> _Bands:
    """Return the bands of a spectrum (size,); records of one length follow one another."""
    s = _sines(size)
    edges = np.unique(np.geomspace(1, size, _BINS).astype(np.int64))
    edges = edges[edges < size]
    counts = np.diff(np.append(edges, size)).astype(np.float64)
    middle = np.add.reduceat(s, edges) / counts
    corners = np.geomspace(min(np.pi / size, highest), highest, _CORNERS)
    return _Bands(edges, counts, middle, corners, 1.0 / (1.0 + np.outer(corners**6, middle**-6.0)))


def _of_fast_length(values: Array) -> Array:
    """Continue a long signal by its point reflection, as far as its transform needs to be of a fast length.

    Another length, of large prime factors, takes ten times the memory and up to ten times as long. What is added, at
    most 3 %, is what the reflection puts there anyway. A short one ends where it does: its last value holds the line.
    """
    if values.size < _LONG:
        return values
    from scipy.fft import next_fast_len

    more = int(next_fast_len(values.size - 1, real=True)) + 1 - values.size
    return np.concatenate((values, 2.0 * values[-1] - values[-2 : -2 - more : -1])) if more else values


def _corner(s: Array, power: Array, highest: float) -> float:
    """Choose the corner [rad/sample] of least generalised cross-validation, in the widest band of even noise.

    Cross-validation assumes white noise. Where an anti-aliasing filter has left none at high frequencies, the noise
    below would count as motion. So bands from 0 to a half, a quarter, an eighth ... of the range are examined too, and
    the lowest corner is taken above which no line exceeds the noise of its band and the total power is faint.
    """
    edges, counts, middle, corners, taken = _bands(s.size, float(highest))
    binned = np.add.reduceat(power, edges)
    found = float(corners[_least_score(taken, binned, counts)])
    for halvings in range(1, _HALVINGS + 1):
        limit = s[-1] / 2.0**halvings
        inside, last = int(np.searchsorted(middle, limit, "right")), int(np.searchsorted(s, limit, "right"))
        if last < _FEWEST:
            break
        corner = float(corners[_least_score(taken[:, :inside], binned[:inside], counts[:inside])])
        first = int(np.searchsorted(s, CLEAR * corner, "right"))
        if last - first < _FEWEST:
            continue
        level = float(np.mean(power[first:last]))
        above = power[first:]
        even = float(np.max(above)) <= _STANDS_OUT * np.log(above.size) * level
        if even and float(np.sum(above)) <= _FAINT * float(np.sum(power)):
            found = min(found, corner)
    return found


def _least_score(taken: Array, binned: Array, counts: Array) -> int:
    """Return the index of the corner of least score; `taken` (corners, bins) is the share that each removes."""
    return int(np.argmin((taken**2 @ binned) / (taken @ counts) ** 2))
