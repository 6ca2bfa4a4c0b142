"""Noise and misfit of a record that does not repeat: a smooth model of its residual is misfit, the rest noise.

Whatever the damper misses is a function of motion, force, voltage and time; a model with many smooth
functions of them takes it up, and what is left is noise. Whether the model takes up more than noise
would let it is Fisher's test on the whitened residual.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pzd.record import Array, Mask, Record, sliced
from pzd.signals.autoregression import Autoregression, autoregression
from pzd.signals.left_out import parted, slope_within, unbroken
from pzd.signals.root_mean_square import rms

HATS = 8
"""Piecewise linear functions over each quantity."""
ROUNDS = 3
"""Rounds of fitting the model and the colour of what it leaves."""
SINGULAR = 1e-9
"""Combinations of terms smaller than this share of the largest are the same term twice."""
LAGS = (0.005, 0.02, 0.08)
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

    terms = _terms(record, predicted, counted)
    if residual.size < SAMPLES_PER_TERM * terms.shape[1]:
        nothing = np.zeros(residual.size)
        return SmoothResidual(nothing, nothing, autoregression([residual - residual.mean()]), 1.0)
    basis = _orthonormal(terms)
    explained = basis @ (basis.T @ residual)
    expected = float(residual @ residual) / basis.shape[1]
    for _ in range(ROUNDS):
        noise = autoregression(parted(residual - explained, counted)).with_white(QUIETEST)
        whole = unbroken(counted, noise.coefficients.size)
        flat = noise.whitened(residual)[whole]
        whitened = noise.whitened(basis)[whole]
        _, sizes, right = np.linalg.svd(np.linalg.qr(whitened, mode="r"))
        rank = int(np.count_nonzero(sizes > SINGULAR * sizes[0]))
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
    return np.asarray(basis @ left[:, sizes > SINGULAR * sizes[0]])


def _terms(record: Record, predicted: Array, counted: Mask) -> Array:
    """(m, p) smooth functions of motion, force, voltage and time, scaled to about one, without repeated columns."""
    part = sliced(record, counted)
    v, a = _scaled(part.velocity), _scaled(part.acceleration)
    rate = _scaled(slope_within(predicted, counted))
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
        columns += [_behind(record.voltage, tau * record.rate)[counted][:, None] * along for tau in LAGS]
    return np.column_stack(columns)


def _behind(voltage: Array, samples: float) -> Array:
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
