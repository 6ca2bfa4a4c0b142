"""Noise of a record: linear recursions, autoregressive models, and pure error between cycles that ought to be equal.

Adjacent cycles of a periodic test differ by noise alone, whatever a model misses: slow drift cancels, repeatable misfit
cancels. Their differences give the noise as a short autoregressive model, and its variance at each harmonic.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pzd.compiled import compiled
from pzd.record import Array, Complex

if TYPE_CHECKING:
    from scipy.sparse import csr_array

# --- Linear recursions: noise of first order, the warming of a lump, filters of any order ---

_NEGLIGIBLE_SHARE = 1e-18
"""Share of an input below which a recursion has forgotten it: far below rounding."""


def recursion(memory: float, inputs: Array) -> Array:
    """Filter inputs by a first-order recursion.

    Equation: y_i = m y_(i-1) + u_i, y_(-1) = 0, that is (1 + m B)(1 + m^2 B^2)(1 + m^4 B^4) ... u
              Source: geometric series of the backward shift B, by doubling

    Parameters
    ----------
    memory : m, from 0 to 1
    inputs : (n,) u

    Returns
    -------
    (n,) y

    Examples
    --------
    >>> recursion(0.5, np.array([1.0, 0.0, 0.0])).tolist()
    [1.0, 0.5, 0.25]
    """
    values = np.array(inputs, dtype=np.float64)
    shift, share = 1, memory
    while shift < values.size and share > _NEGLIGIBLE_SHARE:
        values[shift:] += share * values[:-shift]
        shift, share = 2 * shift, share * share
    return values


def all_pole(coefficients: Array, inputs: Array) -> Array:
    """Filter inputs by a recursion of any order, column by column.

    Equation: y_i = u_i - a_1 y_(i-1) - a_2 y_(i-2) - ..., at rest before the first

    Parameters
    ----------
    coefficients : (order + 1,) 1, a_1, a_2, ...
    inputs : (n, m) u

    Returns
    -------
    (n, m) y
    """
    values = np.array(inputs, dtype=np.float64, order="C")
    _recur(coefficients, values)
    return values


@compiled
def _recur(coefficients: Array, values: Array) -> None:
    for i in range(values.shape[0]):
        for j in range(1, min(coefficients.size, i + 1)):
            for n in range(values.shape[1]):
                values[i, n] -= coefficients[j] * values[i - j, n]


# --- Coloured noise as a short autoregressive model ---

ORDER_MAX = 12
"""Default largest order: two poles each for sensor, amplifier and mains, and as many to spare."""
SAMPLES_PER_ORDER = 20
"""Fewest samples a coefficient: its standard error is then below 0.25."""
WITH_PREDECESSORS = 0.5
"""Least share of the samples with as many predecessors in their stretch as the model has coefficients.

Reason: the others hold no information on the last coefficients; not tuned."""
INNOVATION_FLOOR = 1e-12
"""Least innovation variance, as a share of the variance: below it the model would describe rounding."""
MORE_WITH_WHITE = 4
"""Additional coefficients for coloured noise plus white noise. Their sum is no autoregression of finite order: one of
the same order would be too quiet at low frequencies, where a gap is sought, by 28 % for a correlation of 0.9 from
sample to sample; with four more it is within 1 %."""
GRID = 4096
"""Frequencies over which a density is summed: enough for poles within 1e-3 of the unit circle."""


@dataclass(frozen=True, eq=False)
class Autoregression:
    """Autoregressive noise e_i = sum_j a_j e_(i-j) + w_i with white w."""

    coefficients: Array
    """(p,) a_1 ... a_p; empty for white noise."""
    innovation: float
    """Variance of w, in the square of the noise's unit."""

    def whitened(self, series: Array) -> Array:
        """Whiten a series (n,) or (n, m) and scale it to unit variance; the first p rows are dropped.

        Equation: w_i = (e_i - sum_j a_j e_(i-j)) / sigma_w      Source: Box and Jenkins 1970, ch. 3
        """
        p = self.coefficients.size
        out = np.array(series[p:], dtype=np.float64)
        for j, a in enumerate(self.coefficients, start=1):
            out -= a * series[p - j : len(series) - j]
        return out / np.sqrt(self.innovation) if self.innovation > 0.0 else out

    def whitened_samples(self, places: NDArray[np.intp], sizes: Array, samples: int) -> csr_array:
        """Whiten many series of so many samples, each of which is 0 but at one place.

        Parameters
        ----------
        places, sizes : (m,) number of the sample and what it is, by series
        samples : n

        Returns
        -------
        (n - p, m), one column for each as `whitened` gives it
        """
        from scipy.sparse import coo_array

        p, share = self.coefficients.size, 1.0 / np.sqrt(self.innovation) if self.innovation > 0.0 else 1.0
        rows = places[:, np.newaxis] + np.arange(-p, 1)
        values = share * sizes[:, np.newaxis] * self.whitening_filter
        columns = np.broadcast_to(np.arange(places.size)[:, np.newaxis], rows.shape)
        inside = (rows >= 0) & (rows < samples - p)
        return coo_array((values[inside], (rows[inside], columns[inside])), (samples - p, places.size)).tocsr()

    def density(self, share_of_rate: Array) -> Array:
        """Compute the variance density at frequencies given as a share of the sampling rate.

        Equation: S = sigma_w^2 / |1 - sum_j a_j exp(-2 pi i f j)|^2      Source: Box and Jenkins 1970, eq. (3.2.5)
        """
        j = np.arange(1, self.coefficients.size + 1)
        response = 1.0 - np.exp(-2j * np.pi * np.outer(share_of_rate, j)) @ self.coefficients
        return np.asarray(self.innovation / np.abs(response) ** 2)

    def independent(self, samples: int, largest: float | None = None) -> float:
        """Return how many of some samples tell the colour of the noise: those that are independent of each other.

        Equation: n var / S_max, S_max at least 5 var: a short record hides colour

        Parameters
        ----------
        samples : their number
        largest : density S_max; None for that of this noise at any frequency
        """
        if self.variance <= 0.0:
            return float(samples)
        most = float(np.max(self._density_on_grid)) if largest is None else largest
        return samples / max(most / self.variance, LEAST_COLOUR)

    @property
    def whitening_filter(self) -> Array:
        """Coefficients (p + 1,) 1, -a_1, ... -a_p of the filter from e to w."""
        return np.concatenate([np.ones(1), -self.coefficients])

    @cached_property
    def variance(self) -> float:
        """Variance of the noise: the density summed over all frequencies."""
        return float(np.mean(self._density_on_grid))

    @cached_property
    def _density_on_grid(self) -> Array:
        """Density (GRID,) in the middle of bands of equal width, by a transform of the whitening filter."""
        taps = self.whitening_filter
        response = np.fft.fft(taps * np.exp(-1j * np.pi * np.arange(taps.size) / GRID), GRID)
        return np.asarray(self.innovation / np.abs(response) ** 2)

    def with_white(self, share: float) -> Autoregression:
        """Add white noise of a share of the variance, by a model of a few more coefficients.

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
    """Fit an autoregressive model to stretches of noise, its order by the Bayesian criterion.

    Equation: minimise the forward and backward prediction errors together       Source: Burg 1975
    Equation: BIC = n ln sigma_p^2 + p ln n                                      Source: Schwarz 1978

    Parameters
    ----------
    series : stretches (n_i,) of one noise, zero mean
    order_max : largest order

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
        if variance <= INNOVATION_FLOOR * whole:
            break
        errors = [((f - reflection * b)[1:], (b - reflection * f)[:-1]) for f, b in errors]
        bic = count * np.log(variance) + order * np.log(count)
        if bic < best_bic:
            best, best_bic = Autoregression(a.copy(), variance), bic
    return best


# --- Pure error ---

BAND_LIMIT = 0.4
"""Highest frequency of the harmonics judged, as a share of the sampling rate: anti-aliasing filters act above."""
LOCAL_HARMONICS = 16
"""Fewest harmonics over which the local level of the noise is averaged."""
LEAST_COLOUR = 5.0
"""Least colour of noise (peak density over variance): a short record hides colour."""


@dataclass(frozen=True, eq=False)
class PureError:
    """Harmonics of the average cycle, and their variance by noise alone."""

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
    """(H + 1,) variance of the coefficient by errors that all cycles share; more cycles do not reduce it [N^2]."""

    @property
    def of_mean(self) -> Array:
        """Variance (H + 1,) of the coefficient of the average cycle [N^2]."""
        return self.single / self.count + self.shared


def harmonics_of(points: int) -> int:
    """Return the number of harmonics up to the band limit of a cycle of so many samples."""
    return max(int(BAND_LIMIT * points), 1)


def pure_error(folded: Array) -> PureError:
    """Estimate the noise of a periodic residual from the differences between adjacent cycles.

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
    low, high = neighbouring_harmonics(last)
    total = np.concatenate([[0.0], np.cumsum(own)])
    local = (total[high + 1] - total[low]) / (high + 1 - low)
    freedom = _freedom_with_shape(
        np.asarray(_degrees_of_freedom(count) * (high + 1 - low), dtype=np.float64),
        shape * points,
        noise,
        differences.size,
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


def neighbouring_harmonics(last: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return first and last harmonic (from 1 on) whose scatter is averaged for the noise at each harmonic 0 ... last.

    These are the harmonics within a third of its order, and at least `LOCAL_HARMONICS` where there are so many.
    """
    h = np.arange(last + 1)
    reach = np.maximum(h // 3, LOCAL_HARMONICS // 2)
    low = np.clip(h - reach, 1, max(last - LOCAL_HARMONICS + 1, 1))
    high = np.clip(np.maximum(h + reach, low + LOCAL_HARMONICS - 1), 1, last)
    return low, high


def _degrees_of_freedom(count: int) -> float:
    """Return the degrees of freedom of the variance of a complex coefficient from differences of `count` cycles.

    Equation: nu = 4 (n - 1)^2 / (3 n - 4)                          Source: von Neumann 1941
    """
    return 4.0 * (count - 1) ** 2 / (3.0 * count - 4.0)


def _freedom_with_shape(freedom: Array, density: Array, noise: Autoregression, samples: int) -> Array:
    """Reduce the degrees of freedom by the uncertainty of the spectral shape, which few independent samples determine.

    Equation: 2 / nu = 2 / nu_local + (4 / n_eff) S_h / S_max, n_eff = n var / S_max; S_max at least 5 var
                                        Source: delta method on S(0) = sigma_w^2 / (1 - a)^2, var a = (1 - a^2) / n
    """
    largest = float(density.max())
    if noise.variance <= 0.0 or largest <= 0.0:
        return freedom
    independent = noise.independent(samples, largest)
    return np.asarray(2.0 / (2.0 / freedom + 4.0 / independent * density / largest))


def octave_bands(last: int) -> list[tuple[int, int]]:
    """Return the octaves of harmonics (first, last): 0, 1, 2-3, 4-7, ... up to `last`.

    Examples
    --------
    >>> octave_bands(5)
    [(0, 0), (1, 1), (2, 3), (4, 5)]
    """
    edges = [0] + [2**i for i in range(int(np.log2(max(last, 1))) + 1)]
    return [(low, min(high - 1, last)) for low, high in zip(edges, [*edges[1:], last + 1], strict=True)]


def repeatable_power(error: PureError) -> Array:
    """Estimate the power of the repeatable part of the residual at each harmonic, the share of the noise subtracted.

    Equation: P_0 = c_0^2 - s_0^2,  P_h = 2 (|c_h|^2 - s_h^2)       Source: Parseval

    Errors shared by all cycles (noise of the displacement) are subtracted down to zero at most, octave by octave: at
    each harmonic by itself half of them would be subtracted in vain.

    Returns
    -------
    (H + 1,) mean square [N^2], unbiased: noise alone gives values around zero
    """
    weights = np.where(np.arange(error.mean.size) == 0, 1.0, 2.0)
    repeats = np.abs(error.mean) ** 2 - error.single / error.count
    shared = np.broadcast_to(error.shared, repeats.shape)
    for low, high in octave_bands(repeats.size - 1):
        band = slice(low, high + 1)
        whole = float(shared[band].sum())
        if whole > 0.0:
            repeats[band] -= shared[band] * min(1.0, max(float(repeats[band].sum()), 0.0) / whole)
    return np.asarray(weights * repeats)
