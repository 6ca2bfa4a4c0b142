"""Lack of fit: whether a residual holds more than noise, and which part of it does.

Where a test repeats, the harmonics of its average cycle are compared with the pure error between cycles. Where it does
not, a model of many smooth functions of motion, force, voltage and time takes up the misfit and leaves the noise;
Fisher's test on the whitened residual tells whether it takes up more than noise allows. A corner of the residual, which
no single harmonic shows, is found in short-time spectra of the average cycle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pzd.record import Array, Complex, Mask, Record, sliced
from pzd.signals.jumps import gradient_within_stretches, has_predecessors, split_at_gaps
from pzd.signals.measures import rms
from pzd.signals.noise import Autoregression, PureError, autoregression, harmonics_of, octave_bands, pure_error

# --- Records that repeat ---

TREND_CYCLES = 4
"""Fewest cycles for a trend: three steps between cycles."""
TREND_HARMONICS = 15
"""Harmonics in which a trend is sought: those that a change of T0, C or k moves most."""
FEWEST_DIFFERENCES = 20
"""Fewest samples of differences between cycles for the colour of the noise.

Reason: down to there its degrees of freedom hold the rate of false alarms (tests/signals/test_noise.py)."""


def cycles_tell_noise(cycles: int, points: int) -> bool:
    """Whether so many cycles of so many samples tell noise from misfit; else the record is judged sample by sample."""
    return (cycles - 1) * points >= FEWEST_DIFFERENCES


def p_values_by_harmonics(error: PureError) -> Array:
    """Compute the p-value of each octave of harmonics: the probability that noise alone makes it so large.

    Equation: F = mean_h |c_h|^2 / s_h^2 over the band, against F(2 n, nu)      Source: Fisher's variance ratio

    Returns
    -------
    (bands,) p-values, uniform where nothing is missing; those below 1e-5 are too small where the noise is correlated
    over a tenth of a cycle, whose ends then do not meet and leak into all high harmonics at once
    """
    from scipy.special import fdtrc

    ratio = np.abs(error.mean) ** 2 / np.where(error.of_mean > 0.0, error.of_mean, np.inf)
    octaves = octave_bands(error.mean.size - 1)
    if not cycles_tell_noise(error.count, error.points):
        return np.ones(len(octaves))
    found = []
    for low, high in octaves:
        freedom = 1 if low == 0 else 2 * (high + 1 - low)
        found.append(float(fdtrc(freedom, error.freedom[low : high + 1].max(), ratio[low : high + 1].mean())))
    return np.array(found)


def p_value_of_trend(folded: Array) -> float | None:
    """Compute the probability that noise alone makes the residual change so steadily from cycle to cycle.

    Equation: b_h = sum_j (j - j0) c_jh / sum_j (j - j0)^2, F = mean_h |b_h|^2 / var b_h
                                                                    Source: least squares

    Parameters
    ----------
    folded : (cycles, points) residual [N]

    Returns
    -------
    the p-value, None with fewer than four cycles
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
    """Pool the p-values of several tests into one.

    The smallest p-value finds a misfit that one test shows plainly, Fisher's sum over a band one that all tests show a
    little; Bonferroni's factors bound the rate of false alarms over all comparisons.

    Equation: p = 2 min(R B min p, B min_b P(chi2_2R > -2 sum_r ln p_rb))       Source: Fisher 1932; Bonferroni

    Parameters
    ----------
    by_record : p-values of each test, of differing length

    Returns
    -------
    probability that noise alone makes all tests together look so; 1 without tests
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
"""Piecewise linear functions of each quantity."""
WHITENING_ROUNDS = 3
"""Rounds of fitting the model and the colour of its remainder in turn."""
SINGULAR_SHARE = 1e-9
"""Singular value, as a share of the largest, below which a combination of terms is redundant."""
VOLTAGE_LAGS = (0.005, 0.02, 0.08)
"""Time constants with which the force may lag a moving voltage [s]: from a valve to its supply."""
SAMPLES_PER_TERM = 20
"""Fewest samples a term of the model."""
FEWEST_TERMS = 3
"""Terms of the shortest record that is judged: a constant force, and one along displacement and speed."""
QUIETEST = 0.05
"""Least density of the noise at any frequency, as a share of its mean.

Reason: an anti-aliasing filter removes nearly all noise near half the sampling rate, but not from the simulated force,
whose corners would then count there as misfit; not tuned."""


@dataclass(frozen=True, eq=False)
class SmoothResidual:
    """A residual split into the part that a smooth model explains, and noise."""

    explained: Array
    """(m,) part that the model explains [N]."""
    spread: Array
    """(m,) variance of the explained part by noise alone [N^2]."""
    noise: Autoregression
    """Noise of the remainder."""
    probability: float
    """Probability that noise alone lets the model explain so much."""
    excess: float
    """Variance by noise of what the model explains, over that by `noise` alone: above 1 where errors of the motion
    move it more than an autoregression tells."""


def fit_smooth_residual(
    residual: Array, record: Record, predicted: Array, counted: Mask, drawn: Sequence[tuple[Record, Array]] = ()
) -> SmoothResidual:
    """Split the residual of a record that does not repeat into misfit and noise.

    Wandering noise hides a level or a slow term: terms that the samples hardly determine are shrunk, each of p being
    expected to explain as much as any other.

    Equation: F = ((RSS_0 - RSS) / p) / (RSS / (n - p)) on the whitened residual, of p and n_i - p degrees of freedom,
    n_i the independent samples, which tell the colour                               Source: Aitken 1935, Fisher
    Equation: a_i = t / (t + s_i^2) times its estimate, t = sum r^2 / p, s_i its standard error
                                                                            Source: Hoerl and Kennard 1970
    Errors of the motion make a force that is as smooth as a misfit, and are in the terms as well. What the model takes
    of them on average adds to what it takes of noise, and what it leaves of them is no noise.

    Equation: F = (RSS_0 - RSS) / (p s^2 + E_0 - E), s^2 = (RSS - E) / (n - p), E_0 and E as RSS_0 and RSS, mean over
    the errors; degrees of freedom by the scatter of E_0 - E                Source: Satterthwaite 1946; JCGM 101:2008

    Parameters
    ----------
    residual : (m,) measured less predicted force, the nuisances of the test projected out [N]
    record : the motion, (n,)
    predicted : (m,) force [N]
    counted : (n,) which samples of the record these m are; whitening does not reach across those left out
    drawn : the motion with other errors that are as likely, and (m,) its force [N]; none where it is known
    """
    from scipy.special import fdtrc

    terms = _smooth_terms(record, predicted, counted)
    if terms.shape[1] < FEWEST_TERMS:
        nothing = np.zeros(residual.size)
        return SmoothResidual(nothing, nothing, autoregression([residual - residual.mean()]), 1.0, 1.0)
    basis = _orthonormal(terms)
    explained = basis @ (basis.T @ residual)
    expected = float(residual @ residual) / basis.shape[1]
    for _ in range(WHITENING_ROUNDS):
        noise = autoregression(split_at_gaps(residual - explained, counted)).with_white(QUIETEST)
        whole = has_predecessors(counted, noise.coefficients.size)
        if np.count_nonzero(whole) <= basis.shape[1] + noise.coefficients.size:  # short stretches tell no colour
            noise = Autoregression(np.zeros(0), noise.variance)
            whole = has_predecessors(counted, 0)
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
    # The colour is known by as many samples as are independent of each other, and no better.
    known_by = float(np.clip(noise.independent(flat.size) - rank, 1.0, max(free, 1)))
    over = float(flat @ flat - taken @ taken)
    # QUIETEST adds white noise that may not be there: then the remainder is smaller than expected.
    scale = max(over / free, 1.0 if noise.coefficients.size else 0.0)
    by_noise, shown, freedom = rank * scale, float(rank), known_by
    if drawn and noise.innovation > 0.0:
        parts = [_taken_of_error(motion, force, predicted - force, counted, noise, whole) for motion, force in drawn]
        spread = spread + np.mean([part**2 for part, _, _ in parts], axis=0)
        each = np.array([taken_of_it for _, taken_of_it, _ in parts])
        own, left = float(np.mean(each)), float(np.mean([rest for _, _, rest in parts]))
        white = rank * max(over - left, 0.0) / free
        by_noise = max(by_noise, white + own)
        # Errors of steps that repeat with the motion lie in few directions, and scatter the more.
        scatter = float(np.var(each, ddof=1)) if each.size > 1 else own**2
        # Dry friction beside a rigid spring is the same force in all of them but at its jumps: then nothing scatters.
        fewest = max(scatter, 2.0 * own**2 / rank)
        directions = float(np.clip(2.0 * own**2 / fewest, 1.0, rank)) if fewest > 0.0 else float(rank)
        beyond = by_noise - white
        shown = by_noise**2 / (white**2 / rank + beyond**2 / directions)
        freedom = by_noise**2 / (white**2 / known_by + beyond**2 / (directions * each.size))
    ratio = float(taken @ taken) / by_noise if over > 0.0 else np.inf
    excess = by_noise / (rank * scale) if scale > 0.0 else 1.0
    return SmoothResidual(explained, spread, noise, float(fdtrc(shown, freedom, ratio)), excess)


def _taken_of_error(
    record: Record, predicted: Array, error: Array, counted: Mask, noise: Autoregression, whole: Mask
) -> tuple[Array, float, float]:
    """Return what the terms of a motion with an error take of the force by that error.

    Returns
    -------
    (m,) the part that they take [N], and its squares and those of the rest in units of noise
    """
    basis = _orthonormal(_smooth_terms(record, predicted, counted))
    whitened, flat = noise.whitened(basis)[whole], noise.whitened(error)[whole]
    estimate = np.linalg.lstsq(whitened, flat, rcond=SINGULAR_SHARE)[0]
    taken = float(np.sum((whitened @ estimate) ** 2))
    return basis @ estimate, taken, float(flat @ flat) - taken


def _orthonormal(terms: Array) -> Array:
    """Return an orthonormal basis (m, r) of the space of the terms (m, p)."""
    basis, triangle = np.linalg.qr(terms)
    left, sizes, _ = np.linalg.svd(triangle)
    return np.asarray(basis @ left[:, sizes > SINGULAR_SHARE * sizes[0]])


def _smooth_terms(record: Record, predicted: Array, counted: Mask) -> Array:
    """Return smooth functions (m, p) of motion, force, voltage and time, scaled to about one.

    Of a short record the few that most laws move most, as many as its samples determine.
    """
    part = sliced(record, counted)
    x, v, a = (_scaled(channel) for channel in (part.displacement, part.velocity, part.acceleration))
    rate = _scaled(gradient_within_stretches(predicted, counted))
    products = [a, v * np.abs(v), a * np.sign(v), rate, np.abs(rate), x * v]
    columns = [
        _hats(part.velocity),
        _hats(part.displacement),
        _hats(predicted),
        np.column_stack(products),
        _hats(part.time)[:, ::3],
    ]
    along = np.column_stack([np.sign(v), v])
    if record.voltage is not None and part.voltage is not None and np.ptp(part.voltage) > 0.0:
        columns.append(_hats(part.voltage)[:, ::2] * np.sign(v)[:, None])
        columns += [_lag_error(record.voltage, tau * record.rate)[counted][:, None] * along for tau in VOLTAGE_LAGS]
    most = v.size // SAMPLES_PER_TERM
    if sum(each.shape[1] for each in columns) <= most:
        return np.column_stack(columns)
    few = [np.ones(v.size), x, v, np.abs(v), _scaled(predicted), *products]
    return np.column_stack(few[:most]) if most else np.zeros((v.size, 0))


def _lag_error(voltage: Array, samples: float) -> Array:
    """Return the difference (n,) between the voltage and itself after a first-order lag of so many samples."""
    from scipy.signal import lfilter

    share = 1.0 - np.exp(-1.0 / samples)
    lagged, _ = lfilter([share], [1.0, share - 1.0], voltage, zi=[voltage[0] * (1.0 - share)])
    return _scaled(voltage - lagged)


def _scaled(values: Array) -> Array:
    size = rms(values)
    return values / size if size > 0.0 else values


def _hats(values: Array) -> Array:
    """Return piecewise linear functions (n, HATS) with nodes at even quantiles."""
    nodes = np.unique(np.quantile(values, np.linspace(0.0, 1.0, HATS)))
    return np.stack([np.interp(values, nodes, unit) for unit in np.eye(nodes.size)], axis=-1)


# --- Short-time spectra ---

WINDOW_COUNTS = (8, 16, 32, 64, 128, 256)
"""Numbers of overlapping windows in a cycle, the longest windows first.

Reason: in octaves, down to windows as short as the corner of a slow triangle; not tuned."""
SHORTEST_WINDOW = 8
"""Fewest samples in a window: fewer do not show a corner."""
BLOCK = 8
"""Neighbouring frequencies of a window that are kept or dropped together.

Reason: a corner fills a band; together they are significant at a third of the power that each would need alone."""
NEIGHBOUR_CHANCE = 0.05
"""Largest p-value of a block that is kept beside a significant one.

Reason: a corner reaches over the whole spectrum of a window and sinks into the noise slowly; not tuned."""


@dataclass(frozen=True, eq=False)
class ShortTimeMask:
    """Significant short-time coefficients of a cycle, at each length of the windows.

    Equation: x_j = F* (T (F (w_j x))), x = sum_j w_j x_j, sum_j w_j^2 = 1; T keeps what exceeds its noise
    Source: Allen and Rabiner 1977 (short-time Fourier transform); Donoho and Johnstone 1994 (thresholding)
    """

    points: int
    """Samples in a cycle."""
    masks: tuple[NDArray[np.bool_], ...]
    """(windows, frequencies) each, for as many lengths as the cycle has samples for."""

    @classmethod
    def of(cls, cycle: Array, variance: Array, errors: float) -> tuple[ShortTimeMask, Array]:
        """Find the significant coefficients of a cycle, and the part of the cycle that they make up.

        Parameters
        ----------
        cycle : (points,) remainder of the harmonics [N]
        variance : (H + 1,) variance |.|^2 of the Fourier coefficients of the cycle by noise [N^2]
        errors : standard errors at which a single coefficient is significant

        Returns
        -------
        the masks, and (points,) the part of the cycle that they keep [N]
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
        """Return the part (points,) of another cycle that the same coefficients keep."""
        found = np.zeros(cycle.size)
        for parts, mask in zip(_window_counts(self.points), self.masks, strict=True):
            if np.any(mask):
                cut = _Windows.of(self.points, parts)
                found += cut.cycle(np.where(mask, cut.coefficients(cycle - found), 0.0))
        return found


def _significant_powers(ratio: Array, errors: float) -> NDArray[np.bool_]:
    """Find the significant powers (windows, frequencies), in units of noise, and the probable ones beside them."""
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
    """Return the sum of powers of a block [units of noise] that noise alone exceeds with probability exp(-exponent).

    Equation: P(sum |c|^2/s^2 > x) = exp(-x/l_1) prod_k l_1/(l_1 - l_k), l_k = 1 + cos(k pi/(n + 1)), as far out as
    x counts. Source: Box 1954, theorem 2.4; l are the eigenvalues of the correlation of neighbours, 1/2 by a half sine
    """
    values: Array = 1.0 + np.cos(np.arange(1, BLOCK + 1) * np.pi / (BLOCK + 1))
    return float(values[0] * (exponent + np.sum(np.log(values[0] / (values[0] - values[1:])))))


def _window_counts(points: int) -> Sequence[int]:
    """Return the numbers of windows for which a cycle has the samples."""
    return [parts for parts in WINDOW_COUNTS if 2 * points >= SHORTEST_WINDOW * parts]


@dataclass(frozen=True, eq=False)
class _Windows:
    """A cycle cut into overlapping windows of half sines, whose squares add up to one."""

    samples: NDArray[np.int64]
    """(windows, m) indices of the samples in each window."""
    weights: Array
    """(windows, m) weights of these samples."""
    points: int
    """Samples in the cycle."""

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
        """Variance (windows,) of a coefficient as a share of that of the whole cycle, for white noise."""
        return np.asarray(np.sum(self.weights**2, axis=1) / self.points)

    def coefficients(self, cycle: Array) -> Complex:
        """Return the Fourier coefficients of the windows (windows, frequencies), scaled like those of the cycle."""
        return np.asarray(np.fft.rfft(self.weights * cycle[self.samples], axis=1) / self.points)

    def cycle(self, coefficients: Complex) -> Array:
        """Return the cycle (points,) of given coefficients of its windows."""
        parts: Array = self.weights * np.fft.irfft(coefficients, self.samples.shape[1], axis=1) * self.points
        return np.asarray(np.bincount(self.samples.ravel(), parts.ravel(), self.points).astype(np.float64))
