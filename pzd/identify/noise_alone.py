"""Whether the data determine a parameter at all: how well, were the residuals nothing but noise of their own colour.

The residuals of a rig record are correlated, so the textbook covariance is far too small. An
autoregression fitted to the residuals of each record gives their covariance Omega, and with it
the covariance of the ordinary least-squares estimate that the criterion asks for. What is shown as
an interval allows for more: see intervals.py.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pzd.record import Array
from pzd.signals.autoregression import Autoregression, autoregression
from pzd.signals.recursion import all_pole

LARGEST_ORDER = 30
"""Largest order of the autoregression; the one used is chosen by BIC."""


@dataclass(frozen=True)
class Uncertainty:
    """How well the data pin the parameters down."""

    covariance: Array
    """(p, p) covariance of the estimates, correlation of the residuals allowed for."""
    degrees_of_freedom: float
    """Independent residuals less parameters, for Student's t."""

    def half_widths(self, level: float = 0.95) -> Array:
        """(p,) half widths of the two-sided intervals."""
        from scipy.special import stdtrit

        quantile = float(stdtrit(max(self.degrees_of_freedom, 1.0), 0.5 + 0.5 * level))
        return quantile * np.sqrt(np.diag(self.covariance))


def uncertainty(slopes: Array, residuals: Array, lengths: Sequence[int]) -> Uncertainty:
    """Covariance of a least-squares estimate whose residuals are correlated within each record.

    Equation: cov = (J'J)^-1 J' Omega J (J'J)^-1,  Omega = s2 A^-1 A^-T      Source: Box and Jenkins 1976, ch. 7

    Parameters
    ----------
    slopes : (N, p) J, derivatives of the model by the parameters
    residuals : (N,) measured less model
    lengths : samples of each record, in order; their sum is N

    Returns
    -------
    covariance with the small-sample factor N / (N - p), and degrees of freedom
    """
    size = np.linalg.norm(slopes, axis=0)
    unseen = size == 0.0
    size[unseen] = 1.0
    scaled = slopes / size
    bread = np.linalg.pinv(scaled.T @ scaled, rcond=1e-14, hermitian=True)
    meat = np.zeros((slopes.shape[1],) * 2)
    independent, start = 0.0, 0
    for length in lengths:
        part = slice(start, start + length)
        noise = autoregression([residuals[part]], LARGEST_ORDER)
        filtered = all_pole(noise.whitening_filter, scaled[part][::-1])
        meat += noise.innovation * filtered.T @ filtered
        independent += length * _independent_share(noise)
        start += length
    small_sample = start / max(start - slopes.shape[1], 1)
    covariance = small_sample * bread @ meat @ bread / np.outer(size, size)
    covariance[unseen, unseen] = np.inf
    return Uncertainty(covariance, independent - slopes.shape[1])


def _independent_share(noise: Autoregression) -> float:
    """Share of the samples that count as independent for the variance.

    Equation: (mean of P)^2 / mean of P^2, P the noise spectrum      Source: Bartlett 1946
    """
    spectrum = 1.0 / np.abs(np.fft.rfft(noise.whitening_filter, 4096)) ** 2
    return float(np.mean(spectrum) ** 2 / np.mean(spectrum**2))
