"""Coloured noise as a short autoregressive model: its spectrum, its variance, and whitening by it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ORDER_MAX = 12
"""Longest model that is tried."""
FLOOR = 1e-12
"""Innovation variance is never below this share of the variance: rounding is no noise model."""


@dataclass(frozen=True, eq=False)
class Autoregression:
    """Noise e_i = sum_j a_j e_(i-j) + w_i with white w."""

    coefficients: Array
    """(p,) a_1 ... a_p; empty for white noise."""
    innovation: float
    """Variance of w, in the square of the noise's unit."""

    def whitened(self, series: Array) -> Array:
        """The series (n,) or (n, m) without its colour, scaled to unit variance; the first p rows dropped.

        Equation: w_i = (e_i - sum_j a_j e_(i-j)) / sigma_w      Source: Box and Jenkins 1970, ch. 3
        """
        p = self.coefficients.size
        out = np.array(series[p:], dtype=np.float64)
        for j, a in enumerate(self.coefficients, start=1):
            out -= a * series[p - j : len(series) - j]
        return out / np.sqrt(self.innovation) if self.innovation > 0.0 else out

    def density(self, share_of_rate: Array) -> Array:
        """Variance density at frequencies given as a share of the sampling rate.

        Equation: S = sigma_w^2 / |1 - sum_j a_j exp(-2 pi i f j)|^2      Source: Box and Jenkins 1970, eq. (3.2.5)
        """
        j = np.arange(1, self.coefficients.size + 1)
        response = 1.0 - np.exp(-2j * np.pi * np.outer(share_of_rate, j)) @ self.coefficients
        density: Array = self.innovation / np.abs(response) ** 2
        return density

    @property
    def variance(self) -> float:
        """Variance of the noise itself: the density summed over all frequencies."""
        return float(np.mean(self.density((np.arange(4096) + 0.5) / 4096)))


def autoregression(series: Sequence[Array], order_max: int = ORDER_MAX) -> Autoregression:
    """The short model that describes stretches of noise best, its order by the Bayesian criterion.

    Equation: BIC = n ln sigma_p^2 + p ln n, sigma_p^2 by Levinson's recursion      Source: Schwarz 1978

    Parameters
    ----------
    series : stretches (n_i,) of one noise, zero mean
    order_max : longest model tried
    """
    count = sum(stretch.size for stretch in series)
    order_max = min(order_max, max(count // 20, 0), min(stretch.size for stretch in series) - 1)
    covariance = np.array(
        [sum(float(s[lag:] @ s[: s.size - lag]) for s in series) / count for lag in range(order_max + 1)]
    )
    if covariance[0] <= 0.0:
        return Autoregression(np.zeros(0), 0.0)
    best, best_bic = Autoregression(np.zeros(0), covariance[0]), count * np.log(covariance[0])
    a, variance = np.zeros(0), float(covariance[0])
    for p in range(1, order_max + 1):
        reflection = (covariance[p] - a @ covariance[p - 1 : 0 : -1]) / variance
        a = np.append(a - reflection * a[::-1], reflection)
        variance *= 1.0 - reflection**2
        if variance <= FLOOR * covariance[0]:
            break
        bic = count * np.log(variance) + p * np.log(count)
        if bic < best_bic:
            best, best_bic = Autoregression(a.copy(), variance), bic
    return best
