"""The noise of a record, apart from any model: what differs between cycles that ought to be equal.

Adjacent cycles of a periodic test differ by noise alone, whatever the model misses: slow drift
cancels, repeatable misfit cancels. The noise is described by a short autoregressive model, and
at each harmonic of the test by the scatter of the differences themselves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pzd.record import Array, Complex
from pzd.signals.autoregression import Autoregression, autoregression

BAND_LIMIT = 0.4
"""Harmonics are judged up to this share of the sampling rate."""
LOCAL = 16
"""Fewest harmonics over which the local level of the noise is averaged."""
COLOUR = 5.0
"""Noise counts as at least so coloured (density at its peak over variance): a short record hides colour."""


@dataclass(frozen=True, eq=False)
class PureError:
    """The harmonics of the average cycle, and how uncertain noise alone makes them."""

    count: int
    """Number of cycles."""
    points: int
    """Samples in a cycle."""
    mean: Complex
    """(H + 1,) Fourier coefficient of the average cycle at harmonics 0 ... H [N]; the cycle is
    mean_0 + 2 Re sum_h mean_h exp(i h phase)."""
    single: Array
    """(H + 1,) variance |.|^2 of the coefficient of one cycle by noise [N^2]."""
    freedom: Array
    """(H + 1,) degrees of freedom of that variance."""
    noise: Autoregression
    """The noise of one sample."""
    sample_variance: float
    """Variance of one sample by noise [N^2]."""
    shared: Array | float = 0.0
    """(H + 1,) variance of the coefficient by what all cycles share, and more of them would not shrink [N^2]."""

    @property
    def of_mean(self) -> Array:
        """(H + 1,) variance of the coefficient of the average cycle [N^2]."""
        return self.single / self.count + self.shared


def harmonics_of(points: int) -> int:
    """Number H of harmonics up to the band limit of a cycle of that many samples."""
    return max(int(BAND_LIMIT * points), 1)


def pure_error(folded: Array) -> PureError:
    """Noise of a periodic residual from the differences between adjacent cycles.

    Equation: s_h^2 = mean_j |c_(j+1,h) - c_(j,h)|^2 / 2, averaged over neighbouring harmonics
    after division by the autoregressive shape                      Source: von Neumann 1941

    Parameters
    ----------
    folded : (cycles, points) residual, one row a cycle, at least two rows [N]
    """
    count, points = folded.shape
    differences = np.diff(folded, axis=0)
    noise = autoregression([(differences - differences.mean()).ravel() / np.sqrt(2.0)])
    last = harmonics_of(points)
    coefficients = np.fft.rfft(folded, axis=1)[:, : last + 1] / points
    steps = np.diff(coefficients, axis=0)
    shape = noise.density(np.arange(last + 1) / points) / points
    shape = np.where(shape > 0.0, shape, 1.0)
    own = np.mean(np.abs(steps) ** 2, axis=0) / 2.0 / shape
    low, high = neighbours(last)
    total = np.concatenate([[0.0], np.cumsum(own)])
    local = (total[high + 1] - total[low]) / (high + 1 - low)
    freedom = _with_shape(
        np.asarray(_freedom(count) * (high + 1 - low), dtype=np.float64), shape * points, noise, differences.size
    )
    return PureError(
        count,
        points,
        coefficients.mean(axis=0),
        local * shape,
        freedom,
        noise,
        float(np.mean(differences**2) / 2.0),
    )


def neighbours(last: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First and last harmonic, from 1 on, whose scatter describes the noise at each harmonic from 0 to the last.

    Those within a third of its number, and at least `LOCAL` of them where there are so many.
    """
    h = np.arange(last + 1)
    reach = np.maximum(h // 3, LOCAL // 2)
    low = np.clip(h - reach, 1, max(last - LOCAL + 1, 1))
    high = np.clip(np.maximum(h + reach, low + LOCAL - 1), 1, last)
    return low, high


def _freedom(count: int) -> float:
    """Degrees of freedom of the variance of a complex coefficient from adjacent differences of `count` cycles.

    Equation: nu = 4 (n - 1)^2 / (3 n - 4)                          Source: von Neumann 1941
    """
    return 4.0 * (count - 1) ** 2 / (3.0 * count - 4.0)


def _with_shape(freedom: Array, density: Array, noise: Autoregression, samples: int) -> Array:
    """Degrees of freedom that also allow for the uncertain shape: few independent samples, little is known.

    Equation: 2 / nu = 2 / nu_local + (4 / n_eff) S_h / S_max, n_eff = n var / S_max; S_max at least `COLOUR` var
                                        Source: delta method on S(0) = sigma_w^2 / (1 - a)^2, var a = (1 - a^2) / n
    """
    largest = float(density.max())
    if noise.variance <= 0.0 or largest <= 0.0:
        return freedom
    independent = samples / max(largest / noise.variance, COLOUR)
    total: Array = 2.0 / (2.0 / freedom + 4.0 / independent * density / largest)
    return total


def repeatable_power(error: PureError) -> Array:
    """Power of the repeatable part of the residual at each harmonic, the noise's share taken off.

    Equation: P_0 = c_0^2 - s_0^2,  P_h = 2 (|c_h|^2 - s_h^2)       Source: Parseval

    What all cycles share by the noise of the displacement takes off at most what is there, at each harmonic.

    Returns
    -------
    (H + 1,) mean square [N^2], unbiased, so that noise alone gives values around zero
    """
    weights = np.where(np.arange(error.mean.size) == 0, 1.0, 2.0)
    repeats = np.abs(error.mean) ** 2 - error.single / error.count
    power: Array = weights * (repeats - np.minimum(error.shared, np.maximum(repeats, 0.0)))
    return power
