"""Support of each adopted effect: what held-out tests lose without it, and how sure that is.

The verdict is about the damper as a whole: `unexplained` where anything repeatable is left. Of the parts more is known.
Each effect is taken out, the others are refitted, and the tests are predicted without and with it, each by the fit
without its fold. All fits are by criterion (4), and the folds are those of the cross-validation, to first order.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from itertools import permutations
from typing import Literal

import numpy as np

from pzd.artefacts.diagnosis import Support
from pzd.damper.effects import library
from pzd.diagnosis import thresholds
from pzd.diagnosis.adoption import Adoption
from pzd.diagnosis.cross_validation import CrossValidation
from pzd.diagnosis.search.determination import nearly_others
from pzd.fit.cross_validation import FEWEST_DIFFERENCES, PredictionError, log_ratios, paired_t


def support_of(adoption: Adoption, validation: CrossValidation, alike: Collection[str] = ()) -> dict[str, Support]:
    """Return the support of every adopted effect.

    Parameters
    ----------
    adoption : the adopted damper, and what would do as well in the place of an effect
    validation : cross-validation of the tests
    alike : effects that are something that looks alike, whatever the tests lose without them

    Returns
    -------
    by effect, in the order of the damper; empty where nothing is adopted or left to fit
    """
    damper, names = adoption.selection.fitted.damper, adoption.selection.adopted
    whole = validation.fit_by_criterion(damper, validation.no_samples) if names else None
    plain = validation.fit_by_criterion(adoption.selection.baseline.damper, validation.no_samples) if whole else None
    if whole is None or plain is None:
        return {}
    own, before = validation.error_to_first_order(*whole), validation.error_to_first_order(*plain)
    fitted, total = whole[1].damper, _total(before, adoption.baseline_error)

    def without(name: str) -> PredictionError | None:
        fewer = validation.fit_by_criterion(fitted.without_effects(name), validation.no_samples)
        return None if fewer is None else validation.error_to_first_order(*fewer)

    tried = zip(names, validation.campaign.parallel_map(without, names), strict=True)
    errors = {name: error for name, error in tried if error is not None}
    nearly = nearly_others(damper, whole[0].scales.force)
    others = {**adoption.alternatives, **parts(nearly, {n: _share(own, e, total) for n, e in errors.items()})}
    return {
        name: _support(
            own, error, total, validation, others.get(name), added=adoption.is_added(name), alike=name in alike
        )
        for name, error in errors.items()
    }


def parts(nearly: Mapping[str, str], shares: Mapping[str, float]) -> dict[str, str]:
    """Return the effects that may be another one or a part of it, by the law of the library; each with the other.

    Several laws bend one curve: a valve that opens softly is a valve and a little thinning to a library whose
    valves open at once. So what comes back of the gap without the smaller one must be more than a law is off by.

    Parameters
    ----------
    nearly : by effect, which other one it nearly is by its values
    shares : of the gap that come back without each effect of the damper
    """
    found = dict(nearly)
    for name, other in permutations(shares, 2):
        curve = library()[name].curve
        alike = curve is not None and curve == library()[other].curve
        if alike and shares[name] < min(thresholds.LAW_ERROR, shares[other]):
            found.setdefault(name, other)
    return found


WITHIN_FIRST_ORDER = 2.0
"""Times the error of refits up to which that to first order stands for it: where a plain damper misses more than half
of the force, a fold without its most telling test is far from linear, and the estimate may be thousands of times too
large."""


def _total(first_order: PredictionError, refitted: PredictionError) -> float:
    """Return the sum of squared errors of the baseline [N^2], to first order as those beside it where that holds."""
    estimate, exact = float(first_order.error.sum()), float(refitted.error.sum())
    return exact if 0.0 < WITHIN_FIRST_ORDER * exact < estimate else estimate


def _share(own: PredictionError, without: PredictionError, total: float) -> float:
    """Compute the share of the baseline's sum of squared errors [N^2] that comes back without an effect."""
    return min(max(float((without.error - own.error).sum()) / total, 0.0), 1.0) if total > 0.0 else 0.0


def _support(
    own: PredictionError,
    without: PredictionError,
    total: float,
    validation: CrossValidation,
    other: str | None,
    *,
    added: bool,
    alike: bool,
) -> Support:
    """Compare the errors of the tests with and without an effect; `other` would do as well in its place.

    Equation: s = sum (e_i' - e_i) / sum e_i of the baseline, P = P(t_(n-1) < t), t of `log_ratios`
                                                                Source: Student 1908, the t-test of paired differences
    """
    from scipy.special import stdtr

    folds = [np.isin(own.records, sorted(held)) for held in validation.held_out_tests()]
    better = sum(bool(without.error[fold].sum() > own.error[fold].sum()) for fold in folds)
    held = sorted({i for tests in validation.held_out_tests() for i in tests})
    confidence = None
    if len(held) >= FEWEST_DIFFERENCES:
        errors = paired_t(log_ratios(own.of_records(held), without.of_records(held)))
        chance = float(stdtr(len(held) - 1, errors))
        confidence = round(chance / 2.0 if other else chance, 3)
    return Support(
        share=_share(own, without, total),
        folds_better=better,
        folds=len(folds),
        replaced_by=other,
        confidence=confidence,
        sure="open" if added or alike else _sureness(confidence),
        added=added,
    )


def _sureness(confidence: float | None) -> Literal["certain", "likely", "open"]:
    if confidence is None or confidence < thresholds.DOUBTFUL_BELOW:
        return "open"
    return "certain" if confidence >= thresholds.CERTAIN_FROM else "likely"
