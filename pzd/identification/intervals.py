"""95 % intervals of T0, C and k.

Three sources move an estimate. Noise: the scatter between cycles that ought to be equal, or, where nothing repeats,
between stretches of a record. Sensors: offset, gain and delay of the force differ from test to test, and no cycle
shows it; their prior standard deviations, or those that all tests of the rig show where these are smaller, are
propagated through the fit and corrected by how far the tests of the fit disagree. Misfit: a lack of fit beyond noise
(`pzd.identification.trust`), and in any case a hidden law too faint for any test, which C absorbs on a single sine.
Were the tests repeated on the same damper with the sensors mounted anew, 95 of 100 such intervals would hold the
model's mean parameters. Where the model lacks nothing these are the damper's own; otherwise the status says that they
are not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pzd.fit.intervals import CONFIDENCE, UNINFORMATIVE, inverse_normal, student_quantile
from pzd.fit.spread import PRIOR_WORTH, NuisanceEquations, nuisance_equations
from pzd.identification.prepared_record import FittedRecord
from pzd.identification.trust import Misfit
from pzd.parallel.on_disk import beside, one_at_a_time
from pzd.record import Array, Labels, Mask
from pzd.signals.measures import reversals
from pzd.signals.noise import Autoregression, all_pole, autoregression

TURNS_PER_STRETCH = 4
"""Reversals in a stretch of a record that does not repeat: two full cycles outlast the correlation of the noise."""
STRETCH_COUNT = (4, 24)
"""Fewest and most stretches of one record."""
AS_BEFOREHAND = np.ones(3)
"""Spread of offset, gain and delay as the prior has it: no tests of the stand have shown a smaller one."""
LEVERAGE_FLOOR = 1e-3
"""Least share of the residual that leverage leaves: a parameter that depends on one stretch alone leaves none there."""
HIDDEN_FORCE = 5e-4
"""Largest residual of a hidden law that no test shows, r.m.s. as a share of peak: a tenth of the error of a load cell
of class 0.5, and less than a few cycles show under 1 % of noise."""
HIDDEN_FORCE_LIMIT = 0.005
"""Largest force of the hidden law, r.m.s. as a share of peak: half a percent is little for any damper."""


@dataclass(frozen=True, eq=False)
class _Variance:
    """A variance of each parameter and its degrees of freedom, each (p,)."""

    variance: Array
    freedom: Array


@dataclass(frozen=True, eq=False)
class Pulls:
    """Products of slopes, residuals and sensor errors of t tests, from which their pull on p parameters follows."""

    by_sensors: Array
    """(t, p, 3) J_t' N_t, N_t the force by one prior standard deviation of offset, gain and delay."""
    grams: Array
    """(t, p, p) J_t' J_t."""
    left: Array
    """(t, p) J_t' r_t."""
    bread: Array
    """(p, p) B = (J'J)^-1."""


@dataclass(frozen=True, eq=False)
class VarianceSources:
    """Variance of p parameters by source, kept so that the spread of the sensors can still be chosen."""

    size: Array
    """(p,) size of the slopes, in units of which the variances are."""
    unseen: Mask
    """(p,) the parameters that the force does not depend on."""
    noise: _Variance
    pulls: Pulls
    missed: Array
    """(p,) variance by what the model misses, and by a hidden law that no test shows."""

    def half_widths(self, level: float = CONFIDENCE, spread: Array = AS_BEFOREHAND) -> Array:
        """Compute the half widths (p,) of the two-sided intervals, infinite where the force does not depend on it.

        Equation: V = sum_t w' (Z_t + L N_t) w + N m^2 B, w a row of B = (J'J)^-1, Z_t between cycles, N_t of the
        sensors, m the force that the parameters may have absorbed; Student's t with the degrees of freedom of
        Satterthwaite
                                        Source: Liang and Zeger 1986; Satterthwaite 1946; L as in `_sensor_variance`

        Parameters
        ----------
        level : of confidence
        spread : (3,) of offsets, gains and delays on this stand, as a share of their prior
        """
        sensors = _sensor_variance(replace(self.pulls, by_sensors=self.pulls.by_sensors * spread), self.noise)
        exact = np.full(self.size.size, np.inf)
        together = _sum_of_variances([self.noise, sensors, _Variance(self.missed, exact)])
        quantile = student_quantile(together.freedom, 0.5 + 0.5 * level)
        return np.where(self.unseen, np.inf, quantile * np.sqrt(together.variance) / self.size)


def half_widths(records: Sequence[FittedRecord], misfit: Misfit, level: float = CONFIDENCE) -> Array:
    """Compute the half widths of the two-sided intervals of a least-squares estimate, sensors as beforehand.

    Parameters
    ----------
    records : of the fit
    misfit : of the model in them
    level : of confidence

    Returns
    -------
    (p,) half widths, infinite for a parameter that the force does not depend on
    """
    return variance_sources(records, misfit).half_widths(level)


def variance_sources(records: Sequence[FittedRecord], misfit: Misfit) -> VarianceSources:
    """Collect the variances of a least-squares estimate by noise, by the sensors, and by what the model misses.

    Parameters
    ----------
    records : of the fit
    misfit : of the model in them
    """
    size = np.sqrt(sum(np.sum(r.slopes**2, axis=0) for r in one_at_a_time(records)))
    unseen = size == 0.0
    size = np.where(unseen, 1.0, size)
    slopes = [beside(r.slopes / size, r.record.force) for r in one_at_a_time(records)]
    grams = [s.T @ s for s in one_at_a_time(slopes)]
    bread = inverse_normal(np.sum(grams, axis=0))
    noise = _noise_variance(records, slopes, bread)
    pairs = list(zip(slopes, records, strict=True))
    pulls = Pulls(
        np.stack([s.T @ r.nuisances for s, r in one_at_a_time(pairs)]),
        np.stack(grams),
        np.stack([s.T @ r.residuals for s, r in one_at_a_time(pairs)]),
        bread,
    )
    samples = sum(r.residuals.size for r in records)
    missed = misfit.absorbed**2 * samples * np.diag(bread) + _hidden_law_variance(records, slopes, bread)
    return VarianceSources(size, unseen, noise, pulls, missed)


def _sum_of_variances(terms: Sequence[_Variance]) -> _Variance:
    """Add independent variances.

    Equation: nu = (sum V_i)^2 / sum (V_i^2 / nu_i)                 Source: Satterthwaite 1946
    """
    variance = sum((t.variance for t in terms), np.zeros_like(terms[0].variance))
    spread = sum((t.variance**2 / t.freedom for t in terms), np.zeros_like(variance))
    known = spread > 0.0
    return _Variance(variance, np.where(known, variance**2 / np.where(known, spread, 1.0), np.inf))


# --- Noise ---


def _noise_variance(records: Sequence[FittedRecord], slopes: Sequence[Array], bread: Array) -> _Variance:
    """Return the variance by noise: of the scatter between cycles, or between stretches."""
    nothing = _Variance(np.zeros(len(bread)), np.full(len(bread), np.inf))
    terms, stretches, repeating = [nothing], [], []
    for record, slope in one_at_a_time(zip(records, slopes, strict=True)):
        if np.any(record.number >= 0):
            repeating.append((record, slope))
        else:
            stretches += _stretches(record, slope)
    terms += [_between_cycles(record, slope, bread) for record, slope in one_at_a_time(repeating)]
    if stretches:
        terms.append(_between_stretches(stretches, bread))
    return _sum_of_variances(terms)


def _between_cycles(record: FittedRecord, slopes: Array, bread: Array) -> _Variance:
    """Return the variance by the scatter between whole cycles of one record, whatever the correlation within a cycle.

    Equation: V = N / N_c n / (n - 1) sum_j (u_j - mean u)^2, u_j = w' J_j' r_j over cycle j, N_c samples in n cycles
                                        Source: Liang and Zeger 1986, the score's mean over cycles taken off
    """
    inside = record.number >= 0
    count = int(record.number.max()) + 1
    pulls = np.zeros((count, len(bread)))
    np.add.at(pulls, record.number[inside], (slopes[inside] @ bread) * record.residuals[inside, None])
    scatter = np.sum((pulls - pulls.mean(axis=0)) ** 2, axis=0) * count / (count - 1)
    return _Variance(scatter * inside.size / np.count_nonzero(inside), np.full(len(bread), count - 1.0))


def _stretches(record: FittedRecord, slopes: Array) -> list[tuple[Array, Array]]:
    """Split the slopes and residuals of a record that does not repeat into stretches."""
    turns = len(reversals(record.record.displacement[record.counted]))
    count = int(np.clip(turns // TURNS_PER_STRETCH, *STRETCH_COUNT))
    pairs = zip(np.array_split(slopes, count), np.array_split(record.residuals, count), strict=True)
    return [(s, r) for s, r in pairs if r.size]


def _between_stretches(stretches: Sequence[tuple[Array, Array]], bread: Array) -> _Variance:
    """Return the variance by the scatter between stretches that do not repeat, corrected for leverage.

    Equation: V = sum_g (w' J_g' A_g r_g)^2, A_g = (I - J_g B J_g')^(-1/2); nu = tr(M)^2 / tr(M^2)
                                        Source: Bell and McCaffrey 2002, Surv. Meth. 28
    """
    pulls, inner, outer = [], [], []
    for slopes, residuals in stretches:
        left, triangle = np.linalg.qr(slopes)
        values, vectors = np.linalg.eigh(triangle @ bread @ triangle.T)
        root = vectors / np.sqrt(np.maximum(1.0 - values, LEVERAGE_FLOOR)) @ vectors.T
        leaning = root @ triangle @ bread
        pulls.append((left.T @ residuals) @ leaning)
        inner.append(np.sum(leaning**2, axis=0))
        outer.append(triangle.T @ leaning)
    variance = np.sum(np.square(pulls), axis=0)
    freedom = np.empty(len(bread))
    for j in range(len(bread)):
        columns = np.stack([o[:, j] for o in outer])
        freedom[j] = _degrees_of_freedom(np.diag([i[j] for i in inner]) - columns @ bread @ columns.T)
    return _Variance(variance, np.maximum(freedom, 1.0))


def _degrees_of_freedom(matrix: Array) -> float:
    """Return the degrees of freedom of a quadratic form in unit normal variables.

    Equation: nu = tr(M)^2 / tr(M^2)                                Source: Satterthwaite 1946
    """
    squares = float(np.sum(matrix**2))
    return float(np.trace(matrix)) ** 2 / squares if squares > 0.0 else 1.0


# --- Sensors ---


def _sensor_variance(tests: Pulls, noise: _Variance) -> _Variance:
    """Return the variance by offset, gain and delay of each test: by their priors, corrected by the disagreement.

    Equation: L = (n_0 + n R) / (n_0 + n), R = (sum_t u_t^2 - noise) / sum_t E u_t^2, n = tr(M)^2 / tr(M^2)
    with u_t = w' J_t' r_t the pull of test t and M the covariance of the pulls by the priors
                                        Source: Bell and McCaffrey 2002 for R and n; L a weighted mean

    So the spread of the sensors is estimated within its prior: that of the prior for one test, that of the tests for
    many. In the degrees of freedom, (n_0 + n)^2 / n, the prior counts as exact: where sensors spread as it says, 95 of
    100 intervals hold the truth for any number of tests. Were it as vague as its weight, n_0 + n, those of one test
    would be 1.4 times as wide and hold it in 99.
    """
    count, given = len(tests.bread), tests.by_sensors
    pulls = tests.left @ tests.bread
    prior = np.sum((given.transpose(0, 2, 1) @ tests.bread) ** 2, axis=(0, 1))
    if len(given) < 2:
        return _Variance(prior, np.full(count, np.inf))
    variance, freedom = prior.copy(), np.full(count, np.inf)
    for j in range(count):
        covariance = _covariance_of_pulls(tests, j)
        expected = float(np.trace(covariance))
        if expected <= UNINFORMATIVE * prior[j]:
            continue
        shown = _degrees_of_freedom(covariance)
        ratio = max(float(np.sum(pulls[:, j] ** 2)) - noise.variance[j], 0.0) / expected
        variance[j] *= (PRIOR_WORTH + shown * ratio) / (PRIOR_WORTH + shown)
        freedom[j] = (PRIOR_WORTH + shown) ** 2 / shown
    return _Variance(variance, freedom)


def _covariance_of_pulls(tests: Pulls, j: int) -> Array:
    """Return the covariance (t, t) of the pulls of the tests on parameter j, after the fit has absorbed its share.

    Equation: u_t = w' z_t - w' G_t B sum_s z_s, z_t = J_t' (sensors of test t), G_t = J_t' J_t
    """
    given, row = tests.by_sensors, tests.bread[j]
    whole = np.sum(given @ given.transpose(0, 2, 1), axis=0)
    own = np.einsum("tpk,p->tk", given, row)
    shared = (tests.grams @ row) @ tests.bread
    cross = np.einsum("tpk,tk->tp", given, own) @ shared.T
    return np.asarray(np.diag(np.sum(own**2, axis=1)) - cross - cross.T + shared @ whole @ shared.T)


LEAST_NOISE = 1e-6
"""Least noise that tests are weighed by, as a share of the peak force: beneath it is the rounding of a fit."""


def nuisance_equations_of(records: Sequence[FittedRecord]) -> NuisanceEquations:
    """Return the normal equations of offset, gain and delay of every test of a fit, its parameters eliminated.

    Each test is weighed by the noise of what neither these nor the parameters explain. Samples beside a jump of the
    force are left out.

    Parameters
    ----------
    records : of the fit
    """
    own, shared, left = [], [], []
    for record in one_at_a_time(records):
        calm = record.calm[:, None]
        columns = np.hstack([record.nuisances, record.slopes, record.residuals[:, None]]) * calm
        size = np.linalg.norm(columns[:, :-1], axis=0)
        basis = np.linalg.qr(columns[:, :-1][:, size > 0.0] / size[size > 0.0])[0]
        rest = columns[:, -1] - basis @ (basis.T @ columns[:, -1])
        noise, least = autoregression([rest], LARGEST_ORDER), LEAST_NOISE * float(np.max(np.abs(record.force)))
        if noise.innovation < least**2:
            noise = Autoregression(np.zeros(0), least**2)
        white = noise.whitened(columns)
        kinds = record.nuisances.shape[1]
        own.append(white[:, :kinds])
        shared.append(white[:, kinds:-1])
        left.append(white[:, -1])
    return nuisance_equations(own, shared, left)


# --- Hidden law ---


def _hidden_law_variance(records: Sequence[FittedRecord], slopes: Sequence[Array], bread: Array) -> Array:
    """Return the variance (p,) by a force quadratic in the speed, too faint to be found beside T0, C and k.

    As much as that is possible either way, and no more: of a number between limits alone the interval of a normal one
    with its variance holds all there is, 1.96 / sqrt(3) = 1.13 times the limit.

    Equation: V = (B J' g)^2 a^2 / 3, g = w |w|, a = min(5e-4 / rms(g - J B J' g), 5e-3 / rms(g)), rms in shares of peak
                                                            Source: uniform between -a and a, JCGM 100:2008, 4.3.7

    One sine shows hardly a tenth of it: C absorbs the rest, four times the residual in force. Tests at several speeds
    show more, and less of it can hide.
    """

    def hidden(record: FittedRecord) -> Array:
        # The slope by C is the speed of the flow; where the control signal moves, every node has a C: use the rod's.
        v = record.slopes[:, 1] if record.constant else record.record.velocity[record.counted]
        return np.asarray(v * np.abs(v))

    taken = bread @ np.sum([s.T @ hidden(r) for s, r in one_at_a_time(zip(slopes, records, strict=True))], axis=0)
    squares, samples = np.zeros(2), 0
    for s, r in one_at_a_time(zip(slopes, records, strict=True)):
        whole, peak = hidden(r), float(np.max(np.abs(r.force)))
        squares += [float(np.sum((each / peak) ** 2)) for each in (whole - s @ taken, whole)]
        samples += whole.size
    rms_left, rms_whole = np.sqrt(squares / samples).tolist()
    if rms_whole == 0.0:  # nothing flows, by no law
        return np.zeros(bread.shape[0])
    size = min(HIDDEN_FORCE / max(rms_left, 1e-12 * rms_whole), HIDDEN_FORCE_LIMIT / rms_whole)
    return np.asarray((taken * size) ** 2 / 3.0)


# --- Noise alone: do the data determine a parameter? ---
#
# Residuals of a rig record are correlated, so the textbook covariance is far too small. An autoregression of each
# record's residuals gives their covariance Omega, and with it that of the ordinary least-squares estimate.

LARGEST_ORDER = 30
"""Largest order of the autoregression; BIC chooses the order."""


@dataclass(frozen=True)
class Uncertainty:
    """Uncertainty of an estimate by correlated noise alone."""

    covariance: Array
    """(p, p) covariance of the estimates."""
    degrees_of_freedom: float
    """Independent residuals less parameters, for Student's t."""

    def half_widths(self, level: float = CONFIDENCE) -> Array:
        """Return the half widths (p,) of the two-sided intervals."""
        quantile = student_quantile(self.degrees_of_freedom, 0.5 + 0.5 * level)
        return np.asarray(quantile * np.sqrt(np.diag(self.covariance)))


def uncertainty(records: Sequence[tuple[Array, Array]]) -> Uncertainty:
    """Compute the covariance of a least-squares estimate whose residuals are correlated within each record.

    Equation: cov = (J'J)^-1 J' Omega J (J'J)^-1,  Omega = s2 A^-1 A^-T      Source: Box and Jenkins 1976, ch. 7

    Parameters
    ----------
    records : (m, p) J, derivatives of the model by the parameters, and (m,) measured less model, of each

    Returns
    -------
    covariance with the small-sample factor N / (N - p), and degrees of freedom
    """
    size = np.sqrt(np.sum([np.sum(slopes**2, axis=0) for slopes, _ in one_at_a_time(records)], axis=0))
    unseen = size == 0.0
    size[unseen] = 1.0
    bread, meat = np.zeros((size.size,) * 2), np.zeros((size.size,) * 2)
    independent, samples = 0.0, 0
    for slopes, residuals in one_at_a_time(records):
        scaled = slopes / size
        noise = autoregression([residuals], LARGEST_ORDER)
        filtered = all_pole(noise.whitening_filter, scaled[::-1])
        bread += scaled.T @ scaled
        meat += noise.innovation * filtered.T @ filtered
        independent += residuals.size * _independent_share(noise)
        samples += residuals.size
    bread = inverse_normal(bread)
    small_sample = samples / max(samples - size.size, 1)
    covariance = small_sample * bread @ meat @ bread / np.outer(size, size)
    covariance[unseen, unseen] = np.inf
    return Uncertainty(covariance, independent - size.size)


def _independent_share(noise: Autoregression) -> float:
    """Return the share of the samples that are independent for the variance.

    Equation: (mean of P)^2 / mean of P^2, P the noise spectrum      Source: Bartlett 1946
    """
    spectrum = 1.0 / np.abs(np.fft.rfft(noise.whitening_filter, 4096)) ** 2
    return float(np.mean(spectrum) ** 2 / np.mean(spectrum**2))


# --- Columns of rows ---


def label_columns(labels: Labels) -> dict[str, Any]:
    """Return the columns that name a condition: setting, voltage, temperature."""
    return dict(zip(("setting", "voltage_V", "temperature_degC"), labels, strict=True))


def interval_columns(
    name: str, value: float | None, width: float | None, scale: str, widest: float = np.inf
) -> dict[str, float | None]:
    """Return the columns of a value and its 95 % interval.

    Parameters
    ----------
    name : of the column
    value : None where undetermined
    width : half width of the interval, None where there is none
    scale : on which the interval is symmetric: `linear`, `positive` (linear, cut at zero), `inverse` (that of the
        inverse, whose width is given; it may have no upper end) or `log`
    widest : largest half width on the logarithmic scale

    Examples
    --------
    >>> interval_columns("T0_N", 100.0, 120.0, "positive")
    {'T0_N': 100.0, 'T0_N_low95': 0.0, 'T0_N_high95': 220.0}
    """
    if value is None or width is None:
        return {name: None, f"{name}_low95": None, f"{name}_high95": None}
    if scale == "log":
        ratio = float(np.exp(min(width / value, widest)))
        low, high = value / ratio, value * ratio
    elif scale == "inverse":
        least = 1.0 / value - width
        return {
            name: value,
            f"{name}_low95": 1.0 / (1.0 / value + width),
            f"{name}_high95": 1.0 / least if least > 0.0 else None,
        }
    else:
        low, high = value - width, value + width
        low = max(low, 0.0) if scale == "positive" else low
    return {name: value, f"{name}_low95": low, f"{name}_high95": high}
