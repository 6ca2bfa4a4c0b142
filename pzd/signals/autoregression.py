"""Coloured noise as a short autoregressive model: its spectrum, its variance, and whitening by it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pzd.record import Array

ORDER_MAX = 12
"""Longest model tried unless said otherwise: two poles each for sensor, amplifier and mains, and as many to spare."""
SAMPLES_PER_ORDER = 20
"""At least this many samples stand behind each coefficient: its standard error is then below 0.25."""
WITH_PREDECESSORS = 0.5
"""At least this share of the samples has as many predecessors in its stretch as the model has coefficients.

Reason: the others say nothing of the last coefficients; not tuned."""
FLOOR = 1e-12
"""Innovation variance is never below this share of the variance: rounding is no noise model."""

MORE_WITH_WHITE = 4
"""Coefficients more that coloured noise takes together with white noise. Their sum is no autoregression of any length:
one of the same length would be too quiet at low frequencies, where a gap is sought, by 28 % where each
sample correlates with the one before by 0.9; with four more it is within 1 %."""
GRID = 4096
"""Frequencies over which a density is summed: enough for poles within 1e-3 of the unit circle."""


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
    def whitening_filter(self) -> Array:
        """(p + 1,) coefficients 1, -a_1, ... -a_p of the filter that gives w from e."""
        return np.concatenate([np.ones(1), -self.coefficients])

    @cached_property
    def variance(self) -> float:
        """Variance of the noise itself: the density summed over all frequencies."""
        return float(np.mean(self._density_on_grid))

    @cached_property
    def _density_on_grid(self) -> Array:
        """(GRID,) density in the middle of `GRID` bands of equal width, by a transform of the whitening filter."""
        taps = self.whitening_filter
        response = np.fft.fft(taps * np.exp(-1j * np.pi * np.arange(taps.size) / GRID), GRID)
        return np.asarray(self.innovation / np.abs(response) ** 2)

    def with_white(self, share: float) -> Autoregression:
        """The noise together with white noise of a share of its variance, by a model of a few coefficients more.

        Equation: R a = r, sigma_w^2 = r_0 - a r, r_0 (1 + share) in place of r_0      Source: Yule 1927, Walker 1931
        """
        from scipy.linalg import solve_toeplitz

        if self.coefficients.size == 0 or self.innovation <= 0.0:
            return self
        shares = (np.arange(GRID) + 0.5) / GRID
        lags = np.arange(self.coefficients.size + MORE_WITH_WHITE + 1)
        r = np.cos(2.0 * np.pi * np.outer(lags, shares)) @ self._density_on_grid / GRID
        r[0] *= 1.0 + share
        a = solve_toeplitz(r[:-1], r[1:])
        return Autoregression(a, float(r[0] - a @ r[1:]))


def autoregression(series: Sequence[Array], order_max: int = ORDER_MAX) -> Autoregression:
    """The short model that describes stretches of noise best, its order by the Bayesian criterion.

    Equation: minimise the forward and backward prediction errors together       Source: Burg 1975
    Equation: BIC = n ln sigma_p^2 + p ln n                                      Source: Schwarz 1978

    Parameters
    ----------
    series : stretches (n_i,) of one noise, zero mean
    order_max : longest model tried

    Returns
    -------
    the model; white noise of variance 0 where the stretches are zero
    """
    sizes = np.array([stretch.size for stretch in series])
    count = int(sizes.sum())
    order_max = min(order_max, count // SAMPLES_PER_ORDER)
    while order_max > 0 and np.maximum(sizes - order_max, 0).sum() < WITH_PREDECESSORS * count:
        order_max -= 1
    variance = whole = sum(float(stretch @ stretch) for stretch in series) / max(count, 1)
    a = np.zeros(0)
    best = Autoregression(a, variance)
    if variance <= 0.0:
        return best
    best_bic = count * np.log(variance)
    errors = [(stretch[1:].copy(), stretch[:-1].copy()) for stretch in series]
    for order in range(1, order_max + 1):
        total = sum(float(forward @ forward + backward @ backward) for forward, backward in errors)
        if total <= 0.0:
            break
        reflection = 2.0 * sum(float(forward @ backward) for forward, backward in errors) / total
        a = np.append(a - reflection * a[::-1], reflection)
        variance *= 1.0 - reflection**2
        if variance <= FLOOR * whole:
            break
        errors = [((f - reflection * b)[1:], (b - reflection * f)[:-1]) for f, b in errors]
        bic = count * np.log(variance) + order * np.log(count)
        if bic < best_bic:
            best, best_bic = Autoregression(a.copy(), variance), bic
    return best
