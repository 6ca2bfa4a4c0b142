"""Trust in T0, C and k: which of them the data determine, and what the Bingham model misses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pzd.identification.bingham_fit import Bingham, Objective
from pzd.identification.prepared_record import FittedRecord
from pzd.record import Array
from pzd.signals.jumps import jump_timing_error
from pzd.signals.lack_of_fit import fit_smooth_residual, p_values_by_harmonics, pooled_p_value
from pzd.signals.measures import rms
from pzd.signals.noise import pure_error, repeatable_power
from pzd.signals.nuisance import NUISANCE_LIMIT

# --- Status of a row ---

SENSOR_ERROR = 0.005
"""A systematic force error of this share of r.m.s. is always possible: load cells are of class 0.5 at best."""
UNDETERMINED_SHARE = 0.5
"""A parameter is undetermined when its 95 % half width by noise alone, or the shift that the sensor error may cause,
exceeds this share of it. What the sensors or a misfit add makes it weak: the data still have a value for it."""
WEAK_WIDTH = 0.1
"""A parameter is weak when its 95 % half width exceeds this share of it."""
WEAK_SHIFT = 0.2
"""A parameter is weak when the sensor error may shift it by this share."""
FRICTION_FLOOR = 0.05
"""T0 is judged against itself or this share of the force's r.m.s., the larger: a friction of zero is a finding."""
SPRING_TO_NOISE = 10.0
"""k is undetermined when the spring gives by less than this many times the displacement's noise at peak force:
what the noise does to the force then decides on k."""
LARGEST_RESIDUAL = 0.2
"""All parameters are weak where the model leaves more than this share of the force's r.m.s."""
CONVERGENCE_COSINE = 1e-3
"""Largest cosine between the residuals and a parameter's slope at an optimum."""
EXACT_FIT = 1e-14
"""A criterion below this is rounding: the fit is exact."""


@dataclass(frozen=True)
class Trust:
    """What to say of the parameters of one row."""

    status: str
    """`ok`, or `weak: ...`, `undetermined: ...` with the reason."""
    determined: tuple[bool, ...]
    """Whether each parameter's value may be shown."""


@dataclass(frozen=True)
class ParameterEvidence:
    """What the data say of one parameter."""

    name: str
    scale: float
    """What its uncertainty is measured against [its unit]."""
    noise: float
    """Half width of the 95 % interval that noise of the residuals' colour alone gives it [its unit]."""
    half_width: float
    """Half width of its 95 % interval, sensors and misfit allowed for [its unit]."""
    visible: float
    """R.m.s. of the force that changes with it by one scale and that no other parameter makes up, over the r.m.s."""
    veto: str | None = None
    """Why it is undetermined whatever the numbers say."""
    doubt: str | None = None
    """Why it is weak whatever the numbers say."""

    def undetermined(self) -> str | None:
        """Why the data do not determine it, None where they do."""
        if self.veto:
            return self.veto
        if self.visible <= 0.0:
            return "the force does not depend on it, or another parameter makes it up"
        if self.shift > UNDETERMINED_SHARE:
            return f"a force error of {SENSOR_ERROR:.1%} may shift it by {_percent(self.shift)}"
        if not self.noise <= UNDETERMINED_SHARE * self.scale:
            return f"95 % interval of +-{_percent(self.noise / self.scale)} by noise alone"
        return None

    def weak(self) -> str | None:
        """Why it is weak, None where it is not."""
        if self.doubt:
            return self.doubt
        if self.half_width > WEAK_WIDTH * self.scale:
            return f"95 % interval of +-{_percent(self.half_width / self.scale)}"
        if self.shift > WEAK_SHIFT:
            return f"a force error of {SENSOR_ERROR:.1%} may shift it by {_percent(self.shift)}"
        return None

    @property
    def shift(self) -> float:
        """Largest relative shift that a force error of `SENSOR_ERROR` can cause."""
        return SENSOR_ERROR / self.visible if self.visible > 0.0 else np.inf


def trust_of(evidence: Sequence[ParameterEvidence]) -> Trust:
    """The status of a row from the evidence on its parameters."""
    reasons = [e.undetermined() for e in evidence]
    weak = [None if reason else e.weak() for e, reason in zip(evidence, reasons, strict=True)]
    names = [e.name for e in evidence]
    parts = [_clause("undetermined", names, reasons), _clause("weak", names, weak)]
    return Trust("; ".join(p for p in parts if p) or "ok", tuple(reason is None for reason in reasons))


def _clause(word: str, names: Sequence[str], reasons: Sequence[str | None]) -> str:
    named = [(n, r) for n, r in zip(names, reasons, strict=True) if r]
    if not named:
        return ""
    alike = len({reason for _, reason in named}) == 1
    detail = named[0][1] if alike else "; ".join(f"{n}: {r}" for n, r in named)
    return f"{word}: {', '.join(n for n, _ in named)} ({detail})"


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %" if share < 10.0 else "more than 1000 %"


# --- Evidence on each parameter ---

PARAMETER_NAMES = ("T0", "C", "k")
TARE = 0.3
"""A mean force above this share of the r.m.s. is worth a hint."""
NO_FRICTION = 1e-6
"""A friction below this share of the peak force is none."""


def parameter_evidence(
    objective: Objective, parameters: Bingham, criterion: float, facts: Array, misfit: Misfit
) -> list[ParameterEvidence]:
    """What the data say of T0, C and k.

    Parameters
    ----------
    objective : the data
    parameters : the optimum
    criterion : W_s there
    facts : (5, 3) scale, half widths of the 95 % interval by noise alone and altogether, visible share, and cosine
        of stationarity of each
    misfit : what the model misses
    """
    scales, noise, widths, visible, cosines = facts.tolist()
    unsettled = _not_converged(objective, parameters, cosines)
    vetoes = [
        f"at a bound of the search{_tare_hint(objective)}"
        if bounded
        else "the search did not converge"
        if moving
        else None
        for bounded, moving in zip(objective.at_bounds(parameters), unsettled, strict=True)
    ]
    vetoes[2] = vetoes[2] or _noise_hides_stiffness(objective, parameters)
    doubt = _doubt(float(np.sqrt(criterion)), misfit)
    return [
        ParameterEvidence(name, scale, by_noise, width, share, veto, doubt)
        for name, scale, by_noise, width, share, veto in zip(
            PARAMETER_NAMES, scales, noise, widths, visible, vetoes, strict=True
        )
    ]


def friction_scale(friction: float, force: Array) -> float:
    """What the uncertainty of T0 is measured against [N]."""
    return max(friction, FRICTION_FLOOR * rms(force))


def parameter_scales(parameters: Bingham, measured: Array) -> Array:
    """(3,) what the uncertainty of T0, C and k is measured against."""
    return np.array([friction_scale(parameters.friction, measured), parameters.damping, parameters.stiffness])


def partial_sensitivities(slopes: Array, scales: Array, energy: float) -> Array:
    """What each parameter does to the force that no other parameter makes up, as a share of r.m.s.

    Equation: s_j = scale_j / sqrt([(J'J)^-1]_jj sum F^2)      Source: partial regression

    Parameters
    ----------
    slopes : (N, p) J, derivatives of the force by the parameters
    scales : (p,) change of each parameter
    energy : sum of F^2 over the samples concerned [N2]

    Returns
    -------
    (p,) shares, 0 where the slopes are linearly dependent
    """
    scaled = slopes * scales
    size = np.linalg.norm(scaled, axis=0)
    unit = scaled / np.where(size > 0.0, size, 1.0)
    gram = unit.T @ unit
    shares = np.zeros(size.size)
    for j in range(size.size):
        others = np.delete(np.arange(size.size), j)
        solved = np.linalg.lstsq(gram[np.ix_(others, others)], gram[others, j], rcond=1e-12)[0]
        shares[j] = np.sqrt(max(float(gram[j, j] - gram[others, j] @ solved), 0.0)) * size[j]
    result: Array = shares / np.sqrt(energy)
    return result


def stationarity(slopes: Array, residuals: Array, energy: float) -> Array:
    """(p,) cosine between the residuals and each slope, 0 at an optimum, whatever the solver says."""
    size = np.linalg.norm(slopes, axis=0) * np.sqrt(residuals @ residuals)
    if float(residuals @ residuals) <= EXACT_FIT * energy:
        return np.zeros(size.size)
    cosines: Array = np.abs(slopes.T @ residuals) / np.where(size > 0.0, size, 1.0)
    return cosines


def displacement_noise(displacement: Array) -> float:
    """White noise of a sampled displacement, from its third differences [m].

    Equation: sigma = q90(|third difference|) / (1.645 sqrt(20))      Source: variance of 1, -3, 3, -1 is 20
    """
    if displacement.size < 8:
        return 0.0
    return float(np.quantile(np.abs(np.diff(displacement, 3)), 0.9) / (1.645 * np.sqrt(20.0)))


def _doubt(left: float, misfit: Misfit) -> str | None:
    """Why the parameters are weak however narrow their intervals: the model lacks something."""
    missed = f"the model misses {misfit.share:.1%} of peak: the parameters are the model's, not the damper's"
    much = f"the model leaves {left:.0%} of the force's r.m.s."
    return (
        "; ".join(words for words, true in ((missed, misfit.is_large), (much, left > LARGEST_RESIDUAL)) if true) or None
    )


def _not_converged(objective: Objective, parameters: Bingham, cosines: list[float]) -> list[bool]:
    """Whether the criterion still falls along each parameter; at a friction of zero it may."""
    unsettled = [c > CONVERGENCE_COSINE for c in cosines]
    if parameters.friction <= NO_FRICTION * objective.scales[0]:
        unsettled[0] = False
    return unsettled


def _tare_hint(objective: Objective) -> str:
    """A hint where the force has a mean that the element cannot have."""
    mean = float(np.mean(objective.measured))
    if mean**2 <= TARE**2 * objective.energy / objective.measured.size:
        return ""
    return f"; the force has a mean of {mean:.0f} N, a tare of the load cell?"


def _noise_hides_stiffness(objective: Objective, parameters: Bingham) -> str | None:
    """Why the displacement's noise hides the oil spring, None where it does not."""
    noise = max(displacement_noise(t.at_samples(t.displacement)) for t in objective.trials)
    spring = objective.scales[0] / parameters.stiffness
    if spring >= SPRING_TO_NOISE * noise:
        return None
    return f"the spring gives by {1e6 * spring:.1f} um at peak force, the displacement's noise is {1e6 * noise:.1f} um"


# --- Lack of fit ---# Adjacent cycles of a record that repeats differ by noise alone, and its average cycle of the residual shows what the# model misses: lack of fit against pure error. Where nothing repeats, a smooth function of motion and force takes up# the misfit and leaves the noise. What offset, gain and delay of the tests explain within their priors is projected out# first, together with the change of T0, C and k that goes with it. Records whose control signal moves are not judged,# for a lag of the valve looks like any misfit; diagnose looks at them.

SIGNIFICANCE = 1e-3
"""Lack of fit is believed when noise alone would show it less often than this; as in diagnose."""
MISFIT_THRESHOLD = 0.0025
"""Smallest misfit that speaks, r.m.s. as a share of peak force: half of the error of a load cell of class 0.5, which
may as well bend the measured force. As in diagnose."""
ABSORPTION = 2.0
"""T0, C and k take up more of what the model lacks than they leave: for the effects of the library up to about four
times what is left, along the parameter that suffers most (C beside a quadratic orifice); twice is half of that, since
an interval adds another factor of two."""
WIDENING_LIMIT = 0.01
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
        return self.share >= MISFIT_THRESHOLD

    @property
    def absorbed(self) -> float:
        """R.m.s. force that the parameters may have taken up beside, in error [N]; no more than `SPEAKS` lets it be."""
        return ABSORPTION * self.force * min(1.0, WIDENING_LIMIT / self.share) if self.share > 0.0 else 0.0


def misfit_of(parts: Sequence[FittedRecord]) -> Misfit:
    """What the model misses in the records of a fit.

    Equation: p = 2 min over both kinds of record of the probability by noise, pooled over the records
                            Source: Fisher's variance ratio, in signals/lack_of_fit and smooth_residual; Bonferroni
    """
    cycles: list[Array] = []
    smooth: list[Array] = []
    power, samples, peaks = [], [], []
    for part, cleared in zip(parts, _without_nuisances(parts), strict=True):
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
            cycles.append(p_values_by_harmonics(error))
            power.append(float(repeatable_power(error).sum()))
        samples.append(part.residuals.size)
        peaks.append(float(np.max(np.abs(part.force))))
    kinds = [kind for kind in (cycles, smooth) if kind]
    if not kinds or len(kinds) * min(pooled_p_value(kind) for kind in kinds) >= SIGNIFICANCE:
        return Misfit(0.0, 0.0)
    weights = np.array(samples) / sum(samples)
    return Misfit(_root(weights @ (np.array(power) / np.array(peaks) ** 2)), _root(weights @ np.array(power)))


def _root(square: float) -> float:
    return float(np.sqrt(max(square, 0.0)))


def _without_nuisances(parts: Sequence[FittedRecord]) -> list[Array]:
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
        weighed = both[part.calm] / np.sqrt(_noise_variance(part))
        normal[np.ix_(place, place)] += weighed.T @ weighed
        right[place] += weighed.T @ (part.residuals[part.calm] / np.sqrt(_noise_variance(part)))
        columns.append((both, place))
        at += part.nuisances.shape[1]
    normal[np.diag_indices(whole)] += np.where(np.arange(whole) < size, 1e-12 * np.trace(normal), 1.0)
    triangle = np.linalg.cholesky(normal).T
    limit = np.where(np.arange(whole) < size, np.inf, NUISANCE_LIMIT)
    found = lsq_linear(triangle, np.linalg.solve(triangle.T, right), (-limit, limit)).x
    return [_without_explained(part, both @ found[place]) for part, (both, place) in zip(parts, columns, strict=True)]


def _without_explained(part: FittedRecord, explained: Array) -> Array:
    """(m,) residual less what is explained, and less what chance makes of it beside jumps."""
    left = part.residuals - explained
    predicted = part.force - part.residuals
    return left - np.where(part.calm, 0.0, jump_timing_error(predicted + left, predicted))


def _noise_variance(part: FittedRecord) -> float:
    """Variance by noise, enough to weigh the priors."""
    folded = part.folded(part.residuals)
    steps = np.diff(part.residuals) if folded is None else np.diff(folded, axis=0)
    return max(float(np.mean(steps**2)) / 2.0, 1e-12 * float(np.max(part.force**2)))
