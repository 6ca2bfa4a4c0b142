"""Adoption: which of the selected effects the final damper has, judged by its prediction of held-out tests.

An effect stays if held-out tests are predicted no worse with it. Where a law is missing that no name accounts for,
effects are also added for what they predict alone, or take the place of others (`predictive_search.py`). The verdict
stays `unexplained`: what is added has no name. It may say better what an earlier effect stood in for, as a polytropic
gas does for a parallel spring; the earlier one then goes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pzd.artefacts import Prediction
from pzd.damper.effects import library
from pzd.diagnosis import thresholds
from pzd.diagnosis.campaign import evidence_of
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.cross_validation import CrossValidation
from pzd.diagnosis.fit.least_squares import refit
from pzd.diagnosis.gap import gap_with_nuisances
from pzd.diagnosis.predictive_search import CriterionFit, PredictiveSearch, effect_names, improves
from pzd.diagnosis.search.acceptance import Selection
from pzd.diagnosis.search.determination import first_undetermined
from pzd.fit.cross_validation import (
    STANDARD_ERRORS,
    PredictionError,
    log_ratios,
    paired_t,
    predicts_better,
    predicts_worse,
)
from pzd.fit.intervals import LEVEL

WORSENS_PREDICTION = "the damper predicts kept-back tests worse with it"
IMPOSSIBLE = "stand-in: fits with a value alone that it has nowhere in nature"
ADDED = "added: kept-back tests are predicted better with it; what it stands for is open"
NO_BETTER = "something is still missed, and kept-back tests are predicted no better with it"
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
    alternatives: Mapping[str, str] = field(default_factory=dict)
    """Effects that would predict as well in the place of an adopted one, by its name."""

    def is_added(self, effect: str) -> bool:
        """Whether an effect was added for its prediction alone."""
        return self.selection.reasons.get(effect) == ADDED

    def prediction(self, validation: CrossValidation) -> Prediction | None:
        """Return the prediction figures of diagnosis.json; None where no test could be held out."""
        return validation.prediction(self.baseline_error, self.error, self.interpolation_error)


# --- Removal of effects that worsen the prediction


def adopt_effects(
    selection: Selection, validation: CrossValidation, forced: Sequence[str], unit: str, level: float = LEVEL
) -> Adoption:
    """Remove effects that worsen the prediction of held-out tests, one at a time, down to the baseline if need be.

    An effect is removed if the damper predicts better without it. The last one is removed for as long as the baseline
    predicts better at any voltage, or interpolates much better at a voltage between two others.

    Parameters
    ----------
    selection : effects selected
    validation : cross-validation of the tests
    forced : effects that the config asks for, whatever they do
    unit : of the control signal, for the reason
    level : standard errors by which the strength of an effect has to differ from none
    """
    baseline, reference = validation.baseline_error(), validation.baseline_interpolation_error
    kept, rejection = _without_impossible(_without_undetermined(selection, forced, level), forced)
    while kept.adopted:
        error, by_criterion = _better_predicting_fit(kept, validation)
        between = validation.interpolation_error(kept.fitted.damper, by_criterion=by_criterion)
        removable = [name for name in kept.adopted if name not in forced]
        compared, kind = (error, baseline), "kept-back ones"
        worse = validation.worse_in_shape_at(*compared)
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
                if none := first_undetermined(evidence.whole, kept.fitted, forced, level):
                    kept = _without_effect(kept, *none)
                    continue
            return Adoption(kept, baseline, error, between, by_criterion=by_criterion)
        if worse and len(kept.adopted) == 1:
            rejection = _rejection_reason(selection, f"{kind} are predicted", compared, validation, worse, unit)
        kept = _without_effect(kept, harmful)
    return Adoption(kept, baseline, baseline, reference, rejection)


def _without_undetermined(selection: Selection, forced: Sequence[str], level: float) -> Selection:
    """Remove effects that the fit does not determine, one at a time, each time with the rest fitted again."""
    kept = selection
    while kept.adopted and (none := first_undetermined(kept.final_evidence.whole, kept.fitted, forced, level)):
        kept = _without_effect(kept, *none)
    return kept


def _without_impossible(selection: Selection, forced: Sequence[str]) -> tuple[Selection, str | None]:
    """Remove effects that fit with impossible values alone; return also why nothing is left, if nothing is.

    One with a rival stays: there the verdict is `ambiguous`, and what is adopted is the best of several.
    """
    kept = selection
    while odd := [] if kept.rivals else [name for name in kept.fitted.unphysical if name not in forced]:
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
    return next((name for name, other in without if validation.worse_in_shape_at(error, other)), None)


def _without_effect(selection: Selection, effect: str, reason: str = WORSENS_PREDICTION) -> Selection:
    """Remove one effect for a reason and refit the rest."""
    fewer = selection.fitted.damper.without_effects(effect)
    reasons = {**selection.reasons, effect: reason}
    if not {*fewer.effects} - {*selection.final_evidence.whole.law}:
        return _plain(selection, reasons)
    evidence = evidence_of(selection.final_evidence.campaign, fewer)
    return replace(
        selection,
        fitted=refit(evidence.whole, fewer),
        final_evidence=evidence,
        competing_confounders=tuple(c for c in selection.competing_confounders if c.effect != effect),
        reasons=reasons,
    )


def _plain(selection: Selection, reasons: Mapping[str, str]) -> Selection:
    """Return the baseline in the place of what was selected."""
    return replace(
        selection,
        fitted=selection.baseline,
        final_evidence=selection.initial_evidence,
        competing_confounders=(),
        reasons=dict(reasons),
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
        f"plain damper (W_s {adopted:.2g} against {baseline:.2g}{at})"
    )


# --- Addition and exchange of effects that improve the prediction


def add_predictive_effects(adoption: Adoption, validation: CrossValidation, config: DiagnoseConfig) -> Adoption:
    """Add and exchange effects that improve the prediction of held-out tests, where a gap has no name.

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
    before = CriterionFit(*found, adoption.error, adoption.interpolation_error)
    search = PredictiveSearch(validation, config, len(selection.adopted) + config.most_added)
    final = search.improve(before)
    # Each step improves on the one before it, and then removes what its prediction does not need: the sum is judged.
    if final is before or not improves(final.error, before.error, validation):
        return replace(adoption, alternatives=search.alternatives)
    had, has = (effect_names(each.fitted.damper) for each in (before, final))
    new = {name: ADDED for name in final.fitted.effects if name not in selection.adopted}
    gone = dict.fromkeys({*selection.adopted} - {*final.fitted.effects}, REPLACED)
    extended = replace(
        selection,
        fitted=final.fitted,
        final_evidence=replace(selection.final_evidence, whole=final.problem),
        reasons={**selection.reasons, **new, **gone},
    )
    errors = adoption.baseline_error, final.error, final.interpolation_error
    added = tuple(name for name in has if name not in had)
    return Adoption(extended, *errors, by_criterion=True, added=added, alternatives=search.alternatives)


def plain_unless_better(adoption: Adoption, validation: CrossValidation, forced: Sequence[str]) -> Adoption:
    """Return the damper that is handed on where something has no name: with effects only if it predicts better.

    A gap that a name explains speaks for the effect by itself. Where a law is missing the likelihood bends each effect
    towards it, and that held-out tests are predicted no worse is too little: the plain damper does that as well. So is
    what some tests gain and others lose, for nobody knows which of them the next one is like.

    Parameters
    ----------
    adoption : damper with what was selected, and added
    validation : cross-validation of the tests
    forced : effects that the config asks for, whatever they do
    """
    selection, plain = adoption.selection, adoption.baseline_error
    if not selection.adopted or forced:
        return adoption
    # The gain of a test that no fit has seen is nobody's to know, and hides as well that its shape is missed by more.
    if _predicts(adoption.error, plain, validation) and _predicts(adoption.error.shapes, plain.shapes, validation):
        return adoption
    kept = _plain(selection, {**selection.reasons, **dict.fromkeys(selection.adopted, NO_BETTER)})
    return Adoption(kept, plain, plain, validation.baseline_interpolation_error)


def by_criterion_if_better(adoption: Adoption, validation: CrossValidation, forced: Sequence[str]) -> Adoption:
    """Return the adopted damper fitted by criterion (4), where kept-back tests are predicted better with that.

    Where a law is all but that of the damper, the likelihood leaves in part to the zero, gain and delay of each test
    what every test shows alike. It forgives them there, and the next test has to be predicted without. The verdict,
    which asks what is missing, stays that of the likelihood.

    Parameters
    ----------
    adoption : the damper, fitted by the likelihood
    validation : cross-validation of the tests
    forced : effects that the config asks for, whatever they do
    """
    selection = adoption.selection
    if not selection.adopted or adoption.by_criterion:
        return adoption
    damper, checks = selection.fitted.damper, selection.final_evidence.campaign.checks(selection.fitted.damper)
    found = None
    if gap_with_nuisances(checks) >= validation.visible:
        found = validation.fit_by_criterion(damper, validation.no_samples)
    if found is None or first_undetermined(*found, forced) or set(found[1].unphysical) - {*forced}:
        return adoption
    error = validation.error_by_criterion(damper)
    between = validation.interpolation_error(damper, by_criterion=True)
    if not predicts_better(error, adoption.error) or predicts_worse(between, adoption.interpolation_error):
        return adoption
    evidence = replace(selection.final_evidence, whole=found[0])
    fitted = replace(selection, fitted=found[1], final_evidence=evidence)
    return replace(adoption, selection=fitted, error=error, interpolation_error=between, by_criterion=True)


def _predicts(one: PredictionError, plain: PredictionError, validation: CrossValidation) -> bool:
    """Whether held-out tests are predicted better than by the baseline, at no voltage worse.

    Either test by test, each counted alike, by two standard errors: what was selected was so by the likelihood, and not
    by these errors. Or as an effect is added, which few tests may show, and then none is predicted much worse.
    """
    if improves(one, plain, validation) and not validation.much_worse_in(one, plain):
        return True
    less = (one.criterion or 0.0) <= (1.0 - thresholds.LEAST_PREDICTION_GAIN) * (plain.criterion or 0.0)
    alike = one.visibly_below(plain) and paired_t(log_ratios(one, plain)) > STANDARD_ERRORS
    return less and alike and not validation.worse_at(one, plain)
