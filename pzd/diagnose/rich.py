"""Noise and misfit where nothing repeats: against a rich smooth model of the residual.

Whatever the damper misses is a function of motion, force, voltage and time; a model with many smooth
functions of them takes it up, and what is left is noise. Whether the model takes up more than noise
would let it is Fisher's test on the whitened residual.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pzd.diagnose.autoregression import Autoregression, autoregression
from pzd.record import Record

Array = NDArray[np.float64]

HATS = 8
"""Piecewise linear functions over each quantity."""
ROUNDS = 3
"""Rounds of fitting the model and the colour of what it leaves."""
SAMPLES_PER_TERM = 20
"""Fewest samples for each term of the model; with fewer nothing is judged."""


@dataclass(frozen=True, eq=False)
class RichFit:
    """A residual parted into what a rich smooth model explains and noise."""

    explained: Array
    """(n,) [N]."""
    noise: Autoregression
    """What is left."""
    probability: float
    """That noise alone lets the model explain so much."""


def rich_fit(residual: Array, record: Record, predicted: Array) -> RichFit:
    """The residual of a record that does not repeat, parted into misfit and noise.

    Equation: F = ((RSS_0 - RSS) / p) / (RSS / (n - p)) on the whitened residual     Source: Aitken 1935, Fisher

    Parameters
    ----------
    residual : (n,) measured less predicted force, the test's nuisances taken off [N]
    record : the motion, (n,)
    predicted : (n,) force [N]
    """
    from scipy.stats import f

    terms = _terms(record, predicted)
    if residual.size < SAMPLES_PER_TERM * terms.shape[1]:
        return RichFit(np.zeros(residual.size), autoregression([residual - residual.mean()]), 1.0)
    explained = terms @ np.linalg.lstsq(terms, residual, rcond=None)[0]
    for _ in range(ROUNDS):
        noise = autoregression([residual - explained])
        flat, columns = noise.whitened(residual), noise.whitened(terms)
        coefficients = np.linalg.lstsq(columns, flat, rcond=None)[0]
        explained = terms @ coefficients
    left = float(np.sum((flat - columns @ coefficients) ** 2))
    total, rank = float(flat @ flat), np.linalg.matrix_rank(columns)
    free = flat.size - rank - noise.coefficients.size
    ratio = (total - left) / rank / (left / free) if left > 0.0 else np.inf
    return RichFit(explained, noise, float(f.sf(ratio, rank, free)))


def _terms(record: Record, predicted: Array) -> Array:
    """(n, p) smooth functions of motion, force, voltage and time, scaled to about one, without repeated columns."""
    v, a = _scaled(record.velocity), _scaled(record.acceleration)
    rate = _scaled(np.gradient(predicted))
    columns = [
        _hats(record.velocity),
        _hats(record.displacement),
        _hats(predicted),
        np.column_stack([a, v * np.abs(v), a * np.sign(v), rate, np.abs(rate), _scaled(record.displacement) * v]),
        _hats(record.time)[:, ::3],
    ]
    if record.voltage is not None and np.ptp(record.voltage) > 0.0:
        columns.append(_hats(record.voltage)[:, ::2] * np.sign(v)[:, None])
        columns.append(_scaled(np.gradient(record.voltage))[:, None] * np.column_stack([np.ones(v.size), np.sign(v)]))
    return np.column_stack(columns)


def _scaled(values: Array) -> Array:
    size = float(np.sqrt(np.mean(values**2)))
    return values / size if size > 0.0 else values


def _hats(values: Array) -> Array:
    """(n, HATS) piecewise linear functions with nodes at even quantiles."""
    nodes = np.unique(np.quantile(values, np.linspace(0.0, 1.0, HATS)))
    return np.stack([np.interp(values, nodes, unit) for unit in np.eye(nodes.size)], axis=-1)
