"""95 % intervals of T0, C and k: from the scatter between cycles and between tests, and what the model misses.

Three things move an estimate. Noise: what differs between cycles that ought to be equal, or, where
nothing repeats, between stretches of a record. The sensors: offset, gain and delay of the force
differ from test to test, and no cycle shows it; their prior standard deviations are sent through
the fit, and where a condition has several tests, what these disagree by corrects them. And what the
model misses: where the lack of fit is beyond noise (misfit.py), and in any case a little that no test
shows, which C takes up on a single sine. An interval therefore means: were
the tests repeated on the same damper, the sensors mounted anew, 95 of 100 such intervals would hold
the parameters that the model has in the mean. Where the model lacks nothing these are the damper's
own; where it does, the status says that they are not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pzd.identification.prepared_record import Part
from pzd.identification.trust import Misfit
from pzd.record import Array
from pzd.signals.criterion import rms
from pzd.signals.noise import Autoregression, all_pole, autoregression
from pzd.signals.smoothing import reversals

# ----------------------------------------------------------------------------------------------------


TURNS = 4
"""Half strokes in a stretch of a record that does not repeat: two full cycles outlast the memory of the noise."""
STRETCHES = (4, 24)
"""Fewest and most such stretches of one record."""
LEVERAGE = 1e-3
"""A stretch that a parameter depends on alone leaves no residual; its correction stops at this share."""
PRIOR_WORTH = 4.0
"""The prior variances of the sensors weigh as much as so many degrees of freedom against what the tests show."""
FAINT = 5e-4
"""What a law that the model lacks may leave unseen, r.m.s. as a share of peak: a tenth of the error of a load cell of
class 0.5, and less than 1 % of noise lets a few cycles show."""
LARGEST = 0.005
"""And as much of it may stand there in all: half a percent of peak is little for any damper."""
SILENT = 1e-6
"""Tests that can disagree on a parameter by less than this share of its variance say nothing of the sensors."""


@dataclass(frozen=True, eq=False)
class _Estimate:
    """A variance and the degrees of freedom behind it, each (p,)."""

    variance: Array
    freedom: Array


def half_widths(parts: Sequence[Part], misfit: Misfit, level: float = 0.95) -> Array:
    """Half widths of the two-sided intervals of a least-squares estimate.

    Equation: V = sum_t w' (Z_t + L N_t) w + N m^2 B, w a row of B = (J'J)^-1, Z_t between cycles, N_t of the sensors,
    m what the parameters may have absorbed; Student's t with the degrees of freedom of Satterthwaite
                                        Source: Liang and Zeger 1986; Satterthwaite 1946; L as in `_sensors`

    Parameters
    ----------
    parts : the records of the fit
    misfit : what the model misses in them
    level : of confidence

    Returns
    -------
    (p,) half widths, infinite for a parameter that the force does not depend on
    """
    from scipy.special import stdtrit

    size = np.sqrt(sum(np.sum(p.slopes**2, axis=0) for p in parts))
    unseen = size == 0.0
    size = np.where(unseen, 1.0, size)
    slopes = [p.slopes / size for p in parts]
    bread: Array = np.linalg.pinv(np.sum([s.T @ s for s in slopes], axis=0), rcond=1e-14, hermitian=True)
    noise = _noise(parts, slopes, bread)
    sensors = _sensors(parts, slopes, bread, noise)
    samples = sum(p.residuals.size for p in parts)
    missed = misfit.absorbed**2 * samples * np.diag(bread) + _faint(parts, slopes, bread)
    together = _sum([noise, sensors, _Estimate(missed, np.full(size.size, np.inf))])
    quantile = stdtrit(np.maximum(together.freedom, 1.0), 0.5 + 0.5 * level)
    widths: Array = quantile * np.sqrt(together.variance) / size
    return np.where(unseen, np.inf, widths)


def _faint(parts: Sequence[Part], slopes: Sequence[Array], bread: Array) -> Array:
    """(p,) variance by a force that grows with the square of the speed, too faint to show beside T0, C and k.

    Equation: V = (B J' g)^2 a^2, g = w |w|, a = min(faint / rms(g - J B J' g), largest / rms(g)), rms in shares of peak

    One sine shows hardly a tenth of it: C takes up the rest, four times what is left in force. Tests at several speeds
    show more, and less of it can hide.
    """
    # The slope by C is the speed of the flow; where the control signal moves, every node has a C and the rod stands in.
    speeds = [p.slopes[:, 1] if p.constant else p.record.velocity[p.counted] for p in parts]
    squares = [v * np.abs(v) for v in speeds]
    taken = bread @ np.sum([s.T @ g for s, g in zip(slopes, squares, strict=True)], axis=0)
    peaks = [float(np.max(np.abs(p.force))) for p in parts]
    left = [(g - s @ taken) / peak for s, g, peak in zip(slopes, squares, peaks, strict=True)]
    whole = [g / peak for g, peak in zip(squares, peaks, strict=True)]
    rms_left, rms_whole = (rms(np.concatenate(each)) for each in (left, whole))
    size = min(FAINT / max(rms_left, 1e-12 * rms_whole), LARGEST / rms_whole)
    return np.asarray((taken * size) ** 2)


def _sum(terms: Sequence[_Estimate]) -> _Estimate:
    """Independent variances added.

    Equation: nu = (sum V_i)^2 / sum (V_i^2 / nu_i)                 Source: Satterthwaite 1946
    """
    variance = sum((t.variance for t in terms), np.zeros_like(terms[0].variance))
    spread = sum((t.variance**2 / t.freedom for t in terms), np.zeros_like(variance))
    known = spread > 0.0
    return _Estimate(variance, np.where(known, variance**2 / np.where(known, spread, 1.0), np.inf))


def _noise(parts: Sequence[Part], slopes: Sequence[Array], bread: Array) -> _Estimate:
    """What the scatter between cycles, or between stretches, makes of the estimate."""
    nothing = _Estimate(np.zeros(len(bread)), np.full(len(bread), np.inf))
    terms, stretches, repeating = [nothing], [], []
    for part, slope in zip(parts, slopes, strict=True):
        if np.any(part.number >= 0):
            repeating.append((part, slope))
        else:
            stretches += _cut(part, slope)
    terms += [_between_cycles(part, slope, bread) for part, slope in repeating]
    if stretches:
        terms.append(_between_stretches(stretches, bread))
    return _sum(terms)


def _between_cycles(part: Part, slopes: Array, bread: Array) -> _Estimate:
    """What noise makes of the estimate by one record that repeats: whole cycles, whatever hangs together in one.

    Equation: V = N / N_c n / (n - 1) sum_j (u_j - mean u)^2, u_j = w' J_j' r_j over cycle j, N_c samples in n cycles
                                        Source: Liang and Zeger 1986, the score's mean over cycles taken off
    """
    inside = part.number >= 0
    count = int(part.number.max()) + 1
    pulls = np.zeros((count, len(bread)))
    np.add.at(pulls, part.number[inside], (slopes[inside] @ bread) * part.residuals[inside, None])
    scatter = np.sum((pulls - pulls.mean(axis=0)) ** 2, axis=0) * count / (count - 1)
    return _Estimate(scatter * inside.size / np.count_nonzero(inside), np.full(len(bread), count - 1.0))


def _cut(part: Part, slopes: Array) -> list[tuple[Array, Array]]:
    """Slopes and residuals of the stretches of a record that does not repeat."""
    turns = len(reversals(part.record.displacement[part.counted]))
    count = int(np.clip(turns // TURNS, *STRETCHES))
    pairs = zip(np.array_split(slopes, count), np.array_split(part.residuals, count), strict=True)
    return [(s, r) for s, r in pairs if r.size]


def _between_stretches(stretches: Sequence[tuple[Array, Array]], bread: Array) -> _Estimate:
    """What noise makes of the estimate by stretches that nothing repeats, their leverage allowed for.

    Equation: V = sum_g (w' J_g' A_g r_g)^2, A_g = (I - J_g B J_g')^(-1/2); nu = tr(M)^2 / tr(M^2)
                                        Source: Bell and McCaffrey 2002, Surv. Meth. 28
    """
    pulls, inner, outer = [], [], []
    for slopes, residuals in stretches:
        left, triangle = np.linalg.qr(slopes)
        values, vectors = np.linalg.eigh(triangle @ bread @ triangle.T)
        root = vectors / np.sqrt(np.maximum(1.0 - values, LEVERAGE)) @ vectors.T
        leaning = root @ triangle @ bread
        pulls.append((left.T @ residuals) @ leaning)
        inner.append(np.sum(leaning**2, axis=0))
        outer.append(triangle.T @ leaning)
    variance = np.sum(np.square(pulls), axis=0)
    freedom = np.empty(len(bread))
    for j in range(len(bread)):
        columns = np.stack([o[:, j] for o in outer])
        freedom[j] = _freedom(np.diag([i[j] for i in inner]) - columns @ bread @ columns.T)
    return _Estimate(variance, np.maximum(freedom, 1.0))


def _freedom(matrix: Array) -> float:
    """Degrees of freedom of a quadratic form in unit normal variables.

    Equation: nu = tr(M)^2 / tr(M^2)                                Source: Satterthwaite 1946
    """
    squares = float(np.sum(matrix**2))
    return float(np.trace(matrix)) ** 2 / squares if squares > 0.0 else 1.0


def _sensors(parts: Sequence[Part], slopes: Sequence[Array], bread: Array, noise: _Estimate) -> _Estimate:
    """What offset, gain and delay of each test make of the estimate: by their priors, corrected by the tests.

    Equation: L = (n_0 + n R) / (n_0 + n), R = (sum_t u_t^2 - noise) / sum_t E u_t^2, n = tr(M)^2 / tr(M^2)
    with u_t = w' J_t' r_t the pull of test t and M the covariance of the pulls by the priors
                                        Source: Bell and McCaffrey 2002 for R and n; L a weighted mean
    """
    count = len(bread)
    given = [(s.T @ p.nuisances) for s, p in zip(slopes, parts, strict=True)]
    grams = [s.T @ s for s in slopes]
    pulls = np.stack([(s.T @ p.residuals) @ bread for s, p in zip(slopes, parts, strict=True)])
    prior = np.sum([(g.T @ bread) ** 2 for g in given], axis=(0, 1))
    if len(parts) < 2:
        return _Estimate(prior, np.full(count, np.inf))
    variance, freedom = prior.copy(), np.full(count, np.inf)
    whole = np.sum([g @ g.T for g in given], axis=0)
    for j in range(count):
        covariance = _disagreement(given, grams, bread, whole, j)
        expected = float(np.trace(covariance))
        if expected <= SILENT * prior[j]:
            continue
        shown = _freedom(covariance)
        ratio = max(float(np.sum(pulls[:, j] ** 2)) - noise.variance[j], 0.0) / expected
        variance[j] *= (PRIOR_WORTH + shown * ratio) / (PRIOR_WORTH + shown)
        freedom[j] = (PRIOR_WORTH + shown) ** 2 / shown
    return _Estimate(variance, freedom)


def _disagreement(given: Sequence[Array], grams: Sequence[Array], bread: Array, whole: Array, j: int) -> Array:
    """(t, t) covariance of the pulls of the tests on parameter j, the fit having taken up what it could.

    Equation: u_t = w' z_t - w' G_t B sum_s z_s, z_t = J_t' (sensors of test t), G_t = J_t' J_t
    """
    row = bread[j]
    own = np.stack([g.T @ row for g in given])
    shared = np.stack([bread @ (g @ row) for g in grams])
    cross = np.stack([g @ o for g, o in zip(given, own, strict=True)]) @ shared.T
    found: Array = np.diag(np.sum(own**2, axis=1)) - cross - cross.T + shared @ whole @ shared.T
    return found


# ----------------------------------------------------------------------------------------------------
# Whether the data determine a parameter at all: how well, were the residuals nothing but noise of their own colour.
#
# The residuals of a rig record are correlated, so the textbook covariance is far too small. An
# autoregression fitted to the residuals of each record gives their covariance Omega, and with it
# the covariance of the ordinary least-squares estimate that the criterion asks for. What is shown as
# an interval allows for more: see intervals.py.


LARGEST_ORDER = 30
"""Largest order of the autoregression; the one used is chosen by BIC."""


@dataclass(frozen=True)
class Uncertainty:
    """How well the data pin the parameters down."""

    covariance: Array
    """(p, p) covariance of the estimates, correlation of the residuals allowed for."""
    degrees_of_freedom: float
    """Independent residuals less parameters, for Student's t."""

    def half_widths(self, level: float = 0.95) -> Array:
        """(p,) half widths of the two-sided intervals."""
        from scipy.special import stdtrit

        quantile = float(stdtrit(max(self.degrees_of_freedom, 1.0), 0.5 + 0.5 * level))
        return quantile * np.sqrt(np.diag(self.covariance))


def uncertainty(slopes: Array, residuals: Array, lengths: Sequence[int]) -> Uncertainty:
    """Covariance of a least-squares estimate whose residuals are correlated within each record.

    Equation: cov = (J'J)^-1 J' Omega J (J'J)^-1,  Omega = s2 A^-1 A^-T      Source: Box and Jenkins 1976, ch. 7

    Parameters
    ----------
    slopes : (N, p) J, derivatives of the model by the parameters
    residuals : (N,) measured less model
    lengths : samples of each record, in order; their sum is N

    Returns
    -------
    covariance with the small-sample factor N / (N - p), and degrees of freedom
    """
    size = np.linalg.norm(slopes, axis=0)
    unseen = size == 0.0
    size[unseen] = 1.0
    scaled = slopes / size
    bread = np.linalg.pinv(scaled.T @ scaled, rcond=1e-14, hermitian=True)
    meat = np.zeros((slopes.shape[1],) * 2)
    independent, start = 0.0, 0
    for length in lengths:
        part = slice(start, start + length)
        noise = autoregression([residuals[part]], LARGEST_ORDER)
        filtered = all_pole(noise.whitening_filter, scaled[part][::-1])
        meat += noise.innovation * filtered.T @ filtered
        independent += length * _independent_share(noise)
        start += length
    small_sample = start / max(start - slopes.shape[1], 1)
    covariance = small_sample * bread @ meat @ bread / np.outer(size, size)
    covariance[unseen, unseen] = np.inf
    return Uncertainty(covariance, independent - slopes.shape[1])


def _independent_share(noise: Autoregression) -> float:
    """Share of the samples that count as independent for the variance.

    Equation: (mean of P)^2 / mean of P^2, P the noise spectrum      Source: Bartlett 1946
    """
    spectrum = 1.0 / np.abs(np.fft.rfft(noise.whitening_filter, 4096)) ** 2
    return float(np.mean(spectrum) ** 2 / np.mean(spectrum**2))
