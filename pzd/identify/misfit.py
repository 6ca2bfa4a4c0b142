"""What the Bingham element misses, beyond noise and beyond what the sensors of a test do: lack of fit.

Where a record repeats, adjacent cycles differ by noise alone, and the average cycle of the residual
shows what is missed: lack of fit against pure error. Where it does not, a smooth function of
motion and force takes up what is missed, and noise is what it leaves. What the tests' own offset,
gain and delay explain within their priors is none of the model's fault and is taken off first,
together with the change of T0, C and k that goes with it. Of records whose control signal moves
nothing is said here, for a lag of the valve looks like any misfit; diagnose looks at them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pzd.identify.part import Part
from pzd.record import Array
from pzd.signals.between_cycles import pure_error, repeatable_power
from pzd.signals.jumps import within_a_sample
from pzd.signals.lack_of_fit import by_harmonics, pooled
from pzd.signals.nuisance import AT_MOST
from pzd.signals.smooth_residual import fit_smooth_residual

SIGNIFICANCE = 1e-3
"""Lack of fit is believed when noise alone would show it less often than this; as in diagnose."""
VISIBLE = 0.0025
"""Smallest misfit that speaks, r.m.s. as a share of peak force: half of the error of a load cell of class 0.5, which
may as well bend the measured force. As in diagnose."""
ABSORBED = 2.0
"""T0, C and k take up more of what the model lacks than they leave: for the effects of the library up to about four
times what is left, along the parameter that suffers most (C beside a quadratic orifice); twice is half of that, since
an interval adds another factor of two."""

SPEAKS = 0.01
"""A misfit beyond this share of peak widens no interval any further: the status tells it, and that the parameters are
the model's; an interval that held those of the damper all the same would run from nothing to a hundred times as much
where a tenth of the force is missed, and tell nothing. Up to a hidden effect of 5 % of peak it holds them with this."""


@dataclass(frozen=True, eq=False)
class Misfit:
    """What is missed, over the records of one fit."""

    share: float
    """R.m.s. of what is missed as a share of each record's peak force; 0 where noise alone may show it."""
    force: float
    """The same in force [N]."""

    @property
    def is_large(self) -> bool:
        """Whether so much is missed that T0, C and k are no longer the damper's."""
        return self.share >= VISIBLE

    @property
    def absorbed(self) -> float:
        """R.m.s. force that the parameters may have taken up beside, in error [N]; no more than `SPEAKS` lets it be."""
        return ABSORBED * self.force * min(1.0, SPEAKS / self.share) if self.share > 0.0 else 0.0


def misfit_of(parts: Sequence[Part]) -> Misfit:
    """What the model misses in the records of a fit.

    Equation: p = 2 min over both kinds of record of the probability by noise, pooled over the records
                            Source: Fisher's variance ratio, in signals/lack_of_fit and smooth_residual; Bonferroni
    """
    cycles: list[Array] = []
    smooth: list[Array] = []
    power, samples, peaks = [], [], []
    for part, cleared in zip(parts, _cleared(parts), strict=True):
        if not part.constant:
            continue
        folded = part.folded(cleared)
        if folded is None:
            record = replace(part.record, voltage=None)  # it stands still, but for noise
            fit = fit_smooth_residual(cleared, record, part.force - part.residuals, part.counted)
            smooth.append(np.array([fit.probability]))
            power.append(float(np.mean(fit.explained**2 - fit.spread)))
        else:
            error = pure_error(folded)
            cycles.append(by_harmonics(error))
            power.append(float(repeatable_power(error).sum()))
        samples.append(part.residuals.size)
        peaks.append(float(np.max(np.abs(part.force))))
    kinds = [kind for kind in (cycles, smooth) if kind]
    if not kinds or len(kinds) * min(pooled(kind) for kind in kinds) >= SIGNIFICANCE:
        return Misfit(0.0, 0.0)
    weights = np.array(samples) / sum(samples)
    return Misfit(_root(weights @ (np.array(power) / np.array(peaks) ** 2)), _root(weights @ np.array(power)))


def _root(square: float) -> float:
    return float(np.sqrt(max(square, 0.0)))


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
