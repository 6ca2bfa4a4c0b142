"""What the Bingham element misses in records that repeat: lack of fit against pure error.

Adjacent cycles differ by noise alone; the average cycle of the residual shows what repeats and is
missed. What the tests' own offset, gain and delay explain within their priors is none of the
model's fault and is taken off first, together with the change of T0, C and k that goes with it. In
a record that repeats nowhere noise and misfit cannot be told apart without a model of either, so
nothing is said of it here; diagnose looks at it (diagnose/noise/smooth_residual.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pzd.identify.part import Part
from pzd.record import Array
from pzd.signals.between_cycles import PureError, pure_error, repeatable_power
from pzd.signals.jumps import within_a_sample
from pzd.signals.lack_of_fit import by_harmonics, pooled
from pzd.signals.nuisance import AT_MOST

SIGNIFICANCE = 1e-3
"""Lack of fit is believed when noise alone would show it less often than this; as in diagnose."""
VISIBLE = 0.0025
"""Smallest misfit that speaks, r.m.s. as a share of peak force: half of the error of a load cell of class 0.5, which
may as well bend the measured force. As in diagnose."""


@dataclass(frozen=True, eq=False)
class Misfit:
    """What repeats and is missed, over the records of one fit."""

    share: float
    """R.m.s. of what is missed as a share of each record's peak force; 0 where noise alone may show it."""
    scores: Array
    """(p, p) variance of J' r that it would cause, were its phases chance; 0 where noise alone may show it [N^2]."""

    @property
    def speaks(self) -> bool:
        """Whether the parameters are no longer the damper's."""
        return self.share >= VISIBLE


def misfit_of(parts: Sequence[Part]) -> Misfit:
    """What the model misses in the records of a fit.

    Equation: F = mean_h |c_h|^2 / s_h^2 over octaves of harmonics, pooled over the records
                                                                    Source: Fisher's variance ratio
    """
    size = parts[0].slopes.shape[1]
    looked_at = []
    for part, cleared in zip(parts, _cleared(parts), strict=True):
        folded = part.folded(cleared)
        if folded is not None:
            looked_at.append((part, pure_error(folded)))
    nothing = Misfit(0.0, np.zeros((size, size)))
    if not looked_at or pooled([by_harmonics(error) for _, error in looked_at]) >= SIGNIFICANCE:
        return nothing
    samples = np.array([p.residuals.size for p, _ in looked_at], dtype=np.float64)
    power = np.array([float(repeatable_power(e).sum()) / float(np.max(np.abs(p.force))) ** 2 for p, e in looked_at])
    share = float(np.sqrt(max(float(samples @ power / samples.sum()), 0.0)))
    return Misfit(share, np.sum([_scores(p, e) for p, e in looked_at], axis=0))


def _cleared(parts: Sequence[Part]) -> list[Array]:
    """(m,) residual of each record without what its offset, gain and delay explain, the parameters free to follow.

    Equation: min_d,b sum_t |r_t - J_t d - A_t b_t|^2 / s_t^2 + |b_t|^2, |b| <= 3.5         Source: Gaussian prior
    """
    from scipy.optimize import lsq_linear

    size = parts[0].slopes.shape[1]
    scale = np.sqrt(sum(np.sum(p.slopes**2, axis=0) for p in parts))
    scale[scale == 0.0] = 1.0
    whole = size + sum(p.nuisances.shape[1] for p in parts)
    normal, right = np.zeros((whole, whole)), np.zeros(whole)
    columns, at = [], size
    for part in parts:
        both = np.hstack([part.slopes / scale, part.nuisances])
        place = np.r_[:size, at : at + part.nuisances.shape[1]]
        weighed = both[part.calm] / np.sqrt(_variance(part))
        normal[np.ix_(place, place)] += weighed.T @ weighed
        right[place] += weighed.T @ (part.residuals[part.calm] / np.sqrt(_variance(part)))
        columns.append((both, place))
        at += part.nuisances.shape[1]
    normal[np.diag_indices(whole)] += np.where(np.arange(whole) < size, 1e-12 * np.trace(normal), 1.0)
    triangle = np.linalg.cholesky(normal).T
    limit = np.where(np.arange(whole) < size, np.inf, AT_MOST)
    found = lsq_linear(triangle, np.linalg.solve(triangle.T, right), (-limit, limit)).x
    return [_without(part, both @ found[place]) for part, (both, place) in zip(parts, columns, strict=True)]


def _without(part: Part, explained: Array) -> Array:
    """(m,) residual less what is explained, and less what chance makes of it beside jumps."""
    left = part.residuals - explained
    predicted = part.force - part.residuals
    return left - np.where(part.calm, 0.0, within_a_sample(predicted + left, predicted))


def _variance(part: Part) -> float:
    """Variance by noise, enough to weigh the priors."""
    folded = part.folded(part.residuals)
    steps = np.diff(part.residuals) if folded is None else np.diff(folded, axis=0)
    return max(float(np.mean(steps**2)) / 2.0, 1e-12 * float(np.max(part.force**2)))


def _scores(part: Part, error: PureError) -> Array:
    """(p, p) variance of J' r by what repeats, with the spectrum that it shows and phases by chance.

    Equation: sum_h J_h J_h* P_h n^2, J_h of the average cycle of the slopes, n samples      Source: Parseval
    """
    folded = [part.folded(column) for column in part.slopes.T]
    means = np.stack([f.mean(axis=0) for f in folded if f is not None], axis=-1)
    harmonics = (np.fft.rfft(means, axis=0) / len(means))[: error.mean.size]
    power = np.maximum(repeatable_power(error), 0.0)
    found: Array = np.real((harmonics * power[:, None]).conj().T @ harmonics) * part.residuals.size**2
    return found
