"""The verdict on a damper: `named`, `ambiguous`, `none` or `unexplained`, its reason, and how sure it is.

`judge` adopts what predicts held-out tests and decides; `conclude` looks for more effects where the gap has no name.
Three cases have a verdict without a search: `insufficient_data`, no test that slips, and a knee law that misses nothing
visible (`knee_suffices`).
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pzd.artefacts import Diagnosed, Diagnosis, Identified, KneeRow, ParameterRow, Prediction, identified_damper
from pzd.artefacts.diagnosis import CYCLES_IN_WORDS, Support, Verdict
from pzd.damper.confounders import known
from pzd.damper.fitted_laws.knee import mean_bleed
from pzd.damper.model import BaseRow, Damper
from pzd.damper.parameter_rows import rows_per_voltage
from pzd.diagnosis import thresholds
from pzd.diagnosis.adoption import Adoption, add_predictive_effects, adopt_effects, plain_unless_better
from pzd.diagnosis.campaign import Campaign, nearest_row
from pzd.diagnosis.cleaned_records import CleanedRecord
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.cross_validation import CrossValidation
from pzd.diagnosis.fit.least_squares import polished
from pzd.diagnosis.fit.likelihood import FEWEST_SAMPLES, enough_samples, shown_force
from pzd.diagnosis.gap import ResidualCheck, gap_with_nuisances, probability_of_noise, visible_gap
from pzd.diagnosis.next_test import OperatingEnvelope, repeated_longest_test
from pzd.diagnosis.roles import TRAINING
from pzd.diagnosis.search.acceptance import Detection, Selection, detection_from_fit, distinct
from pzd.diagnosis.search.candidates import force_change
from pzd.diagnosis.search.determination import first_undetermined, varying_strengths
from pzd.fit.intervals import LEVEL
from pzd.record import CONSTANT_SHARE, Array
from pzd.schema.errors import counted
from pzd.signals.measures import rms
from pzd.signals.nuisance import NuisanceConfig, nuisance_columns


@dataclass(frozen=True)
class Decision:
    """A verdict, its reason, and how sure it is."""

    verdict: Verdict
    reason: str
    confidence: float | None
    possible: tuple[str, ...] = ()
    """Effects that may be missing beside those adopted."""
    doubtful: bool = False
    """Whether so much is not excluded that one more test is worth its time."""
    alike: tuple[str, ...] = ()
    """Adopted effects whose values show that something else, of a like force, is in their place."""


Conclusion = tuple[Adoption, Decision]
"""The effects that are adopted, and the verdict."""


def judge(selection: Selection, validation: CrossValidation, config: DiagnoseConfig, unit: str) -> Conclusion:
    """Decide which of the selected effects are adopted, and reach the verdict on them.

    Parameters
    ----------
    selection : effects selected
    validation : cross-validation of the tests
    config : thresholds, forced and forbidden effects
    unit : of the control signal, for the reason
    """
    adoption = _polished(adopt_effects(selection, validation, config.force, unit))
    decision = _decided(adoption, config)
    # By its interval, which counts how the tests disagree, what gets a name is told from its absence as from a rival.
    level = max(LEVEL, float(np.sqrt(config.rival_bic)))
    kept = adoption.selection
    if decision.verdict != "unexplained" and first_undetermined(
        kept.final_evidence.whole, kept.fitted, config.force, level
    ):
        adoption = _polished(adopt_effects(selection, validation, config.force, unit, level))
        decision = _decided(adoption, config)
    if decision.verdict != "unexplained":
        trend = nuisance_trend(selection.initial_evidence.campaign, adoption.selection.fitted.damper, config)
        if trend is not None:
            decision = Decision("unexplained", f"{decision.reason}; but {trend}", None)
    return adoption, decision


def conclude(judged: Conclusion, validation: CrossValidation, config: DiagnoseConfig) -> Conclusion:
    """Look for more effects that predict where the gap has no name, and say what else may look like those adopted.

    Parameters
    ----------
    judged : by `judge`
    validation : cross-validation of the tests
    config : thresholds, forced and forbidden effects
    """
    adoption, decision = judged
    if decision.verdict == "unexplained":
        extended = add_predictive_effects(adoption, validation, config)
        adoption = _polished(plain_unless_better(extended, validation, config.force))
        if extended.selection.adopted and not adoption.selection.adopted:
            tried = " and ".join(extended.selection.adopted)
            words = f"with {tried} kept-back tests are predicted no better than by the plain damper, which is handed on"
            decision = replace(decision, reason=f"{decision.reason}; {words}")
        elif adoption.rejection and not adoption.selection.adopted:
            decision = replace(decision, reason=f"{decision.reason}, which is handed on")
        if added := adoption.added:
            stands = "it stands" if len(added) == 1 else "they stand"
            words = f"kept-back tests are predicted better with {' and '.join(added)}, whatever {stands} for"
            decision = replace(decision, reason=f"{decision.reason}; {words}")
    hints = "".join(f"; {hint}" for hint in _hints(adoption, decision))
    return adoption, replace(decision, reason=f"{decision.reason}{hints}")


def _hints(adoption: Adoption, decision: Decision) -> Iterator[str]:
    """Yield what else may look like the adopted effects, and what would tell."""
    selection = adoption.selection
    told = {*selection.adopted, *selection.rivals, *decision.possible}
    if {"valve_lag", "piezo_hysteresis"} <= told:
        yield (
            "a control signal that moves at rates farther apart tells a lag, whose force grows with the rate, from a "
            "hysteresis, whose force does not: until then the force under a faster one is not known"
        )


def _decided(adoption: Adoption, config: DiagnoseConfig) -> Decision:
    if adoption.rejection:
        return Decision("unexplained", adoption.rejection, None)
    return decide(adoption.selection, config)


def _polished(adoption: Adoption) -> Adoption:
    """Search the fit of what is adopted on to its optimum, so that its figures can be quoted."""
    selection = adoption.selection
    if not selection.adopted:
        return adoption
    fitted = polished(selection.final_evidence.whole, selection.fitted)
    return replace(adoption, selection=replace(selection, fitted=fitted))


# --- Verdict from what is left of the gap


def decide(selection: Selection, config: DiagnoseConfig) -> Decision:
    """Reach the verdict on the adopted effects from what is left of the gap.

    Parameters
    ----------
    selection : effects adopted
    config : thresholds
    """
    checks = selection.initial_evidence.campaign.checks
    before = checks(selection.baseline.damper)
    after = checks(selection.fitted.damper) if selection.adopted else before
    sizes = visible_gap(before), visible_gap(after)
    chances = probability_of_noise(before), probability_of_noise(after)
    if not selection.adopted:
        return _nothing_adopted(sizes[0], chances[0], selection, config)
    whole = gap_with_nuisances(before), gap_with_nuisances(after)
    change = f"{' and '.join(selection.adopted)}: {_gap_change(selection, sizes, whole, config)}"
    if leaves_too_much(sizes, chances[1], config):
        words = f"{change}, and what is left repeats (probability by noise alone {max(chances[1], 1e-300):.1g})"
        hardly = sizes[1] > thresholds.HARDLY_CLOSED * sizes[0]
        return Decision("unexplained", words, None, alike=selection.adopted if hardly else ())
    odd = selection.fitted.unphysical
    if odd and not selection.rivals:
        value = f"a value that no {' and no '.join(odd)} has"
        words = f"{change}; but with {value}, so that it is something that looks alike"
        return Decision("unexplained", words, None, alike=tuple(odd))
    varying = varying_strengths(selection.final_evidence.whole, selection.fitted, config.significance)
    if varying and not selection.rivals:
        told = " and ".join(
            f"{each.parameter} of {name} differs by {_percent(each.share)} from test to test (probability by noise "
            f"alone {max(each.probability, 1e-300):.1g})"
            for name, each in varying.items()
        )
        words = f"{change}; but {told}, so that it is something that looks alike"
        return Decision("unexplained", words, None, alike=tuple(varying))
    better = [m for m in selection.competing_confounders if m.bic_difference < -config.rival_bic]
    if better:
        laws = [
            f"{known()[m.confounder].law}, which is not in the library, does better than {m.effect}" for m in better
        ]
        return Decision("unexplained", f"{change}; but {' and '.join(laws)}", None)
    return _explained(change, selection, config)


def _explained(change: str, selection: Selection, config: DiagnoseConfig) -> Decision:
    """Decide where the adopted effects explain the gap: whether something else does, or is likely beside them."""
    sure = verdict_confidence(selection, config)
    if selection.rivals or selection.competing_confounders:
        laws = [f"{known()[m.confounder].law} (not in the library)" for m in selection.competing_confounders]
        called = {other: name for name, other in selection.nearly.items() if other in selection.rivals}
        others = ", ".join((*(name for name in selection.rivals if name not in called), *laws))
        told = [f"{others} would do as well on these tests"] if others else []
        told += [f"{name} with such values may be {other}" for other, name in called.items()]
        return Decision("ambiguous", f"{change}; {'; '.join(told)}", sure)
    # A common offset or delay too: an effect is named here, and a reader would take it for all that is missing.
    if possible := _likelier_alternatives(selection, config, ()):
        words = f"{change}{_not_excluded_note(selection, config)} beside it"
        sure = verdict_confidence(selection, config, possible)
        return Decision("ambiguous", words, sure, possible, doubtful=True)
    doubt = _not_excluded_note(selection, config) if sure < thresholds.DOUBTFUL_BELOW else ""
    words = f"{change}; what is left is within the noise or negligible{doubt}"
    return Decision("named", words, sure, doubtful=bool(doubt))


def with_parts_told(decision: Decision, support: Mapping[str, Support]) -> Decision:
    """Return the verdict, `ambiguous` for `named` where one adopted effect may be a part of another.

    Parameters
    ----------
    decision : on what the selected effects leave
    support : of every adopted effect
    """
    parts = {name: each.replaced_by for name, each in support.items() if each.replaced_by in support}
    if decision.verdict != "named" or not parts:
        return decision
    words = " and ".join(f"{name} may be a part of {other}" for name, other in parts.items())
    why = "no law of the library need bend as the damper's does"
    return replace(decision, verdict="ambiguous", reason=f"{decision.reason}; but {words}: {why}")


MOSTLY_NUISANCES = 2.0
"""Times as large as the gap that the whole error is from which both are told.

Reason: three quarters of it (mean square) are then what a zero, gain and delay of each test make up for. Not tuned."""


def _gap_change(
    selection: Selection, sizes: tuple[float, float], whole: tuple[float, float], config: DiagnoseConfig
) -> str:
    """Say what the adopted effects change: the gap, or where noise hid that, the force in their own direction.

    Parameters
    ----------
    selection : effects adopted
    sizes, whole : gap before and after, and the same with what zero, gain and delay of the tests make up for
    config : thresholds
    """
    if sizes[0] >= config.negligible:
        change = f"the gap {_course(sizes)} of peak"
        if whole[0] <= MOSTLY_NUISANCES * sizes[0]:
            return change
        error = f"the error {_course(whole)} of peak"
        return f"{error}; {change} beside what a zero, gain and delay of each test would explain"
    # Evidence begun from another damper may simulate other parts of a record.
    final, fits = selection.final_evidence.whole, (selection.baseline, selection.fitted)
    plain, adopted = ([shown_force(o, each.damper) for o in final.observations] for each in fits)
    moved = force_change(final, plain, adopted)
    return (
        f"moves the force by {_percent(moved)} of peak, more than noise does in just that way, "
        f"though the gap as a whole ({_percent(sizes[0])} of peak above the noise) does not stand out of it"
    )


def _course(sizes: tuple[float, float]) -> str:
    """Say how a size went from before to after."""
    course = "falls" if sizes[1] < sizes[0] else "does not fall, but goes"
    return f"{course} from {_percent(sizes[0])} to {_percent(sizes[1])}"


def leaves_too_much(sizes: tuple[float, float], chance: float, config: DiagnoseConfig) -> bool:
    """Whether what adopted effects leave repeats, and is too much for a name: of the gap, or of what is visible.

    Parameters
    ----------
    sizes : gap before and after (r.m.s. above the noise), as shares of peak
    chance : probability of what is left by noise alone
    config : thresholds
    """
    share = sizes[1] > config.unexplained_share * sizes[0] and sizes[1] >= config.negligible
    return chance < config.significance and (share or sizes[1] >= thresholds.LARGE_REMAINDER * config.visible)


def _nothing_adopted(size: float, chance: float, selection: Selection, config: DiagnoseConfig) -> Decision:
    """Decide where no effect was adopted, from the size of the gap and its probability by noise alone."""
    sure = verdict_confidence(selection, config)
    gap = f"a gap of {_percent(size)} of peak force (r.m.s. above the noise)"
    if chance < config.significance and size >= config.visible:
        alone = f"probability by noise alone {max(chance, 1e-300):.1g}"
        return Decision(
            "unexplained", f"{gap} that repeats ({alone}); no effect that a verdict names is supported by itself", None
        )
    possible = tuple(
        dict.fromkeys((*selection.undecided, *_likelier_alternatives(selection, config, thresholds.NUISANCE_EFFECTS)))
    )
    if possible:
        words = "; ".join(f"{name} {selection.reasons[name]}" for name in selection.undecided)
        words = words or f"{gap}{_not_excluded_note(selection, config)}"
        sure = verdict_confidence(selection, config, possible)
        return Decision("ambiguous", f"{words}; more tests would settle it", sure, possible, doubtful=True)
    if chance >= config.significance:
        words = f"{gap} that noise alone shows with probability {chance:.2g}: within the noise"
    else:
        words = f"{gap}, repeatable but smaller than {_percent(config.visible)} of peak: counts as nothing missing"
    doubtful = sure < thresholds.DOUBTFUL_BELOW
    words += _not_excluded_note(selection, config) if doubtful else ""
    return Decision("none", words, sure, doubtful=doubtful)


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %"


# --- Confidence: posterior probability of the verdict


def verdict_confidence(selection: Selection, config: DiagnoseConfig, beside: Collection[str] = ()) -> float:
    """Compute the probability that what is missing is what was adopted or a rival of it, and nothing else that counts.

    Prior: something more is missing as likely as not, each effect of the library is as likely as any other, and each
    size of its gap as likely as any other by its logarithm. What is not in the library is expected to be seen as well
    as what is, but for a share that looks like one of its effects or like nothing.

    Equation: P = (1 - q) prod_r sum_(i named) B_i / (n B_0 + sum_i B_i), B_i as in `Detection.log_odds` over the sizes
    that count, B_0 = (1 + mean_i B_i below them) / 2; r every step that adopted something, and what was tried after the
    last, where nothing more is named as well; q `OUTSIDE_LIBRARY`
                                                        Source: Kass and Raftery 1995, J. Am. Stat. Assoc. 90, eq. (1)

    Parameters
    ----------
    selection : effects adopted, and what was tried
    config : which gaps count
    beside : effects that are reported as possible beside the adopted ones
    """
    named = {*selection.adopted, *selection.rivals}
    sure = 1.0 - thresholds.OUTSIDE_LIBRARY
    for step in selection.steps:
        if step.chosen in selection.adopted:
            low_force = selection.final_evidence.whole.scales.low_force
            tried = {c.effect: detection_from_fit(c, low_force) for c in distinct(step)}
            sure *= _total_probability(_probabilities(tried, config.visible), named)
    sure *= _total_probability(_remaining_probabilities(selection, config), {None, *selection.undecided, *beside})
    for match in selection.competing_confounders:
        sure /= 1.0 + float(np.exp(-0.5 * match.bic_difference))
    return round(sure, 3)


def not_excluded(selection: Selection, config: DiagnoseConfig) -> dict[str, Detection]:
    """Return the effects beside those adopted and their rivals that the tests do not exclude, the likeliest first.

    Parameters
    ----------
    selection : effects adopted, and what was tried
    config : which gaps count
    """
    chances = _remaining_probabilities(selection, config)
    likely = [name for name, chance in chances.items() if name is not None and chance >= thresholds.NOT_EXCLUDED]
    likely.sort(key=chances.__getitem__, reverse=True)
    return {name: max(selection.open_detections[name], key=lambda each: each.size) for name in likely}


def _likelier_alternatives(selection: Selection, config: DiagnoseConfig, beside: Collection[str]) -> tuple[str, ...]:
    """Return the effects that the tests do not exclude, where these together are likelier than the verdict.

    Where nothing is adopted an offset, a delay or a lag may be each test's own: whether these are open depends on their
    size, see `trivial`.

    Parameters
    ----------
    selection : effects adopted, and what was tried
    config : which gaps count
    beside : effects that may be there without being asked for
    """
    if verdict_confidence(selection, config, beside) >= thresholds.LIKELIER_THAN_NOT:
        return ()
    return tuple(name for name in not_excluded(selection, config) if name not in beside)


def _not_excluded_note(selection: Selection, config: DiagnoseConfig) -> str:
    likely = [f"{name} ({found.interval})" for name, found in not_excluded(selection, config).items()]
    return f"; these tests do not exclude {' or '.join(likely)}" if likely else ""


def _remaining_probabilities(selection: Selection, config: DiagnoseConfig) -> dict[str | None, float]:
    """Compute the probability of every effect beside those adopted and their rivals; under None that of no more."""
    named = {*selection.adopted, *selection.rivals}
    others = {name: found for name, found in selection.open_detections.items() if name not in named}
    return _probabilities(others, config.visible)


def _probabilities(tried: Mapping[str, Sequence[Detection]], visible: float) -> dict[str | None, float]:
    """Compute the posterior probability of each effect, and under None that of no effect."""
    from scipy.special import logsumexp, softmax

    smallest, largest = thresholds.SMALLEST_GAP * visible, thresholds.LARGEST_GAP
    tested = {name: found for name, found in tried.items() if found}
    if not tested:
        return {None: 1.0}

    def log_odds(found: Sequence[Detection], *, counts: bool) -> float:
        """Average the odds over the starting values of an effect, over the gaps that count or over smaller ones."""
        odds = []
        for each in found:
            least = min(max(visible, each.relevant_from), largest / 2.0)
            odds.append(each.log_odds(least, largest) if counts else each.log_odds(smallest, least))
        return float(logsumexp(odds) - np.log(len(found)))

    small = [log_odds(found, counts=False) for found in tested.values()]
    nothing = float(np.logaddexp(0.0, logsumexp(small) - np.log(len(tested)))) - np.log(2.0) + np.log(len(tested))
    odds: dict[str | None, float] = {None: nothing}
    odds.update((name, log_odds(found, counts=True)) for name, found in tested.items())
    return dict(zip(odds, map(float, softmax([*odds.values()])), strict=True))


def _total_probability(chances: Mapping[str | None, float], named: Collection[str | None]) -> float:
    return sum(chance for name, chance in chances.items() if name in named)


# --- Trend of the tests' own gains, offsets and delays
#
# A fit allows each test a gain, an offset and a delay of its own. By chance they scatter from test to test. Where they
# follow the frequency, the speed, the stroke or the temperature of the tests, something of the damper or of the stand
# is missing that these allowances hide.


NUISANCE_UNITS = NuisanceConfig(offset=0.01, delay_s=0.001, gain=0.01)
"""Units of the nuisances: a hundredth of the peak force, a millisecond, a hundredth of the force."""
SAME_BUT_FOR_ROUNDING = 1e-6
"""Relative difference below which tests have the same frequency, speed, stroke or temperature.

Reason: rounding in files; not tuned."""
NUISANCE_NAMES = ("offset", "gain", "delay")
"""Nuisances of a test, in the order of `columns_of`."""


@dataclass(frozen=True)
class NuisanceTrend:
    """A nuisance of the tests that follows a quantity of their motion."""

    nuisance: str
    follows: str
    size: float
    """R.m.s. of the force that it contributes to the tests beyond one value for all, as a share of peak."""
    probability: float
    """Of such a trend by chance alone, corrected for all pairs that were tried."""

    def __str__(self) -> str:
        """Describe the trend in words."""
        return (
            f"the {self.nuisance} that each test is allowed follows its {self.follows} ({100.0 * self.size:.2g} % of "
            f"peak, probability by chance {max(self.probability, 1e-300):.1g}), which no chance of single tests does"
        )


def nuisance_trend(campaign: Campaign, damper: Damper, config: DiagnoseConfig) -> NuisanceTrend | None:
    """Return the most significant trend of the tests' nuisances over their motion; None where chance explains all.

    Its size is that of the force which it contributes to the very tests: a late clock hardly moves the force of a slow
    test, and is the less known for it.

    Equation: t = b / sqrt(sum e^2 / (n - g - 1) / sum x^2), y = b x + e about the means in each of g conditions;
    size^2 = min_c sum (f (b x - c))^2 / n, f the force of one unit in each test, c one value a condition
                                                            Source: least squares; Bonferroni over the pairs

    Parameters
    ----------
    campaign : the tests
    damper : that they are compared with
    config : which probability is significant, and what is visible
    """
    checks = [c for c in campaign.checks(damper) if c.cleaned.constant and (c.wanted & c.calm).any()]
    if not checks:
        return None
    condition = np.array([nearest_row(damper.base, c.cleaned) for c in checks])
    nuisances, forces = _test_nuisances(checks)
    pairs = [
        (name, follows, _within_condition_trend(nuisances[:, i], forces[:, i], over, condition))
        for i, name in enumerate(NUISANCE_NAMES)
        for follows, over in _motion_quantities(checks)
    ]
    found = [
        NuisanceTrend(name, follows, trend[0], min(1.0, len(pairs) * trend[1]))
        for name, follows, trend in pairs
        if trend is not None
    ]
    visible = thresholds.LARGE_REMAINDER * config.visible
    significant = [t for t in found if t.probability < config.significance and t.size >= visible]
    return min(significant, key=lambda t: t.probability, default=None)


def _test_nuisances(checks: Sequence[ResidualCheck]) -> tuple[Array, Array]:
    """Estimate (n, 3) offset, gain, delay of every test in `NUISANCE_UNITS`, and (n, 3) force of one unit [peak].

    Beside no jump: there a delay is the part of a sample by which a reversal lies off, which follows the motion.
    """
    found, forces = [], []
    for check in checks:
        at = check.wanted & check.calm
        columns = nuisance_columns(check.predicted[at], check.cleaned.record.rate, NUISANCE_UNITS, at)
        found.append(np.linalg.lstsq(columns, check.residual[at], rcond=None)[0])
        forces.append(np.sqrt(np.mean(columns**2, axis=0)) / check.peak)
    return np.array(found).reshape(-1, 3), np.array(forces).reshape(-1, 3)


def _motion_quantities(checks: Sequence[ResidualCheck]) -> Iterator[tuple[str, Array]]:
    """Yield by name the quantities (n,) in which tests differ; NaN where a test has none."""
    records = [c.cleaned.record for c in checks]
    cycles = [c.cleaned.cycles for c in checks]
    yield "frequency", np.log([np.nan if run is None else run.frequency for run in cycles])
    yield "speed", np.log([rms(r.velocity) for r in records])
    yield "stroke", np.log([float(np.ptp(r.displacement)) for r in records])
    temperatures = [r.median_temperature() for r in records]
    yield "temperature", np.array([np.nan if t is None else t for t in temperatures])


def _within_condition_trend(
    values: Array, forces: Array, over: Array, condition: NDArray[np.int64]
) -> tuple[float, float] | None:
    """Compute the r.m.s. force of a trend within conditions and its probability by chance; None with too few tests.

    Parameters
    ----------
    values : (n,) of a nuisance
    forces : (n,) r.m.s. force of one unit of it in each test
    over : (n,) that it may follow, NaN where a test has none
    condition : (n,) base row of each test
    """
    from scipy.special import stdtr

    known = np.isfinite(over)
    y, x, condition, unit = values[known], over[known], condition[known], forces[known]
    free = y.size - np.unique(condition).size - 1
    if free < thresholds.FEWEST_FOR_A_TREND:
        return None
    for each in np.unique(condition):
        inside = condition == each
        y[inside] -= y[inside].mean()
        x[inside] -= x[inside].mean()
    if np.ptp(x) <= SAME_BUT_FOR_ROUNDING * max(1.0, float(np.max(np.abs(over[known])))):
        return None
    slope = float(x @ y / (x @ x))
    left = float(np.sum((y - slope * x) ** 2)) / free
    contributed = slope * x
    for each in np.unique(condition):
        inside = condition == each
        if np.any(unit[inside]):
            contributed[inside] -= np.average(contributed[inside], weights=unit[inside] ** 2)
    size = rms(unit * contributed)
    if left <= 0.0:
        return size, 0.0 if slope else 1.0
    return size, float(2.0 * stdtr(free, -abs(slope) * np.sqrt(float(x @ x) / left)))


# --- Verdicts without a search


def insufficient_data(campaign: Campaign) -> bool:
    """Whether the records are too short for the search: nothing to weigh, or nothing to fit."""
    samples = campaign.seen, campaign.in_role(TRAINING)
    return not all(any(map(enough_samples, campaign.cleaned, masks)) for masks in samples)


def insufficient_data_diagnosis(recorded: Sequence[CleanedRecord], envelope: OperatingEnvelope) -> Diagnosis:
    """Return the diagnosis of records that are too short: nothing is known, and a longer test is proposed.

    Parameters
    ----------
    recorded : records of the setting, their displacement as recorded
    envelope : operating envelope of a test
    """
    longest = max(p.record.time.size for p in recorded)
    return Diagnosis.without_effects(
        verdict="ambiguous",
        reason=(
            "the records are too short to tell noise from what is missing: too little of them repeats a cycle, and "
            f"a motion that does not repeat takes {FEWEST_SAMPLES} samples to fit, the same to choose and to hold out "
            f"(the longest record has {longest}); record {CYCLES_IN_WORDS} cycles of a test, "
            "of at least 40 samples each"
        ),
        gap=None,
        next_test=repeated_longest_test(recorded, envelope),
    )


def no_slip_diagnosis(rows: Sequence[ParameterRow]) -> Diagnosis:
    """Return the diagnosis of tests none of which slips: the oil spring is all that they show.

    Where it stands at the start of a record is an unknown of the record, and no preload.

    Parameters
    ----------
    rows : of the setting, as identified
    """
    force = max(row.T0_N_low95 or 0.0 for row in rows)
    return Diagnosis.without_effects(
        verdict="ambiguous",
        reason=(
            "no test slips: the force only strains the oil spring, so that the tests show k and nothing of what flows, "
            f"and any effect may be there; friction is above {force:.3g} N: record tests of a longer stroke, several "
            "times that over which the force still grows after a reversal"
        ),
        gap=None,
    )


def knee_suffices(identified: Identified, setting: str | None, config: DiagnoseConfig) -> Diagnosed | None:
    """Adopt the damper with the knee law unchanged where it misses nothing visible; None where it does.

    Parameters
    ----------
    identified : with the knee law of the setting
    setting : of the rig's settings, the one in use
    config : what is visible
    """
    rows, damper = identified.knees.of(setting), identified_damper(identified, setting)
    missed = max(row.missed_share for row in rows)
    if missed >= config.visible:
        return None
    left = f"up to {missed:.1%} of peak beyond noise, which is negligible" if missed else "nothing beyond noise"
    law = next(row for row in identified.knees.laws if row.setting == setting)
    diagnosis = Diagnosis.without_effects(
        "none", f"the knee law of 2-identify/knee.csv misses {left}, and is handed on; {law.reason}", gap=None
    )
    diagnosis = diagnosis.model_copy(update={"zero_m": damper.zero_m})
    return Diagnosed(diagnosis, damper, damper, knee_parameters(rows))


def knee_parameters(rows: Sequence[KneeRow]) -> tuple[ParameterRow, ...]:
    """Return T0, C and k of the conditions of a damper by the knee law."""
    return tuple(map(_knee_parameters, rows))


def _knee_parameters(row: KneeRow) -> ParameterRow:
    """Return T0, C (mean bleed of both directions) and k of one condition; a friction on the rod is no T0."""
    of_flow = row.friction_on_rod == 0.0
    shared = ("setting", "voltage_V", "temperature_degC", "k_N_per_m", "k_N_per_m_low95", "k_N_per_m_high95")
    return ParameterRow(
        **row.model_dump(include={*shared, "W_s", "rmse_N"}),
        T0_N=row.friction_of_flow,
        T0_N_low95=row.friction_N_low95 if of_flow else None,
        T0_N_high95=row.friction_N_high95 if of_flow else None,
        C_Ns_per_m=mean_bleed(row.rebound_bleed_Ns_per_m, row.compression_bleed_Ns_per_m),
        C_Ns_per_m_low95=None,
        C_Ns_per_m_high95=None,
        status="ok" if row.status == "ok" else "weak: T0, C, k (2-identify/knee.csv says why)",
    )


# --- Notes on what limits a verdict


def hold_out_note(hold_out: str) -> str:
    """Say where held-out data come from tests that were also fitted."""
    if hold_out == "records":
        return ""
    parts = {"mixed": "some whole tests, and parts"}.get(hold_out, hold_out)
    return f"; held out were {parts} of tests that were also fitted, which is weak evidence"


def alone_note(validation: CrossValidation) -> str:
    """Say where a test that is kept back leaves none at its temperature, so that the others do not know it."""
    cleaned = validation.campaign.cleaned
    rows = {i: nearest_row(validation.baseline.base, p) for i, p in enumerate(cleaned) if p.constant}
    alone = sum([*rows.values()].count(row) == 1 and i not in validation.lone for i, row in rows.items())
    if not alone:
        return ""
    return f"; {counted(alone, 'test')} kept back left none at the same temperature, and were predicted from the others"


def knee_note(law: str, verdict: str, base: Sequence[BaseRow]) -> str:
    """Say that a passive damper may have another law, where the verdict is that something without a name is missing.

    Parameters
    ----------
    law : `identify.law`
    verdict : what is said of the damper, or of what changed in it
    base : rows of the damper
    """
    passive = all(row.voltage_V is None for row in base)
    if law != "bingham" or verdict != "unexplained" or not passive:
        return ""
    return "; a passive damper has bleed, knee and blow-off: identify: {law: auto} tries that law"


SHOWS_BETWEEN = 0.05
"""Share of the samples of tests with a moving control signal in the middle half between two levels, from which on they
show whether the damper bends there: a step passes in a hundredth, and a node there would have nothing to be fitted to.
"""


def nodes_note(cleaned: Sequence[CleanedRecord], base: Sequence[BaseRow], signal: str) -> str:
    """Say that T0 and C are straight lines between few control signals, where some test moves and stays between these.

    Parameters
    ----------
    cleaned : the tests
    base : rows of the damper
    signal : name of the control signal
    """
    levels = sorted({row.voltage_V for row in base if row.voltage_V is not None})
    moves = [v for each in cleaned if not each.constant and (v := each.record.voltage) is not None]
    if not moves or len(levels) < 2:
        return ""
    scale = max(map(abs, (*levels, levels[-1] - levels[0])))
    moving = np.concatenate(moves)
    # identify refuses nodes closer than half
    wide = [(low, high) for low, high in pairwise(levels) if high - low > 4.0 * CONSTANT_SHARE * scale]
    if not wide:
        return ""
    halves = [
        0.5 * (low + high)
        for low, high in wide
        if np.mean(np.abs(moving - 0.5 * (low + high)) < 0.25 * (high - low)) >= SHOWS_BETWEEN
    ]
    lines = f"; between {len(levels)} levels T0, C and k are straight lines over the {signal}"
    if not halves:
        return f"{lines}, and no test stays between them that would show whether they bend: a slow ramp does"
    finer = sorted({*levels, *halves})
    return f"{lines}: identify: {{nodes: [{', '.join(f'{each:.4g}' for each in finer)}]}} tells whether they bend there"


MUCH_BY_TEMPERATURE = 0.05
"""Change of T0 or C from the coldest to the warmest condition that is told, and share of the force from which either is
asked: what a few kelvin make of an oil."""


def temperature_note(base: Sequence[BaseRow], speed: float) -> str:
    """Say how T0 and C follow the temperature, where they are those of each: no drift is missing beside them.

    Parameters
    ----------
    base : rows of the damper without effects
    speed : largest of the tests [m/s]; of T0 and C that which makes little of the force there is not told
    """
    changes: dict[str, list[float]] = {"T0": [], "C": []}
    ends: list[float] = []
    for _, rows in rows_per_voltage(base):
        known = sorted(
            (row.temperature_degC, row.T0_N, speed * row.C_Ns_per_m) for row in rows if row.temperature_degC is not None
        )
        if len(known) < 2:
            continue
        (cold, *before), (warm, *after) = known[0], known[-1]
        ends += [cold, warm]
        for name, one, other in zip(changes, before, after, strict=True):
            changes[name] += [other / one - 1.0] if one > MUCH_BY_TEMPERATURE * sum(before) else []
    told = {name: float(np.mean(values)) for name, values in changes.items() if values}
    much = [f"{name} {100.0 * change:+.2g} %" for name, change in told.items() if abs(change) >= MUCH_BY_TEMPERATURE]
    if not much:
        return ""
    span = f"from {min(ends):.3g} to {max(ends):.3g} degC"
    return f"; T0, C and k are those of each temperature: {' and '.join(much)} {span}"


REACHED = 0.1
"""Share of the depth to which the other stop is compressed from which a stop counts as reached.

Reason: its force there is a hundredth, which no fit tells from a stop that begins a little further out."""


def one_stop_note(damper: Damper, displacements: Sequence[Array]) -> str:
    """Say where no test came to one of the two stops of an `end_stop`, which its law has at both ends alike.

    Parameters
    ----------
    damper : with the stops, about its `zero_m`
    displacements : of the tests [m]
    """
    begins, zero = float(np.max(damper.effects["end_stop"]["x_e"])), damper.zero_m
    inner, outer = zero - begins, zero + begins
    into_inner = inner - min(float(np.min(x)) for x in displacements)
    into_outer = max(float(np.max(x)) for x in displacements) - outer
    if min(into_inner, into_outer) >= REACHED * max(into_inner, into_outer):
        return ""
    other = inner if into_inner < into_outer else outer
    return f"; one stop alone was reached: whether there is another, as here at x = {other:.3g} m, no test tells"


def no_prediction_note(prediction: Prediction | None) -> str:
    """Say where no test could be held out."""
    return "" if prediction else "; there is too little to keep a test back, so that nothing shows what this predicts"
