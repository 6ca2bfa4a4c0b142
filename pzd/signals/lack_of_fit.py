"""Whether a residual repeats more than noise lets it: tests by harmonics, by trend, and pooled over tests."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.record import Array
from pzd.signals.between_cycles import PureError, harmonics_of, pure_error

TREND_CYCLES = 4
"""Fewest cycles on which a trend is judged."""
TREND_HARMONICS = 15
"""Harmonics on which a trend is judged."""
FEWEST = 100
"""Fewest differences between cycles that tell the colour of noise; with fewer nothing is judged."""


def bands(last: int) -> list[tuple[int, int]]:
    """Octaves of harmonics (first, last): 0, 1, 2-3, 4-7, ... up to `last`."""
    edges = [0] + [2**i for i in range(int(np.log2(max(last, 1))) + 1)]
    return [(low, min(high - 1, last)) for low, high in zip(edges, [*edges[1:], last + 1], strict=True)]


def by_harmonics(error: PureError) -> Array:
    """Probability, a band of harmonics, that noise alone makes the average cycle so large.

    Equation: F = mean_h |c_h|^2 / s_h^2 over the band, against F(2 n, nu)      Source: Fisher's variance ratio

    Returns
    -------
    (bands,) probabilities, uniform where nothing is missing; those below 1e-5 are too small where the noise is
    correlated over a tenth of a cycle, for its ends do not meet and leak into all high harmonics at once
    """
    from scipy.special import fdtrc

    ratio = np.abs(error.mean) ** 2 / np.where(error.of_mean > 0.0, error.of_mean, np.inf)
    octaves = bands(error.mean.size - 1)
    if (error.count - 1) * error.points < FEWEST:
        return np.ones(len(octaves))
    found = []
    for low, high in octaves:
        freedom = 1 if low == 0 else 2 * (high + 1 - low)
        found.append(float(fdtrc(freedom, error.freedom[low : high + 1].max(), ratio[low : high + 1].mean())))
    return np.array(found)


def by_trend(folded: Array) -> float | None:
    """Probability that noise alone makes the residual change so steadily from cycle to cycle.

    Equation: b_h = sum_j (j - j0) c_jh / sum_j (j - j0)^2, F = mean_h |b_h|^2 / var b_h
                                                                    Source: least squares

    Parameters
    ----------
    folded : (cycles, points) residual [N]

    Returns
    -------
    the probability, None with fewer than four cycles
    """
    from scipy.special import fdtrc

    count, points = folded.shape
    if count < TREND_CYCLES:
        return None
    error = pure_error(folded)
    last = min(TREND_HARMONICS, harmonics_of(points))
    coefficients = np.fft.rfft(folded, axis=1)[:, 1 : last + 1] / points
    order = np.arange(count) - (count - 1) / 2.0
    slopes = order @ coefficients / (order @ order)
    scatter = error.single[1 : last + 1] / (order @ order)
    ratio = np.abs(slopes) ** 2 / np.where(scatter > 0.0, scatter, np.inf)
    return float(fdtrc(2 * last, error.freedom[1 : last + 1].max(), ratio.mean()))


def pooled(by_record: Sequence[Array]) -> float:
    """Probability that noise alone makes all tests together look so, however many looks were taken.

    The smallest of all probabilities finds what one test shows plainly, Fisher's sum a band what
    all tests show a little; Bonferroni pays for every look, so that the rate of false alarms is at
    most what it says.

    Equation: p = 2 min(R B min p, B min_b P(chi2_2R > -2 sum_r ln p_rb))       Source: Fisher 1932; Bonferroni

    Parameters
    ----------
    by_record : one array of probabilities a test, of differing length
    """
    from scipy.special import chdtrc

    if not by_record:
        return 1.0
    everything = np.maximum(np.concatenate(by_record), 1e-300)
    single = everything.size * float(everything.min())
    longest = max(p.size for p in by_record)
    sums = []
    for band in range(longest):
        logs = [np.log(max(float(p[band]), 1e-300)) for p in by_record if p.size > band]
        sums.append(float(chdtrc(2 * len(logs), -2.0 * sum(logs))))
    return min(1.0, 2.0 * min(single, longest * min(sums)))
