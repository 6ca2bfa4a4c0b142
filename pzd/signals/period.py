"""The search for the period of a test, from how well the displacement repeats itself.

No shape is assumed. The mismatch between the record and itself one lag later, drift taken
off, is near zero at the period. The speed has to repeat as well: quick motion on a slow wave
is small in the displacement and large in the speed.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from pzd.record import Array
from pzd.signals.smoothing import HIGHEST, low_pass, usual_step

MOST_SAMPLES = 2**18
"""Longer records are thinned to this many samples for the search."""
CANDIDATE = 0.3
"""Mismatch (share of the variance) below which a lag is worth a closer look."""
REPEATS = 0.02
"""Largest mismatch of two adjacent cycles that repeat, as a share of the variance."""
SAME = 2e-5
"""Mismatch that always counts as repeating: 0.4 % in r.m.s."""
SCATTER = 4.0
"""Otherwise up to this many times the median mismatch of the motion counts as repeating."""
SPEED_REPEATS = 0.05
"""The same of the speed, which carries more noise."""
LEAST_SHARE = 0.25
"""The run of repeating cycles has to cover this share of the motion."""
MOVED = 0.05
"""The motion begins where the displacement has left its first value by this share of its range."""
RAMPS = 0.15
"""Share of the motion at either end that is left out where the whole shows no period."""
MOST_CANDIDATES = 40
"""Lags looked at closely, the shortest first."""
LEAST_POINTS = 4
"""Fewest samples in a cycle."""


@dataclass(frozen=True)
class Repeats:
    """A rough period and the section of the record that repeats with it."""

    period: float
    start: float
    end: float


def repeats(time: Array, displacement: Array) -> Repeats | None:
    """The shortest period with which a section of the record repeats, or None.

    Parameters
    ----------
    time : (n,) strictly increasing [s]
    displacement : (n,)

    Returns
    -------
    period and section, good to about a tenth of a sample
    """
    first, last = moving(displacement)
    if last - first < 2 * LEAST_POINTS:
        return None
    step = max(usual_step(time), float(time[-1] - time[0]) / MOST_SAMPLES)
    grid = np.arange(time[0], time[-1] + 0.5 * step, step)
    x = np.interp(grid, time, displacement)
    least = LEAST_SHARE * float(time[last] - time[first]) / step
    smooth = low_pass(x, HIGHEST)
    # Few cycles drown between ramps as long, most of all to one side, whose mean goes up and down: look inside as well.
    outer = int(RAMPS * (last - first) * usual_step(time) / step)
    inner = x[int((time[first] - time[0]) / step) + outer : int((time[last] - time[0]) / step) - outer]
    for candidate in chain.from_iterable(_candidates(part) for part in (x, inner)):
        lag, section = candidate, _section(x, smooth, candidate, least)
        if section is not None:
            # Ramps pull the lag of the whole record aside: look again at the section alone.
            lag = _nearby(x[section[0] : int(section[1])], candidate)
            section = _section(x, smooth, lag, least) or section
            return Repeats(lag * step, float(grid[0]) + section[0] * step, float(grid[0]) + section[1] * step)
    return None


def moving(displacement: Array) -> tuple[int, int]:
    """First and last index of the motion: the rest before and after it is left out."""
    few = max(displacement.size // 1000, 1)
    threshold = MOVED * np.ptp(displacement)
    left = np.flatnonzero(np.abs(displacement - np.median(displacement[:few])) > threshold)
    right = np.flatnonzero(np.abs(displacement - np.median(displacement[-few:])) > threshold)
    if left.size == 0 or right.size == 0 or left[0] >= right[-1]:
        return 0, displacement.size - 1
    first, last = int(left[0]), int(right[-1])
    return first, last


def mismatch(x: Array) -> Array:
    """Mismatch of the record with itself at every lag up to half its length, 0 where it repeats.

    Equation: d(L) = var(x(t + L) - x(t)) / (var x(t) + var x(t + L)) over the overlap
              Source: de Cheveigne and Kawahara 2002 (YIN), with the mean of the difference taken off
    """
    x = x - x.mean()
    lags = np.arange(x.size // 2 + 1)
    overlap = x.size - lags
    size = 1 << int(np.ceil(np.log2(2 * x.size)))
    spectrum = np.fft.rfft(x, size)
    products = np.fft.irfft(np.abs(spectrum) ** 2, size)[lags] / overlap
    sums, squares = np.concatenate(([0.0], np.cumsum(x))), np.concatenate(([0.0], np.cumsum(x * x)))
    early, late = sums[overlap] / overlap, (sums[-1] - sums[lags]) / overlap
    variance = squares[overlap] / overlap - early**2 + (squares[-1] - squares[lags]) / overlap - late**2
    result: Array = 1.0 - 2.0 * (products - early * late) / np.maximum(variance, np.finfo(float).tiny)
    return result


def _candidates(x: Array) -> list[float]:
    """Lags [samples] at which the mismatch dips, the shortest first."""
    d = mismatch(x)
    below = d < CANDIDATE
    edges = np.flatnonzero(np.diff(below.astype(np.int8)))
    starts = [int(e) + 1 for e in edges if not below[e]]
    lags: list[float] = []
    for start in starts[:MOST_CANDIDATES]:
        after = np.flatnonzero(~below[start:])
        stop = start + int(after[0]) if after.size else d.size
        lowest = start + int(np.argmin(d[start:stop]))
        if lowest >= LEAST_POINTS:
            lags.append(_vertex(d, lowest))
    return lags


def _nearby(x: Array, lag: float) -> float:
    """The lag near the given one at which the mismatch is least."""
    d = mismatch(x)
    around = np.arange(max(int(lag) - 3, 1), min(int(lag) + 5, d.size))
    return _vertex(d, int(around[np.argmin(d[around])])) if around.size else lag


def _vertex(d: Array, lowest: int) -> float:
    """Lag of the lowest point of the parabola through three points."""
    if lowest == 0 or lowest == d.size - 1:
        return float(lowest)
    left, middle, right = d[lowest - 1 : lowest + 2]
    bend = left - 2.0 * middle + right
    return lowest + float(np.clip(0.5 * (left - right) / bend, -0.5, 0.5)) if bend > 0.0 else float(lowest)


def _section(x: Array, smooth: Array, lag: float, least: float) -> tuple[int, float] | None:
    """First sample and end [samples] of the longest section that repeats at this lag, None if below `least`."""
    window = max(int(0.98 * lag) - 1, 3)
    error, scale = _local(x, lag, window)
    error_v, scale_v = _local(np.gradient(smooth), lag, window)
    if error.size == 0:
        return None
    size = float(np.median(scale[scale > 0.25 * scale.max()]))
    size_v = float(np.median(scale_v[scale_v > 0.25 * scale_v.max()]))
    allowed = min(REPEATS, max(SAME, SCATTER * float(np.median(error[scale > 0.5 * size])) / size))
    good = (error <= allowed * size) & (error_v <= SPEED_REPEATS * size_v) & (scale > 0.5 * size)
    first, length = _longest(good)
    end = first + length - 1 + 2.0 * lag
    if length == 0 or end - first < least:
        return None
    return first, min(end, float(x.size))


def _local(x: Array, lag: float, window: int) -> tuple[Array, Array]:
    """Variance of the difference to one lag later, and of the record (both cycles), over a sliding window."""
    count = int(np.floor(x.size - 1 - lag)) + 1
    if count < window:
        return np.empty(0), np.empty(0)
    later = np.interp(np.arange(count) + lag, np.arange(x.size), x)
    return _variance(later - x[:count], window), _variance(x[:count], window) + _variance(later, window)


def _variance(x: Array, window: int) -> Array:
    x = x - x.mean()
    sums, squares = np.concatenate(([0.0], np.cumsum(x))), np.concatenate(([0.0], np.cumsum(x * x)))
    mean = (sums[window:] - sums[:-window]) / window
    result: Array = np.maximum((squares[window:] - squares[:-window]) / window - mean**2, 0.0)
    return result


def _longest(good: NDArray[np.bool_]) -> tuple[int, int]:
    """First index and length of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], good.astype(np.int8), [0]))))
    if edges.size == 0:
        return 0, 0
    lengths = edges[1::2] - edges[::2]
    longest = int(np.argmax(lengths))
    return int(edges[2 * longest]), int(lengths[longest])
