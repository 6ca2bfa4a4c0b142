"""Search for the period of a test, from the mismatch of the displacement with itself one lag later.

No shape is assumed: the mismatch, drift taken off, is near zero at the period. The speed has to repeat as well: quick
motion on a slow wave is small in the displacement and large in the speed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from pzd.record import Array
from pzd.signals.measures import resolution, usual_step
from pzd.signals.smoothing import HIGHEST, cut_above, low_pass, motion_below, resolved_below, without_steps
from pzd.signals.splines import is_even

MOST_SAMPLES = 2**18
"""Most samples in the search; longer records are thinned. An FFT of so many takes a few hundredths of a second."""
CANDIDATE_MISMATCH = 0.3
"""Largest mismatch of a candidate lag, as a share of the variance: ramps raise it far above that of the cycles."""
LARGEST_MISMATCH = 0.02
"""Largest mismatch of two adjacent cycles that repeat, as a share of the variance: 14 % in r.m.s."""
NEGLIGIBLE_MISMATCH = 2e-5
"""Mismatch that always counts as repeating, as a share of the variance: 0.4 % in r.m.s."""
MISMATCH_SCATTER = 4.0
"""Otherwise a mismatch up to this many times the median of the motion counts as repeating."""
LARGEST_SPEED_MISMATCH = 0.05
"""Largest mismatch of the speed, which carries more noise than the displacement."""
LEAST_SHARE = 0.25
"""Least share of the motion that repeating cycles cover; a shorter repetition is chance."""
MOVED = 0.05
"""The motion begins where the displacement has left its first value by this share of the range."""
RAMPS = 0.15
"""Share of the motion left out at either end where the whole shows no period."""
MOST_CANDIDATES = 40
"""Most candidate lags, the shortest first: each costs a pass over the record."""
LEAST_POINTS = 4
"""Fewest samples in a cycle."""


@dataclass(frozen=True)
class PeriodicSection:
    """A rough period and the section of the record that repeats with it."""

    period: float
    """[s]"""
    start: float
    """[s]"""
    end: float
    """[s]"""


def periodic_section(time: Array, displacement: Array) -> PeriodicSection | None:
    """Find the shortest period with which a section of the record repeats.

    Parameters
    ----------
    time : (n,) strictly increasing [s]
    displacement : (n,)

    Returns
    -------
    period and section, good to about a tenth of a sample; None where nothing repeats
    """
    first, last = moving_range(displacement)
    if last - first < 2 * LEAST_POINTS:
        return None
    step = max(usual_step(time), float(time[-1] - time[0]) / MOST_SAMPLES)
    if time.size <= MOST_SAMPLES and is_even(time):
        grid, x = time, displacement
    else:
        grid = np.arange(time[0], time[-1] + 0.5 * step, step)
        x = np.interp(grid, time, displacement)
    least = LEAST_SHARE * float(time[last] - time[first]) / step
    # Few cycles drown between ramps as long, most of all to one side, whose mean goes up and down: look inside as well.
    outer = int(RAMPS * (last - first) * usual_step(time) / step)
    inner = x[int((time[first] - time[0]) / step) + outer : int((time[last] - time[0]) / step) - outer]
    for smooth in _smoothed(x, resolution(displacement)):
        for candidate in chain.from_iterable(_candidate_lags(part) for part in (x, inner)):
            lag, section = candidate, _section(x, smooth, candidate, least)
            if section is not None:
                # Ramps pull the lag of the whole record aside: look again at the section alone.
                lag = _refined_lag(x[section[0] : int(section[1])], candidate)
                section = _section(x, smooth, lag, least) or section
                begin, end = (float(grid[0]) + place * step for place in section)
                return PeriodicSection(lag * step, begin, end)
    return None


def _smoothed(x: Array, step: float) -> Iterator[Array]:
    """Yield a motion (n,) as its speed is asked of: the speed of a step is no motion.

    Nor is that of noise, which at a high rate exceeds any of the rod: where so nothing repeats, without it.
    """
    yield low_pass(without_steps(x, step), HIGHEST)
    yield cut_above(x, min(motion_below(x), resolved_below(x, step)))[0]


def moving_range(displacement: Array) -> tuple[int, int]:
    """Return the first and last index of the motion, without the rest before and after it."""
    few = max(displacement.size // 1000, 1)
    threshold = MOVED * np.ptp(displacement)
    left = np.flatnonzero(np.abs(displacement - np.median(displacement[:few])) > threshold)
    right = np.flatnonzero(np.abs(displacement - np.median(displacement[-few:])) > threshold)
    if left.size == 0 or right.size == 0 or left[0] >= right[-1]:
        return 0, displacement.size - 1
    return int(left[0]), int(right[-1])


def mismatch(x: Array) -> Array:
    """Compute the mismatch of a record with itself at every lag up to half its length; 0 where it repeats.

    Equation: d(L) = var(x(t + L) - x(t)) / (var x(t) + var x(t + L)) over the overlap
              Source: de Cheveigne and Kawahara 2002 (YIN), with the mean of the difference taken off
    """
    from scipy.fft import irfft, next_fast_len, rfft

    x = x - x.mean()
    lags = np.arange(x.size // 2 + 1)
    overlap = x.size - lags
    size = next_fast_len(x.size + lags.size, real=True)  # what is wrapped round comes at longer lags
    spectrum = rfft(x, size)
    products = irfft(np.abs(spectrum) ** 2, size)[lags] / overlap
    sums, squares = np.concatenate(([0.0], np.cumsum(x))), np.concatenate(([0.0], np.cumsum(x * x)))
    early, late = sums[overlap] / overlap, (sums[-1] - sums[lags]) / overlap
    variance = squares[overlap] / overlap - early**2 + (squares[-1] - squares[lags]) / overlap - late**2
    return np.asarray(1.0 - 2.0 * (products - early * late) / np.maximum(variance, np.finfo(float).tiny))


def _candidate_lags(x: Array) -> list[float]:
    """Find the lags [samples] at which the mismatch has a minimum, the shortest first."""
    d = mismatch(x)
    below = d < CANDIDATE_MISMATCH
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


def _refined_lag(x: Array, lag: float) -> float:
    """Return the lag near the given one at which the mismatch is least."""
    d = mismatch(x)
    around = np.arange(max(int(lag) - 3, 1), min(int(lag) + 5, d.size))
    return _vertex(d, int(around[np.argmin(d[around])])) if around.size else lag


def _vertex(d: Array, lowest: int) -> float:
    """Lag of the vertex of the parabola through three points."""
    if lowest == 0 or lowest == d.size - 1:
        return float(lowest)
    left, middle, right = d[lowest - 1 : lowest + 2]
    bend = left - 2.0 * middle + right
    return lowest + float(np.clip(0.5 * (left - right) / bend, -0.5, 0.5)) if bend > 0.0 else float(lowest)


def _section(x: Array, smooth: Array, lag: float, least: float) -> tuple[int, float] | None:
    """Return start and end [samples] of the longest section that repeats at a lag, None if shorter than `least`."""
    window = max(int(0.98 * lag) - 1, 3)
    error, scale = _sliding_variances(x, lag, window)
    error_v, scale_v = _sliding_variances(np.gradient(smooth), lag, window)
    if error.size == 0:
        return None
    size = float(np.median(scale[scale > 0.25 * scale.max()]))
    size_v = float(np.median(scale_v[scale_v > 0.25 * scale_v.max()]))
    usual = float(np.median(error[scale > 0.5 * size]))
    allowed = min(LARGEST_MISMATCH, max(NEGLIGIBLE_MISMATCH, MISMATCH_SCATTER * usual / size))
    good = (error <= allowed * size) & (error_v <= LARGEST_SPEED_MISMATCH * size_v) & (scale > 0.5 * size)
    first, length = _longest_run(good)
    end = first + length - 1 + 2.0 * lag
    if length == 0 or end - first < least:
        return None
    return first, min(end, float(x.size))


def _sliding_variances(x: Array, lag: float, window: int) -> tuple[Array, Array]:
    """Return the variance of the difference to one lag later, and of both cycles, over a sliding window."""
    count = int(np.floor(x.size - 1 - lag)) + 1
    if count < window:
        return np.empty(0), np.empty(0)
    later = np.interp(np.arange(count) + lag, np.arange(x.size), x)
    both_cycles = _sliding_variance(x[:count], window) + _sliding_variance(later, window)
    return _sliding_variance(later - x[:count], window), both_cycles


def _sliding_variance(x: Array, window: int) -> Array:
    x = x - x.mean()
    sums, squares = np.concatenate(([0.0], np.cumsum(x))), np.concatenate(([0.0], np.cumsum(x * x)))
    mean = (sums[window:] - sums[:-window]) / window
    return np.asarray(np.maximum((squares[window:] - squares[:-window]) / window - mean**2, 0.0))


def _longest_run(good: NDArray[np.bool_]) -> tuple[int, int]:
    """Return first index and length of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], good.astype(np.int8), [0]))))
    if edges.size == 0:
        return 0, 0
    lengths = edges[1::2] - edges[::2]
    longest = int(np.argmax(lengths))
    return int(edges[2 * longest]), int(lengths[longest])
