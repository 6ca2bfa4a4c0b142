"""Lack of fit: whether a residual holds more than noise, and which part of it does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pzd.record import Array, Complex, Mask, Record, sliced
from pzd.signals.jumps import gradient_within_stretches, has_predecessors, split_at_gaps
from pzd.signals.measures import rms
from pzd.signals.noise import Autoregression, PureError, autoregression, harmonics_of, pure_error

# --- Records that repeat ---

TREND_CYCLES = 4
"""Fewest cycles on which a trend is judged."""
TREND_HARMONICS = 15
"""Harmonics on which a trend is judged."""
FEWEST_DIFFERENCES = 100
"""Fewest differences between cycles that tell the colour of noise; with fewer nothing is judged."""


def octave_bands(last: int) -> list[tuple[int, int]]:
    """Octaves of harmonics (first, last): 0, 1, 2-3, 4-7, ... up to `last`."""
    edges = [0] + [2**i for i in range(int(np.log2(max(last, 1))) + 1)]
    return [(low, min(high - 1, last)) for low, high in zip(edges, [*edges[1:], last + 1], strict=True)]


def p_values_by_harmonics(error: PureError) -> Array:
    """Probability, a band of harmonics, that noise alone makes the average cycle so large.

    Equation: F = mean_h |c_h|^2 / s_h^2 over the band, against F(2 n, nu)      Source: Fisher's variance ratio

    Returns
    -------
    (bands,) probabilities, uniform where nothing is missing; those below 1e-5 are too small where the noise is
    correlated over a tenth of a cycle, for its ends do not meet and leak into all high harmonics at once
    """
    from scipy.special import fdtrc

    ratio = np.abs(error.mean) ** 2 / np.where(error.of_mean > 0.0, error.of_mean, np.inf)
    octaves = octave_bands(error.mean.size - 1)
    if (error.count - 1) * error.points < FEWEST_DIFFERENCES:
        return np.ones(len(octaves))
    found = []
    for low, high in octaves:
        freedom = 1 if low == 0 else 2 * (high + 1 - low)
        found.append(float(fdtrc(freedom, error.freedom[low : high + 1].max(), ratio[low : high + 1].mean())))
    return np.array(found)


def p_value_of_trend(folded: Array) -> float | None:
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


def pooled_p_value(by_record: Sequence[Array]) -> float:
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


# --- Records that do not repeat ---

HATS = 8
"""Piecewise linear functions over each quantity."""
WHITENING_ROUNDS = 3
"""Rounds of fitting the model and the colour of what it leaves."""
SINGULAR_SHARE = 1e-9
"""Combinations of terms smaller than this share of the largest are the same term twice."""
VOLTAGE_LAGS = (0.005, 0.02, 0.08)
"""Time constants with which the force may follow a moving voltage [s]."""
SAMPLES_PER_TERM = 20
"""Fewest samples for each term of the model; with fewer nothing is judged."""
QUIETEST = 0.05
"""No frequency is believed to be quieter than this share of the noise's mean density.

Reason: a filter against aliasing takes nearly all noise away near half the sampling rate, but not from the simulated
force, whose corners would then count there as misfit; not tuned."""


@dataclass(frozen=True, eq=False)
class SmoothResidual:
    """A residual parted into what a smooth model of many terms explains, and noise."""

    explained: Array
    """(m,) [N]."""
    spread: Array
    """(m,) variance that noise alone gives to what is explained [N^2]."""
    noise: Autoregression
    """What is left."""
    probability: float
    """That noise alone lets the model explain so much."""


def fit_smooth_residual(residual: Array, record: Record, predicted: Array, counted: Mask) -> SmoothResidual:
    """The residual of a record that does not repeat, parted into misfit and noise.

    Noise that wanders hides a level or a slow term: of a term that the samples hardly tell no more is explained than
    they tell, each of p being expected to explain as much as any other.

    Equation: F = ((RSS_0 - RSS) / p) / (RSS / (n - p)) on the whitened residual     Source: Aitken 1935, Fisher
    Equation: a_i = t / (t + s_i^2) times its estimate, t = sum r^2 / p, s_i its standard error
                                                                            Source: Hoerl and Kennard 1970

    Parameters
    ----------
    residual : (m,) measured less predicted force, the test's nuisances taken off [N]
    record : the motion, (n,)
    predicted : (m,) force [N]
    counted : (n,) which samples of the record these m are; what follows on one left out is not whitened by it
    """
    from scipy.special import fdtrc

    terms = _smooth_terms(record, predicted, counted)
    if residual.size < SAMPLES_PER_TERM * terms.shape[1]:
        nothing = np.zeros(residual.size)
        return SmoothResidual(nothing, nothing, autoregression([residual - residual.mean()]), 1.0)
    basis = _orthonormal(terms)
    explained = basis @ (basis.T @ residual)
    expected = float(residual @ residual) / basis.shape[1]
    for _ in range(WHITENING_ROUNDS):
        noise = autoregression(split_at_gaps(residual - explained, counted)).with_white(QUIETEST)
        whole = has_predecessors(counted, noise.coefficients.size)
        flat = noise.whitened(residual)[whole]
        whitened = noise.whitened(basis)[whole]
        _, sizes, right = np.linalg.svd(np.linalg.qr(whitened, mode="r"))
        rank = int(np.count_nonzero(sizes > SINGULAR_SHARE * sizes[0]))
        taken = right[:rank] @ (whitened.T @ flat) / sizes[:rank]
        known = sizes[:rank] ** 2 * expected
        share = known / (known + 1.0) if noise.innovation > 0.0 else np.ones(rank)
        to_samples = basis @ right[:rank].T * (share / sizes[:rank])
        explained = to_samples @ taken
    spread = np.sum(to_samples**2, axis=1) if noise.innovation > 0.0 else np.zeros(residual.size)
    free = flat.size - rank - noise.coefficients.size
    over = float(flat @ flat - taken @ taken)
    # Of the white noise that QUIETEST puts beside coloured noise there may be none: then less is left than expected.
    scale = max(over / free, 1.0 if noise.coefficients.size else 0.0)
    ratio = float(taken @ taken) / rank / scale if over > 0.0 else np.inf
    return SmoothResidual(explained, spread, noise, float(fdtrc(rank, free, ratio)))


def _orthonormal(terms: Array) -> Array:
    """(m, r) orthonormal: all that sums of some (m, p) terms can be, each of them once."""
    basis, triangle = np.linalg.qr(terms)
    left, sizes, _ = np.linalg.svd(triangle)
    return np.asarray(basis @ left[:, sizes > SINGULAR_SHARE * sizes[0]])


def _smooth_terms(record: Record, predicted: Array, counted: Mask) -> Array:
    """(m, p) smooth functions of motion, force, voltage and time, scaled to about one, without repeated columns."""
    part = sliced(record, counted)
    v, a = _scaled(part.velocity), _scaled(part.acceleration)
    rate = _scaled(gradient_within_stretches(predicted, counted))
    columns = [
        _hats(part.velocity),
        _hats(part.displacement),
        _hats(predicted),
        np.column_stack([a, v * np.abs(v), a * np.sign(v), rate, np.abs(rate), _scaled(part.displacement) * v]),
        _hats(part.time)[:, ::3],
    ]
    along = np.column_stack([np.sign(v), v])
    if record.voltage is not None and part.voltage is not None and np.ptp(part.voltage) > 0.0:
        columns.append(_hats(part.voltage)[:, ::2] * np.sign(v)[:, None])
        columns += [_lag_error(record.voltage, tau * record.rate)[counted][:, None] * along for tau in VOLTAGE_LAGS]
    return np.column_stack(columns)


def _lag_error(voltage: Array, samples: float) -> Array:
    """What a first-order lag of so many samples leaves between the voltage and itself."""
    from scipy.signal import lfilter

    share = 1.0 - np.exp(-1.0 / samples)
    lagged, _ = lfilter([share], [1.0, share - 1.0], voltage, zi=[voltage[0] * (1.0 - share)])
    return _scaled(voltage - lagged)


def _scaled(values: Array) -> Array:
    size = rms(values)
    return values / size if size > 0.0 else values


def _hats(values: Array) -> Array:
    """(n, HATS) piecewise linear functions with nodes at even quantiles."""
    nodes = np.unique(np.quantile(values, np.linspace(0.0, 1.0, HATS)))
    return np.stack([np.interp(values, nodes, unit) for unit in np.eye(nodes.size)], axis=-1)


# --- Short-time spectra ---

WINDOW_COUNTS = (8, 16, 32, 64, 128, 256)
"""In so many overlapping parts the cycle is looked at, the longer ones first.

Reason: in octaves, down to parts as short as the corner of a slow triangle; not tuned."""
SHORTEST_WINDOW = 8
"""Samples of the shortest part, less than which do not show a corner."""
BLOCK = 8
"""Neighbouring frequencies of a part that are kept or left together.

Reason: a corner fills a band; together they stand clear at a third of the power that each would need alone."""
NEIGHBOUR_CHANCE = 0.05
"""Beside what stands clear, powers are kept that noise alone would show less often.

Reason: a corner reaches over a part's whole spectrum and sinks into the noise slowly; not tuned."""


@dataclass(frozen=True, eq=False)
class ShortTimeMask:
    """Which short-time coefficients stand clear of the noise, at each length of the parts."""

    points: int
    """Samples in a cycle."""
    masks: tuple[NDArray[np.bool_], ...]
    """(parts, frequencies) each, for as many lengths as the cycle has samples for."""

    @classmethod
    def of(cls, cycle: Array, variance: Array, errors: float) -> tuple[ShortTimeMask, Array]:
        """What stands clear in a cycle, and the cycle of that alone.

        Parameters
        ----------
        cycle : (points,) what the harmonics leave
        variance : (H + 1,) variance |.|^2 of the Fourier coefficients of the cycle by noise
        errors : standard errors from which a coefficient would stand clear by itself

        Returns
        -------
        the masks, and (points,) the part of the cycle that they keep
        """
        masks: list[NDArray[np.bool_]] = []
        found = np.zeros(cycle.size)
        for parts in _window_counts(cycle.size):
            cut = _Windows.of(cycle.size, parts)
            coefficients = cut.coefficients(cycle - found)
            at = np.linspace(0.0, 0.5 * cycle.size, coefficients.shape[1])
            noise = np.interp(at, np.arange(variance.size), variance) * cut.power[:, None]
            power = np.abs(coefficients) ** 2
            ratio = np.divide(power, noise, out=np.full_like(power, np.inf), where=noise > 0.0)
            masks.append((at < variance.size) & _significant_powers(np.where(at < variance.size, ratio, 0.0), errors))
            found += cut.cycle(np.where(masks[-1], coefficients, 0.0))
        return cls(cycle.size, tuple(masks)), found

    def kept(self, cycle: Array) -> Array:
        """(points,) the part of another cycle that the same coefficients keep."""
        found = np.zeros(cycle.size)
        for parts, mask in zip(_window_counts(self.points), self.masks, strict=True):
            if np.any(mask):
                cut = _Windows.of(self.points, parts)
                found += cut.cycle(np.where(mask, cut.coefficients(cycle - found), 0.0))
        return found


def _significant_powers(ratio: Array, errors: float) -> NDArray[np.bool_]:
    """(parts, frequencies) which powers, in units of noise, stand clear of it, with those beside that probably do."""
    parts, count = ratio.shape
    blocks = np.pad(ratio, ((0, 0), (0, -count % BLOCK))).reshape(parts, -1, BLOCK).sum(axis=2)
    clear, probable = blocks > _block_threshold(errors**2), blocks > _block_threshold(-np.log(NEIGHBOUR_CHANCE))
    for _ in range(blocks.shape[1]):
        beside = np.pad(clear, ((0, 0), (1, 1)))
        grown = clear | (probable & (beside[:, :-2] | beside[:, 2:]))
        if np.array_equal(grown, clear):
            break
        clear = grown
    return np.repeat(clear, BLOCK, axis=1)[:, :count]


def _block_threshold(exponent: float) -> float:
    """What the powers of neighbours [units of noise] add up to in exp(-exponent) of all cases by noise alone.

    Equation: P(sum |c|^2/s^2 > x) = exp(-x/l_1) prod_k l_1/(l_1 - l_k), l_k = 1 + cos(k pi/(n + 1)), as far out as
    x counts. Source: Box 1954, theorem 2.4; l are the eigenvalues of the correlation of neighbours, 1/2 by a half sine
    """
    values: Array = 1.0 + np.cos(np.arange(1, BLOCK + 1) * np.pi / (BLOCK + 1))
    return float(values[0] * (exponent + np.sum(np.log(values[0] / (values[0] - values[1:])))))


def _window_counts(points: int) -> Sequence[int]:
    return [parts for parts in WINDOW_COUNTS if 2 * points >= SHORTEST_WINDOW * parts]


@dataclass(frozen=True, eq=False)
class _Windows:
    """A cycle cut into overlapping parts by half sines, whose squares add up to one."""

    samples: NDArray[np.int64]
    """(parts, m) of the cycle that a part looks at."""
    weights: Array
    """(parts, m) of them."""
    points: int

    @classmethod
    def of(cls, points: int, parts: int) -> _Windows:
        hop = points / parts
        size = 2 * int(np.ceil(hop)) + 1
        begins = np.floor(hop * np.arange(parts)).astype(np.int64)
        samples = begins[:, None] + np.arange(size)
        place = (samples - hop * np.arange(parts)[:, None]) / (2.0 * hop)
        weights = np.where((place > 0.0) & (place < 1.0), np.sin(np.pi * place), 0.0)
        return cls(samples % points, weights, points)

    @property
    def power(self) -> Array:
        """(parts,) variance of a coefficient as a share of that of the whole cycle, for white noise."""
        shares: Array = np.sum(self.weights**2, axis=1) / self.points
        return shares

    def coefficients(self, cycle: Array) -> Complex:
        """(parts, frequencies) Fourier coefficients of the parts, scaled like those of the cycle."""
        found: Complex = np.fft.rfft(self.weights * cycle[self.samples], axis=1) / self.points
        return found

    def cycle(self, coefficients: Complex) -> Array:
        """(points,) the cycle of given coefficients of its parts."""
        parts: Array = self.weights * np.fft.irfft(coefficients, self.samples.shape[1], axis=1) * self.points
        found: Array = np.bincount(self.samples.ravel(), parts.ravel(), self.points).astype(np.float64)
        return found
