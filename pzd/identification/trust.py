"""Trust in T0, C and k: which of them the data determine, and what the Bingham model misses."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pzd.identification.bingham_fit import AT_ZERO, Bingham, Objective, ends_at_a_step
from pzd.identification.prepared_record import FittedRecord
from pzd.parallel.on_disk import one_at_a_time
from pzd.quantities import BINGHAM
from pzd.record import Array
from pzd.signals.jumps import jump_timing_error
from pzd.signals.lack_of_fit import cycles_tell_noise, fit_smooth_residual, p_values_by_harmonics, pooled_p_value
from pzd.signals.measures import SIGNIFICANCE, VISIBLE
from pzd.signals.noise import pure_error, repeatable_power
from pzd.signals.nuisance import NUISANCE_LIMIT, reducing_share

# --- Status of a row ---

SENSOR_ERROR = 0.005
"""Systematic force error that is always possible, as a share of r.m.s.: load cells are of class 0.5 at best."""
UNDETERMINED_SHARE = 0.5
"""Largest 95 % half width by noise alone, or shift by the sensor error, of a determined parameter, as a share of it.
What sensors and misfit add makes it weak: the data still have a value for it."""
WEAK_WIDTH = 0.1
"""Largest 95 % half width of a parameter that is not weak, as a share of it."""
WEAK_SHIFT = 0.2
"""Largest shift by the sensor error of a parameter that is not weak, as a share of it."""
FRICTION_FLOOR = 0.05
"""T0 is judged against itself or this share of the r.m.s. force, the larger: a friction of zero is a result. So is a
damping whose interval holds zero: it is judged by its force at peak speed."""
SPRING_TO_NOISE = 10.0
"""Least deflection of the oil spring at peak force, in the noise of the displacement, at which k is not weak: below,
the fit of k follows the noise."""
LARGEST_RESIDUAL = 0.2
"""Residual, as a share of the r.m.s. force, above which all parameters are weak."""
CONVERGENCE_COSINE = 1e-3
"""Largest cosine between the residuals and the sensitivity to a parameter at an optimum."""
EXACT_FIT = 1e-14
"""Criterion W_s below which the residual is rounding and the fit exact."""


@dataclass(frozen=True)
class ParameterEvidence:
    """Evidence of the data on one parameter."""

    name: str
    scale: float
    """Scale against which its uncertainty is judged [its unit]."""
    noise: float
    """Half width of the 95 % interval by noise of the colour of the residuals alone [its unit]."""
    half_width: float
    """Half width of the 95 % interval, sensors and misfit included [its unit]."""
    sensitivity: float
    """Change of force by one scale that no other parameter can replace, r.m.s. as a share of the r.m.s. force."""
    veto: str | None = None
    """Reason why it is undetermined whatever the numbers."""
    doubt: str | None = None
    """Reason why it is weak whatever the numbers."""
    shown: bool = False
    """Whether a model without it is rejected: however wide its interval, it has a value then."""

    def undetermined(self) -> str | None:
        """Return the reason why the data do not determine it, None where they do."""
        if self.veto:
            return self.veto
        return None if self.shown else self._unknown()

    def _unknown(self) -> str | None:
        """Return the reason why the numbers do not determine it, None where they do."""
        if self.sensitivity <= 0.0 < self.scale:
            return "the force does not depend on it, or another parameter makes it up"
        if self.shift > UNDETERMINED_SHARE and self.scale > 0.0:
            return f"a force error of {SENSOR_ERROR:.1%} may shift it by {_percent(self.shift)}"
        if self.scale == 0.0:
            return f"none to {self.half_width:.2g}, and these tests show no more of it"
        if not self.noise <= UNDETERMINED_SHARE * self.scale:
            return f"95 % interval of +-{_percent(self.noise / self.scale)} by noise alone"
        return None

    def weak(self) -> str | None:
        """Return the reason why it is weak, None where it is not."""
        if self.doubt:
            return self.doubt
        if self.shown and (reason := self._unknown()):
            return reason
        if self.half_width > WEAK_WIDTH * self.scale:
            return f"95 % interval of +-{_percent(self.half_width / self.scale)}"
        if self.shift > WEAK_SHIFT:
            return f"a force error of {SENSOR_ERROR:.1%} may shift it by {_percent(self.shift)}"
        return None

    @property
    def shift(self) -> float:
        """Largest relative shift by a force error of `SENSOR_ERROR`."""
        return SENSOR_ERROR / self.sensitivity if self.sensitivity > 0.0 else np.inf


def trust_of(evidence: Sequence[ParameterEvidence]) -> tuple[str, tuple[bool, ...]]:
    """Derive the status of a row from the evidence on its parameters.

    Returns
    -------
    `ok`, or `weak: ...`, `undetermined: ...` with the reason; and whether each parameter is determined, so that its
    value is shown
    """
    reasons = [e.undetermined() for e in evidence]
    weak = [None if reason else e.weak() for e, reason in zip(evidence, reasons, strict=True)]
    names = [e.name for e in evidence]
    clauses = [_clause("undetermined", names, reasons), _clause("weak", names, weak)]
    return "; ".join(clause for clause in clauses if clause) or "ok", tuple(reason is None for reason in reasons)


def _clause(word: str, names: Sequence[str], reasons: Sequence[str | None]) -> str:
    """Return one clause of the status: the parameters concerned and the reasons, said once where they are alike."""
    named = [(n, r) for n, r in zip(names, reasons, strict=True) if r]
    if not named:
        return ""
    alike = len({reason for _, reason in named}) == 1
    detail = named[0][1] if alike else "; ".join(f"{n}: {r}" for n, r in named)
    return f"{word}: {', '.join(n for n, _ in named)} ({detail})"


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %" if share < 10.0 else "more than 1000 %"


# --- Evidence on each parameter ---

PARAMETER_NAMES = tuple(quantity.symbol for quantity in BINGHAM)
TARE = 0.3
"""Mean force, as a share of the r.m.s., above which a tare of the load cell is suggested."""


@dataclass(frozen=True)
class Reservation:
    """What speaks against T0, C or k whatever its interval."""

    veto: str | None
    """Reason why it is undetermined."""
    doubt: str | None
    """Reason why it is weak."""
    shown: bool
    """Whether a model without it is rejected."""


def reservations(
    objective: Objective,
    parameters: Bingham,
    criterion: float,
    unsettled: Sequence[bool],
    misfit: Misfit,
    stiffest: float | None = None,
) -> tuple[Reservation, ...]:
    """Tell what speaks against T0, C and k whatever their intervals.

    Parameters
    ----------
    objective : the data
    parameters : the optimum
    criterion : W_s there
    unsettled : of each whether the criterion still falls along it
    misfit : of the model
    stiffest : stiffness from which on the tests do not tell k from infinity [N/m]; None where it was not looked for
    """
    vetoes = [
        f"at a bound of the search{_tare_hint(objective)}"
        if bounded
        else "the search did not converge"
        if moving
        else None
        for bounded, moving in zip(objective.at_bounds(parameters), unsettled, strict=True)
    ]
    doubt = _doubt(float(np.sqrt(criterion)), misfit)
    doubts = [doubt, doubt, doubt]
    if veto := stiffness_veto(stiffest):
        vetoes[2] = veto
    else:
        doubts[2] = doubt or _noise_hides_stiffness(objective, parameters)
    shown = [name == "k" and stiffest == np.inf for name in PARAMETER_NAMES]
    return tuple(Reservation(*each) for each in zip(vetoes, doubts, shown, strict=True))


def stiffness_veto(stiffest: float | None) -> str | None:
    """Return the reason why k has a lower bound alone, which is given [N/m]; None where it has none or is infinite."""
    if stiffest is None or np.isinf(stiffest):
        return None
    return f"above {stiffest:.2g} N/m, and these tests show no more of it"


def friction_scale(friction: float, force_rms: float) -> float:
    """Return the scale of T0 [N], from it and the r.m.s. force [N]."""
    return max(friction, FRICTION_FLOOR * force_rms)


def parameter_scales(parameters: Bingham, widths: Array, force_rms: float, speed: float) -> Array:
    """Return the scales (3,) of T0 [N], C [N s/m] and 1/k [m/N].

    Parameters
    ----------
    parameters : T0, C and k
    widths : (3,) half widths of their 95 % intervals
    force_rms : of the tests [N]
    speed : largest of the tests [m/s]
    """
    friction, damping, stiffness = parameters
    may_be_none = damping <= widths[1] < np.inf
    least = friction_scale(0.0, force_rms) / speed if may_be_none else 0.0
    return np.array([friction_scale(friction, force_rms), max(damping, least), 1.0 / stiffness])


def partial_sensitivities(gram: Array, scales: Array, energy: float) -> Array:
    """Compute the sensitivity of the force to each parameter that no other parameter can replace.

    Equation: s_j = scale_j / sqrt([(J'J)^-1]_jj sum F^2)      Source: partial regression

    Parameters
    ----------
    gram : (p, p) J'J of the derivatives of the force by the parameters
    scales : (p,) change of each parameter
    energy : sum of F^2 over the samples concerned [N2]

    Returns
    -------
    (p,) shares of the r.m.s. force, 0 where the slopes are linearly dependent
    """
    size = np.sqrt(np.diag(gram)) * np.abs(scales)
    unit = scales / np.where(size > 0.0, size, 1.0)
    gram = gram * np.outer(unit, unit)
    shares = np.zeros(size.size)
    for j in range(size.size):
        others = np.delete(np.arange(size.size), j)
        solved = np.linalg.lstsq(gram[np.ix_(others, others)], gram[others, j], rcond=1e-12)[0]
        shares[j] = np.sqrt(max(float(gram[j, j] - gram[others, j] @ solved), 0.0)) * size[j]
    return np.asarray(shares / np.sqrt(energy))


def stationarity(gram: Array, pull: Array, squares: float, energy: float) -> Array:
    """Compute the cosine (p,) between the residuals and each slope, which is 0 at an optimum.

    Parameters
    ----------
    gram : (p, p) J'J of the slopes
    pull : (p,) J'r
    squares : r'r [N2]
    energy : sum of F^2 over the samples concerned [N2]
    """
    size = np.sqrt(np.diag(gram) * squares)
    if squares <= EXACT_FIT * energy:
        return np.zeros(size.size)
    return np.asarray(np.abs(pull) / np.where(size > 0.0, size, 1.0))


def displacement_noise(displacement: Array) -> float:
    """Estimate the white noise of a sampled displacement from its third differences [m].

    Equation: sigma = q90(|third difference|) / (1.645 sqrt(20))      Source: variance of 1, -3, 3, -1 is 20
    """
    if displacement.size < 8:
        return 0.0
    return float(np.quantile(np.abs(np.diff(displacement, 3)), 0.9) / (1.645 * np.sqrt(20.0)))


OF_THE_MODEL = "the parameters are the model's, not the damper's"
"""What a misfit makes of the parameters, for statuses."""
NOT_CONVERGED = "the least squares have not converged"
"""Why a row is not `ok` whose fit ended before its optimum."""


def _doubt(left: float, misfit: Misfit) -> str | None:
    """Return the reason why all parameters are weak, however narrow their intervals: the model lacks something."""
    reasons = []
    if misfit.is_large:
        reasons.append(f"the model misses {misfit.share:.1%} of peak: {OF_THE_MODEL}")
    if left > LARGEST_RESIDUAL:
        reasons.append(f"the model leaves {left:.0%} of the force's r.m.s.")
    return "; ".join(reasons) or None


def not_converged(objective: Objective, parameters: Bingham, cosines: Array, *, whole: bool) -> list[bool]:
    """Tell for each parameter whether the criterion still falls along it; at a limit of the law it may.

    Where a friction turns within few samples, the criterion over k has a step wherever one more sample changes sides.
    At the edge of a step no slope is zero, and that is the optimum if the criterion falls no further.

    Parameters
    ----------
    objective : the data
    parameters : the optimum
    cosines : (3,) of `stationarity`
    whole : whether T0, C and k are all that was fitted to these data
    """
    x = objective.coordinates.to_search(*parameters)
    moving = [c > CONVERGENCE_COSINE and at > AT_ZERO for c, at in zip(cosines.tolist(), x.tolist(), strict=True)]
    return moving if any(moving) and not (whole and ends_at_a_step(objective, parameters)) else [False] * len(moving)


def _tare_hint(objective: Objective) -> str:
    """Return a hint where the force has a mean, which the element cannot have."""
    mean = float(np.mean(objective.measured))
    if mean**2 <= TARE**2 * objective.energy / objective.measured.size:
        return ""
    return f"; the force has a mean of {mean:.0f} N, a tare of the load cell?"


def _noise_hides_stiffness(objective: Objective, parameters: Bingham) -> str | None:
    """Return the reason where noise of the displacement hides the oil spring, else None."""
    noise = max(displacement_noise(t.at_samples(t.displacement)) for t in one_at_a_time(objective.prepared))
    spring = objective.scales[0] / parameters.stiffness
    if spring >= SPRING_TO_NOISE * noise:
        return None
    return f"the spring gives by {1e6 * spring:.1f} um at peak force, the displacement's noise is {1e6 * noise:.1f} um"


# --- Lack of fit ---
#
# Adjacent cycles of a record that repeats differ by noise alone, and its average cycle of the residual shows what the
# model misses: lack of fit against pure error. Where nothing repeats, a smooth function of motion and force takes up
# the misfit and leaves the noise. What offset, gain and delay of the tests explain within their priors is projected out
# first, together with the change of T0, C and k that goes with it. Records whose control signal moves are not judged,
# for a lag of the valve looks like any misfit; diagnose looks at them.

ABSORPTION = 2.0
"""Force that T0, C and k absorb of a missing effect, over what is left of it: for the effects of the library up to
about four, along the parameter that suffers most (C beside a quadratic orifice); half of that, since an interval adds
another factor of two."""
WIDENING_LIMIT = 0.01
"""Largest misfit that widens an interval, as a share of peak force. Beyond it the status says that the parameters are
the model's: where a tenth of the force is missed, an interval that held the damper's own would run from nothing to a
hundred times as much and tell nothing. Up to a hidden effect of 5 % of peak it holds them with this."""


@dataclass(frozen=True, eq=False)
class Misfit:
    """Misfit of the model over the records of one fit."""

    share: float
    """R.m.s. misfit as a share of the peak force of each record; 0 where noise alone may explain it."""
    force: float
    """R.m.s. misfit [N]."""

    @property
    def is_large(self) -> bool:
        """Whether the misfit is so large that T0, C and k are no longer the damper's."""
        return self.share >= VISIBLE

    @property
    def absorbed(self) -> float:
        """R.m.s. force that the parameters may have absorbed in error [N], limited by `WIDENING_LIMIT`."""
        return ABSORPTION * self.force * min(1.0, WIDENING_LIMIT / self.share) if self.share > 0.0 else 0.0


def misfit_of(records: Sequence[FittedRecord]) -> Misfit:
    """Estimate the misfit of the model in the records of a fit.

    Equation: p = 2 min over both kinds of record of the probability by noise, pooled over the records
                            Source: Fisher's variance ratio, see `pzd.signals.lack_of_fit`; Bonferroni
    """
    cycles: list[Array] = []
    smooth: list[Array] = []
    power, samples, peaks = [], [], []
    for record, cleared in one_at_a_time(zip(records, _without_nuisances(records), strict=True)):
        if not record.constant:
            continue
        folded = record.folded(cleared)
        if folded is None or not cycles_tell_noise(*folded.shape):
            still = replace(record.record, voltage=None)  # constant but for noise, which is no regressor
            fit = fit_smooth_residual(cleared, still, record.force - record.residuals, record.counted)
            smooth.append(np.array([fit.probability]))
            power.append(float(np.mean(fit.explained**2 - fit.spread)))
        else:
            error = pure_error(folded)
            cycles.append(p_values_by_harmonics(error))
            power.append(float(repeatable_power(error).sum()))
        samples.append(record.residuals.size)
        peaks.append(float(np.max(np.abs(record.force))))
    kinds = [kind for kind in (cycles, smooth) if kind]
    if not kinds or len(kinds) * min(pooled_p_value(kind) for kind in kinds) >= SIGNIFICANCE:
        return Misfit(0.0, 0.0)
    weights = np.array(samples) / sum(samples)
    return Misfit(_root(weights @ (np.array(power) / np.array(peaks) ** 2)), _root(weights @ np.array(power)))


def _root(square: float) -> float:
    return float(np.sqrt(max(square, 0.0)))


def _without_nuisances(records: Sequence[FittedRecord]) -> Iterator[Array]:
    """Project offset, gain and delay out of the residual (m,) of each record, the parameters free to follow.

    Equation: min_d,b sum_t |r_t - J_t d - A_t b_t|^2 / s_t^2 + |b_t|^2, |b| <= 3.5         Source: Gaussian prior
    """
    from scipy.optimize import lsq_linear

    size = records[0].slopes.shape[1]
    scale = np.sqrt(sum(np.sum(r.slopes**2, axis=0) for r in one_at_a_time(records)))
    scale[scale == 0.0] = 1.0
    whole = size + sum(r.nuisances.shape[1] for r in records)
    normal, right = np.zeros((whole, whole)), np.zeros(whole)
    places, at = [], size

    def columns(record: FittedRecord) -> Array:
        return np.hstack([record.slopes / scale, record.nuisances])

    for record in one_at_a_time(records):
        both, place = columns(record), np.r_[:size, at : at + record.nuisances.shape[1]]
        calm, noise = (slice(None) if record.calm.all() else record.calm), _noise_variance(record)
        normal[np.ix_(place, place)] += both[calm].T @ both[calm] / noise
        right[place] += both[calm].T @ record.residuals[calm] / noise
        places.append(place)
        at += record.nuisances.shape[1]
    normal[np.diag_indices(whole)] += np.where(np.arange(whole) < size, 1e-12 * np.trace(normal), 1.0)
    triangle = np.linalg.cholesky(normal).T
    limit = np.where(np.arange(whole) < size, np.inf, NUISANCE_LIMIT)
    found = lsq_linear(triangle, np.linalg.solve(triangle.T, right), (-limit, limit)).x
    # The columns of all records at a time would be the most that a fit of many keeps in memory.
    for record, place in zip(records, places, strict=True):
        yield _without_explained(record, columns(record) @ found[place])


def _without_explained(record: FittedRecord, explained: Array) -> Array:
    """Return the residual (m,) less the explained part, and less the timing of jumps, which is chance.

    Beside a jump no sample entered the estimate: there what is explained counts where it leaves less.
    """
    explained = reducing_share(record.residuals[record.calm], explained[record.calm]) * explained
    predicted = record.force - record.residuals
    left = record.residuals - explained
    beside = [each - jump_timing_error(predicted + each, predicted) for each in (record.residuals, left)]
    return np.where(record.calm, left, np.where(np.abs(beside[0]) <= np.abs(beside[1]), *beside))


def _noise_variance(record: FittedRecord) -> float:
    """Return the variance of the noise, roughly: it only weighs the priors."""
    folded = record.folded(record.residuals)
    steps = np.diff(record.residuals) if folded is None else np.diff(folded, axis=0)
    return max(float(np.mean(steps**2)) / 2.0, 1e-12 * float(np.max(record.force**2)))
