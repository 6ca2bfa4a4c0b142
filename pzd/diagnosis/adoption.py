"""Adoption: which of the selected effects the final damper has, judged by its prediction of held-out tests.

An effect stays if held-out tests are predicted no worse with it. Where a law is missing that no name accounts for,
weights by noise mislead: each law is bent towards what is missing, and takes other values on other tests. There effects
are also added for what they predict alone. An effect is added if held-out tests are predicted better with it, beyond
chance, and at no voltage worse; if the interpolation error at left-out voltages is not larger; and if the force
half-way between two voltages passes `interpolation_check`. The verdict stays `unexplained`: what is added has no name.

What is added may say better what an earlier effect stood in for, as a polytropic gas does for a parallel spring. Then
the data no longer determine the parameters of that effect, and it is removed if held-out tests are predicted as well.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from pzd.artefacts import Prediction
from pzd.damper.compose import respond
from pzd.damper.effects import library
from pzd.damper.model import Damper, against_nature
from pzd.diagnosis import thresholds
from pzd.diagnosis.campaign import evidence_of
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.cross_validation import CrossValidation, PredictionError
from pzd.diagnosis.fit.least_squares import FitResult, refit
from pzd.diagnosis.fit.prediction import comparable_samples, simulation_motion
from pzd.diagnosis.fit.problem import Problem
from pzd.diagnosis.search.acceptance import Selection
from pzd.diagnosis.search.candidates import Candidate, candidate, most_promising, per_voltage_candidates, testable
from pzd.diagnosis.search.determination import first_undetermined, showing, undetermined
from pzd.record import Array
from pzd.signals.measures import rms

log = logging.getLogger(__name__)

WORSENS_PREDICTION = "the damper predicts kept-back tests worse with it"
IMPOSSIBLE = "stand-in: fits with a value alone that it has nowhere in nature"
ADDED = "added: kept-back tests are predicted better with it; what it stands for is open"
REPLACED = "stand-in: kept-back tests are predicted as well without it, beside what was added"


@dataclass(frozen=True, eq=False)
class Adoption:
    """The adopted damper and its prediction errors."""

    selection: Selection
    """The effects that are adopted."""
    baseline_error: PredictionError
    """Held-out error of the baseline."""
    error: PredictionError
    """Held-out error of the adopted damper."""
    interpolation_error: PredictionError
    """Interpolation error of the adopted damper at left-out voltages."""
    rejection: str | None = None
    """Why the baseline is adopted although effects fitted the tests; None where it is not."""
    by_criterion: bool = False
    """Whether the final fit is by criterion (4): what is left is then no noise to weigh by."""
    added: tuple[str, ...] = ()
    """Effects that were added for their prediction alone, in words."""

    def prediction(self, validation: CrossValidation) -> Prediction | None:
        """Return the prediction figures of diagnosis.json; None where no test could be held out."""
        return validation.prediction(self.baseline_error, self.error, self.interpolation_error)


# --- Removal of effects that worsen the prediction


def adopt_effects(selection: Selection, validation: CrossValidation, forced: Sequence[str], unit: str) -> Adoption:
    """Remove effects that worsen the prediction of held-out tests, one at a time, down to the baseline if need be.

    An effect is removed if the damper predicts better without it. The last one is removed for as long as the baseline
    predicts better at any voltage, or interpolates much better at a voltage between two others.

    Parameters
    ----------
    selection : effects selected
    validation : cross-validation of the tests
    forced : effects that the config asks for, whatever they do
    unit : of the control signal, for the reason
    """
    baseline, reference = validation.baseline_error(), validation.baseline_interpolation_error
    kept, rejection = _without_impossible(_without_undetermined(selection, forced), forced)
    while kept.adopted:
        error, by_criterion = _better_predicting_fit(kept, validation)
        between = validation.interpolation_error(kept.fitted.damper, by_criterion=by_criterion)
        removable = [name for name in kept.adopted if name not in forced]
        compared, kind = (error, baseline), "kept-back ones"
        worse = validation.worse_at(*compared)
        if not worse:
            compared, kind = (between, reference), "those of a voltage left out"
            worse = validation.interpolates_worse_at(between)
        harmful = _harmful_effect(kept, validation, error, removable, by_criterion=by_criterion)
        if harmful is None and worse and removable:
            harmful = removable[-1]
        if harmful is None:
            found = validation.fit_by_criterion(kept.fitted.damper, validation.no_samples) if by_criterion else None
            if found is not None:
                evidence = replace(kept.final_evidence, whole=found[0])
                kept = replace(kept, fitted=found[1], final_evidence=evidence)
                if none := first_undetermined(evidence.whole, kept.fitted, forced):
                    kept = _without_effect(kept, *none)
                    continue
            return Adoption(kept, baseline, error, between, by_criterion=by_criterion)
        if worse and len(kept.adopted) == 1:
            rejection = _rejection_reason(selection, f"{kind} are predicted", compared, validation, worse, unit)
        kept = _without_effect(kept, harmful)
    return Adoption(kept, baseline, baseline, reference, rejection)


def _without_undetermined(selection: Selection, forced: Sequence[str]) -> Selection:
    """Remove effects that the fit does not determine, one at a time, each time with the rest fitted again."""
    kept = selection
    while kept.adopted and (none := first_undetermined(kept.final_evidence.whole, kept.fitted, forced)):
        kept = _without_effect(kept, *none)
    return kept


def _without_impossible(selection: Selection, forced: Sequence[str]) -> tuple[Selection, str | None]:
    """Remove effects that fit with impossible values alone; return also why nothing is left, if nothing is.

    One with a rival stays: there the verdict is `ambiguous`, and what is adopted is the best of several.
    """
    kept = selection
    while odd := [] if kept.rivals else [name for name in against_nature(kept.fitted.damper) if name not in forced]:
        kept = _without_effect(kept, odd[-1], IMPOSSIBLE)
    if kept.adopted or kept is selection:
        return kept, None
    words = [f"{name} with {_printed_values(selection, name)}" for name in selection.adopted]
    return kept, (
        f"{' and '.join(words)} would fit the tests, but nowhere in nature is there such a value: something else that "
        "looks alike is missing"
    )


def _printed_values(selection: Selection, effect: str) -> str:
    """Format the parameters of an effect for a sentence."""
    values = selection.fitted.damper.effects[effect]
    return ", ".join(
        f"{p.name} = {' and '.join(f'{value:.3g}' for value in np.atleast_1d(values[p.name]))} {p.unit}"
        for p in library()[effect].parameters
    )


def _better_predicting_fit(selection: Selection, validation: CrossValidation) -> tuple[PredictionError, bool]:
    """Return the held-out error, and whether the fit is by criterion (4) because that predicts visibly better.

    The likelihood weighs by noise: the best as long as noise is what is left, and misled where a law is missing, which
    the gap shows.
    """
    weighted = validation.held_out_error(selection.fitted.damper)
    if selection.final_evidence.gap(selection.fitted) < validation.visible:
        return weighted, False
    equal = validation.error_by_criterion(selection.fitted.damper)
    return (equal, True) if equal.visibly_below(weighted) else (weighted, False)


def _harmful_effect(
    selection: Selection,
    validation: CrossValidation,
    error: PredictionError,
    removable: Sequence[str],
    *,
    by_criterion: bool,
) -> str | None:
    """Return an effect without which the others predict better; a lone one is compared with the baseline instead."""
    if len(selection.adopted) == 1:
        return None
    error_of = validation.error_by_criterion if by_criterion else validation.held_out_error
    without = ((name, error_of(_without_effect(selection, name).fitted.damper)) for name in reversed(removable))
    return next((name for name, other in without if validation.worse_at(error, other)), None)


def _without_effect(selection: Selection, effect: str, reason: str = WORSENS_PREDICTION) -> Selection:
    """Remove one effect for a reason and refit the rest."""
    fewer = selection.fitted.damper.without_effects(effect)
    reasons = {**selection.reasons, effect: reason}
    if not fewer.effects:
        return replace(
            selection,
            fitted=selection.baseline,
            final_evidence=selection.initial_evidence,
            competing_confounders=(),
            reasons=reasons,
        )
    evidence = evidence_of(selection.final_evidence.campaign, fewer)
    return replace(
        selection,
        fitted=refit(evidence.whole, fewer),
        final_evidence=evidence,
        competing_confounders=tuple(c for c in selection.competing_confounders if c.effect != effect),
        reasons=reasons,
    )


def _rejection_reason(
    selection: Selection,
    predicted: str,
    errors: tuple[PredictionError, PredictionError],
    validation: CrossValidation,
    worse: Sequence[float | None],
    unit: str,
) -> str:
    """Say why no selected effect is adopted, with the figures of the voltage where the prediction is worst."""
    groups = dict(zip(validation.voltages, validation.groups, strict=True))

    def figures(voltage: float | None) -> tuple[float, float]:
        adopted, baseline = (each.of_records(groups[voltage]).criterion or 0.0 for each in errors)
        return adopted, baseline

    worst = max(worse, key=lambda voltage: figures(voltage)[0] - figures(voltage)[1])
    adopted, baseline = figures(worst)
    at = "" if worst is None or len(groups) == 1 else f" at {worst:.4g} {unit}"
    return (
        f"{' and '.join(selection.adopted)} would fit the tests, but {predicted} worse than by the "
        f"plain damper (W_s {adopted:.2g} against {baseline:.2g}{at}), which is handed on"
    )


# --- Addition of effects that improve the prediction


@dataclass(frozen=True, eq=False)
class _CriterionFit:
    """A damper fitted by criterion (4), and its prediction errors."""

    problem: Problem
    fitted: FitResult
    error: PredictionError
    interpolation_error: PredictionError


def add_predictive_effects(adoption: Adoption, validation: CrossValidation, config: DiagnoseConfig) -> Adoption:
    """Add effects that improve the prediction of held-out tests, one after another, where a gap has no name.

    All fits are by criterion (4), every sample weighted alike.

    Parameters
    ----------
    adoption : damper without harmful effects
    validation : cross-validation of the tests
    config : how many effects there may be, which are forbidden, what is visible

    Returns
    -------
    the extended damper; `adoption` itself where nothing improves the prediction
    """
    selection = adoption.selection
    found = validation.fit_by_criterion(selection.fitted.damper, validation.no_samples)
    if found is None:
        return adoption
    added: list[Candidate] = []
    current = _CriterionFit(*found, adoption.error, adoption.interpolation_error)
    while validation.campaign.budget.allows_more():
        better = _best_addition(current, validation, config, selection.adopted)
        if better is None:
            break
        added.append(better[0])
        log.info("diagnose: %s added, W_s of kept-back tests %.4g", _name(added[-1]), better[1].error.criterion)
        # What is off beside the new effect goes at once: something else may then explain what it had stood in for.
        current = _without_off(_without_replaced(better[1], validation, config.force), validation, config.force)
        off = tuple(name for name in better[1].fitted.effects if name not in current.fitted.effects)
        config = config.model_copy(update={"forbid": (*config.forbid, *off)})
    names = tuple(_name(each) for each in added if each.effect in current.fitted.effects)
    if not names:
        return adoption
    new = {each.effect: ADDED for each in added if each.effect not in selection.adopted}
    gone = dict.fromkeys({*selection.adopted, *new} - {*current.fitted.effects}, REPLACED)
    extended = replace(
        selection,
        fitted=current.fitted,
        final_evidence=replace(selection.final_evidence, whole=current.problem),
        reasons={**selection.reasons, **new, **gone},
    )
    errors = adoption.baseline_error, current.error, current.interpolation_error
    return Adoption(extended, *errors, by_criterion=True, added=names)


def _name(added: Candidate) -> str:
    return f"{added.effect} by voltage" if added.varies else added.effect


def _best_addition(
    current: _CriterionFit, validation: CrossValidation, config: DiagnoseConfig, adopted: Sequence[str]
) -> tuple[Candidate, _CriterionFit] | None:
    """Return the candidate that predicts best among those that fit best; None where none improves the prediction."""
    tried = _possible_additions(current, config, adopted)
    better = []
    for each in sorted(tried, key=lambda c: c.delta_bic)[: thresholds.CROSS_VALIDATED_CANDIDATES]:
        error = validation.error_by_criterion(each.fitted.damper)
        if _improves(error, current.error, validation):
            better.append((each, error))
    for each, error in sorted(better, key=lambda pair: pair[1].criterion or 0.0):
        between = validation.interpolation_error(each.fitted.damper, by_criterion=True)
        if current.interpolation_error.visibly_below(between):
            continue
        found = validation.fit_by_criterion(each.fitted.damper, validation.no_samples)
        if found is not None and interpolation_check(found[1].damper, validation):
            return each, _CriterionFit(*found, error, between)
    return None


def _possible_additions(current: _CriterionFit, config: DiagnoseConfig, adopted: Sequence[str]) -> Iterator[Candidate]:
    """Yield candidates with possible values: a new effect each, or an adopted one with its parameters per voltage.

    Effects of the sensor are not tried: no ride depends on them, and a delay fits any hysteresis a little. Nor is what
    begins at some displacement: it would grow beyond the recorded stroke, where no test shows it.
    """
    problem, fitted = current.problem, current.fitted
    found: list[Candidate] = per_voltage_candidates(problem, fitted)
    if len({*fitted.effects} - {*adopted}) < config.most_added:
        new = [
            effect
            for effect in library().values()
            if effect.name not in (*fitted.effects, *config.forbid)
            and effect.place != "sensor"
            and not effect.needs_displacement_zero
            and testable(problem, effect)
        ]
        for effect in most_promising(problem, fitted, new, thresholds.SCREENED_EFFECTS):
            own = problem.with_friction_scaling(effect)
            found.append(replace(candidate(own, fitted, effect), varies=own is not problem))
    visible = (c for c in found if c.explained >= config.visible and not against_nature(c.fitted.damper))
    return (c for c in visible if c.effect not in undetermined(problem, c.fitted))


def _improves(one: PredictionError, other: PredictionError, validation: CrossValidation) -> bool:
    """Whether held-out tests are predicted better, visibly and beyond chance, and at no voltage worse."""
    if one.criterion is None or other.criterion is None:
        return False
    less = one.criterion <= (1.0 - thresholds.LEAST_PREDICTION_GAIN) * other.criterion
    return less and bool(validation.better_at(one, other)) and not validation.worse_at(one, other)


def _without_replaced(current: _CriterionFit, validation: CrossValidation, forced: Sequence[str]) -> _CriterionFit:
    """Remove effects that the data do not determine beside the others, and that the prediction does not need."""
    while True:
        fewer = []
        for name in _removable(current.fitted):
            if name in forced:
                continue
            damper = current.fitted.damper.without_effects(name)
            error = validation.error_by_criterion(damper)
            found = validation.fit_by_criterion(damper, validation.no_samples)
            if found is None or _improves(current.error, error, validation):
                continue
            if interpolation_check(found[1].damper, validation):
                fewer.append((*found, error))
        if not fewer:
            return current
        problem, fitted, error = min(fewer, key=lambda each: each[2].criterion or 0.0)
        between = validation.interpolation_error(fitted.damper, by_criterion=True)
        current = _CriterionFit(problem, fitted, error, between)


def _without_off(current: _CriterionFit, validation: CrossValidation, forced: Sequence[str]) -> _CriterionFit:
    """Remove effects that may as well be off beside what was added, whatever they predict; the rest is refitted.

    Within the tests such an effect does little either way; beyond them, as a stop at the end of the stroke, anything.
    """
    while True:
        shown = showing(current.fitted)
        off = next((name for name in current.fitted.effects if name not in shown and name not in forced), None)
        damper = current.fitted.damper.without_effects(off or "")
        found = validation.fit_by_criterion(damper, validation.no_samples) if off else None
        if found is None:
            return current
        between = validation.interpolation_error(found[1].damper, by_criterion=True)
        current = _CriterionFit(*found, validation.error_by_criterion(damper), between)


def _removable(fitted: FitResult) -> list[str]:
    """Return the effects whose strength may as well be zero, or with impossible values."""
    shown, odd = showing(fitted), against_nature(fitted.damper)
    return [name for name in fitted.effects if (name not in shown or name in odd) and len(fitted.effects) > 1]


# --- Check of the force half-way between two tested voltages
#
# No test shows it, and neither does the interpolation error: that is of voltages twice as far apart. T0, C and k are
# linear between voltages, and the force nearly so. An effect whose parameters differ by voltage may leave that line
# where the tests of one voltage hardly determine them: each set of values predicts its own tests, and what lies between
# two sets is no damper.


TOLERANCE = 1e-5
"""Tolerance of the simulation, as a share of the force.

Reason: far below the shares that are compared."""


def interpolation_check(damper: Damper, validation: CrossValidation) -> bool:
    """Whether the force half-way between neighbouring voltages lies near the mean of those at either, in their tests.

    Equation: rms(F((u + w)/2) - (F(u) + F(w))/2) <= s rms(F(w) - F(u)), s = 1/4

    Parameters
    ----------
    damper : with the effects to be tried
    validation : whose tests at constant voltage are simulated at both voltages and half-way
    """
    groups = {v: group for v, group in zip(validation.voltages, validation.groups, strict=True) if v is not None}
    return all(
        _near_mean_force(damper, validation, record, low, high)
        for low, high in pairwise(sorted(groups))
        for record in (*groups[low], *groups[high])
    )


def _near_mean_force(damper: Damper, validation: CrossValidation, record: int, low: float, high: float) -> bool:
    prepared = validation.campaign.prepared[record]
    motion, samples = simulation_motion(prepared.record)

    def force(voltage: float) -> Array:
        """Compute the force at another voltage, where it does not depend on how the test began."""
        fixed_voltage = replace(motion, voltage=np.full(motion.time.size, voltage))
        found = respond(damper, fixed_voltage, float(prepared.record.force[0]), TOLERANCE)
        return found[samples][comparable_samples(prepared)]

    below, half_way, above = force(low), force(0.5 * (low + high)), force(high)
    off = rms(half_way - 0.5 * (below + above))
    seen = validation.visible * float(max(np.max(np.abs(below)), np.max(np.abs(above))))
    return off <= max(thresholds.INTERPOLATION_DEPARTURE * rms(above - below), seen)
