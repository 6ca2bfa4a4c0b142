"""From the records of one setting to verdict, adopted damper and next test: the steps of the diagnosis in order."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pzd.artefacts import (
    Diagnosed,
    Diagnosis,
    Identified,
    NextTest,
    ParameterRow,
    Rig,
    base_of,
    identified_damper,
)
from pzd.artefacts.diagnosis import Verdict
from pzd.damper.effects import library, nameable
from pzd.damper.fitted_laws import seal
from pzd.damper.model import Damper
from pzd.damper.parameter_rows import rows_per_voltage
from pzd.diagnosis import next_test, thresholds
from pzd.diagnosis.adoption import Adoption, by_criterion_if_better
from pzd.diagnosis.campaign import Campaign, evidence_of
from pzd.diagnosis.cleaned_records import (
    CleanedRecord,
    centred_on,
    clean,
    drift_note,
    saturation_note,
    unsaturated_records,
    without_drift,
)
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.cross_validation import CrossValidation, cross_validation_of
from pzd.diagnosis.entries import base_parameters, held_out_gap, may_be_none, parameters_of, ranking_of
from pzd.diagnosis.fit.least_squares import polished, refit
from pzd.diagnosis.fit.problem import Budget
from pzd.diagnosis.gap import ResidualCheck, probability_of_noise, regions, visible_gap
from pzd.diagnosis.hypotheses import hypotheses
from pzd.diagnosis.mains import with_hum
from pzd.diagnosis.next_test import OperatingEnvelope
from pzd.diagnosis.predictive_search import improves
from pzd.diagnosis.roles import split
from pzd.diagnosis.search.acceptance import Selection
from pzd.diagnosis.search.candidates import candidate, converged, has_name
from pzd.diagnosis.search.determination import first_undetermined
from pzd.diagnosis.search.forward_selection import select_effects
from pzd.diagnosis.support import support_of
from pzd.diagnosis.verdict import (
    Conclusion,
    Decision,
    alone_note,
    conclude,
    hold_out_note,
    insufficient_data,
    insufficient_data_diagnosis,
    judge,
    knee_note,
    knee_parameters,
    knee_suffices,
    leaves_too_much,
    no_prediction_note,
    no_slip_diagnosis,
    nodes_note,
    nuisance_trend,
    one_stop_note,
    temperature_note,
    with_parts_told,
)
from pzd.fit.cross_validation import predicts_worse
from pzd.identification.config import IdentifyConfig
from pzd.quantities import Control
from pzd.record import mid_stroke
from pzd.rig.config import RigConfig
from pzd.schema.errors import counted
from pzd.signals.measures import rms

log = logging.getLogger(__name__)


def diagnose_setting(
    diagnose: DiagnoseConfig,
    identify: IdentifyConfig,
    stand: RigConfig,
    rig: Rig,
    identified: Identified,
    control: Control,
    setting: str | None,
    jobs: int,
) -> Diagnosed:
    """Diagnose one setting; parameters and result are those of `pzd.diagnosis.stage.diagnose`."""
    asked = _Asked(diagnose, identify, stand, rig, control, setting, jobs)
    rows = tuple(row for row in identified.rows if row.setting == setting)
    if identified.knees.law_of(setting) != "knee":
        return _searched(asked, base_of(identified.rows, setting), rows).hand_on()
    if (suffices := knee_suffices(identified, setting, diagnose)) is not None:
        return suffices
    law = next(row for row in identified.knees.laws if row.setting == setting)
    bingham = _searched(asked, base_of(identified.rows, setting), rows) if identify.law == "auto" else None
    # What the knee law misses may be an effect beside T0, C and k, in whose place the knee stands.
    if bingham is not None and bingham.verdict != "unexplained":
        found = bingham.hand_on()
        if _predicts_far_better(found, law.W_s_knee):
            return _with_law(found, INSTEAD_OF_KNEE)
    knees = knee_parameters(identified.knees.of(setting))
    beside = _searched(asked, identified_damper(identified, setting), knees).hand_on()
    reached = beside.diagnosis.prediction
    if bingham is not None and beside.diagnosis.verdict == "unexplained":
        found = bingham.hand_on()
        if _predicts_far_better(found, reached.W_s if reached else law.W_s_knee):
            return _with_law(found, INSTEAD_OF_KNEE)
    return _with_law(beside, f"beside the knee law of 2-identify/knee.csv; {law.reason}")


INSTEAD_OF_KNEE = (
    "beside one T0 and C: kept-back tests are predicted far better so than by the knee law, with less than "
    f"{thresholds.BETTER_THAN_KNEE:.0%} of its W_s"
)
"""Why a damper beside T0, C and k is handed on where identify took the knee law."""


def _with_law(diagnosed: Diagnosed, law: str) -> Diagnosed:
    """Say in the reason beside which law of the element effects were looked for."""
    reason = f"{diagnosed.diagnosis.reason}; this is {law}"
    return replace(diagnosed, diagnosis=diagnosed.diagnosis.model_copy(update={"reason": reason}))


@dataclass(frozen=True, eq=False)
class _Asked:
    """What is diagnosed: the records of one setting, and what the config says of them."""

    diagnose: DiagnoseConfig
    identify: IdentifyConfig
    stand: RigConfig
    rig: Rig
    control: Control
    setting: str | None
    jobs: int


@dataclass(frozen=True, eq=False)
class _Searched:
    """What a search beside one law of the element names, and what to ask for the damper that is handed on."""

    verdict: Verdict
    hand_on: Callable[[], Diagnosed]
    """Looks for what predicts where the gap has no name, which takes longer than the naming; gives the whole."""


def _searched(asked: _Asked, identified: Damper, rows: tuple[ParameterRow, ...]) -> _Searched:
    """Search beside the damper that identify found, with T0, C and k of each condition in rows."""
    diagnose, identify, control, setting = asked.diagnose, asked.identify, asked.control, asked.setting
    records, saturated = unsaturated_records(asked.rig, setting)
    records, drift = without_drift(asked.rig, records)
    recorded = clean(records)
    # Effects are fitted about the middle of the stroke, and written with the displacement as recorded.
    cleaned = centred_on(recorded, zero := mid_stroke(each.record.displacement for each in recorded))
    roles = split(cleaned, identify.group.voltage_V, identify.group.temperature_degC)
    baseline = identified.about(zero).moved(-zero)
    cleaned = with_hum(cleaned, baseline)
    budget, law = Budget(diagnose.most_evaluations), tuple(baseline.effects)
    campaign = Campaign(cleaned, roles, diagnose.nuisance, asked.jobs, budget, law)
    voltages = [row.voltage_V for row in baseline.base if row.voltage_V is not None]
    envelope = next_test.operating_envelope(asked.stand.limits, recorded, voltages)

    def without(diagnosis: Diagnosis) -> _Searched:
        return _Searched(diagnosis.verdict, lambda: Diagnosed(diagnosis, identified, identified, rows))

    if all(row.shows_oil_spring_alone for row in rows):
        return without(no_slip_diagnosis(rows))
    if insufficient_data(campaign):
        return without(insufficient_data_diagnosis(recorded, envelope))
    judged = _judged(campaign, baseline, diagnose, control.unit)
    judged = _with_zeros_of_tests(judged)
    judged = _with_seal(judged)
    judged = _with_one_alone(judged)

    def hand_on() -> Diagnosed:
        campaign, validation = judged.campaign, judged.validation
        adoption, decision = _concluded(judged)
        adoption = by_criterion_if_better(adoption, validation, diagnose.force)
        support = support_of(adoption, validation, (*decision.alike, *may_be_none(adoption.selection, control)))
        decision = with_parts_told(decision, support)
        selection, prediction = adoption.selection, adoption.prediction(validation)
        plain_selection = judged.without_seal or selection
        before = campaign.checks(plain_selection.baseline.damper)
        log.info("diagnose: %s, %s; %.2g forces computed", decision.verdict, decision.reason, campaign.budget.spent)
        limits = (
            hold_out_note(roles.hold_out),
            no_prediction_note(prediction),
            alone_note(validation),
            saturation_note(saturated),
            drift_note(drift),
        )
        handed_on = fitted_to_all(adoption, validation, diagnose.force)
        final = handed_on.fitted.damper.moved(zero) if selection.adopted else identified
        beside = "" if law else knee_note(identify.law, decision.verdict, baseline.base)
        beside += _seal_note(final, law)
        if decision.verdict == "unexplained" and identify.nodes is None:
            beside += nodes_note(cleaned, baseline.base, control.name)
        if "end_stop" in selection.adopted:
            beside += one_stop_note(final, [each.record.displacement for each in recorded])
        if "temperature_drift" not in selection.adopted:
            beside += temperature_note(baseline.base, selection.initial_evidence.whole.scales.speed)
        diagnosis = Diagnosis(
            verdict=decision.verdict,
            reason=control.told(
                "".join((decision.reason, beside, judged.zeros, campaign.budget.note, *limits, _hum(before)))
            ),
            effects=selection.adopted,
            confidence=decision.confidence,
            gap=held_out_gap(
                selection, validation if adoption.by_criterion else None, plain_selection.initial_evidence
            ),
            parameters=parameters_of(handed_on, control),
            prediction=prediction,
            zero_m=final.zero_m,
            support=support,
            left_of_peak=visible_gap(campaign.checks(selection.fitted.damper)),
            ranking=ranking_of(handed_on, selection.initial_evidence),
            rivals=(*selection.rivals, *decision.possible),
            where=() if decision.verdict == "none" else regions(before, control.unit, zero),
            next_test=_next_test(adoption, decision, final, zero, validation, recorded, envelope),
        )
        fitted = base_parameters(handed_on, decision.verdict, setting) if selection.adopted else rows
        log.info("diagnose: looks for the shape of what is left")
        shapes = hypotheses(validation, final.moved(-zero), control, decision.verdict)
        # The gas of the law counts from the same zero in both, where it has a force besides its stiffness.
        plain = identified.about(zero) if selection.adopted else identified
        return Diagnosed(diagnosis, final, plain, fitted, shapes)

    return _Searched(judged.conclusion[1].verdict, hand_on)


def _predicts_far_better(one: Diagnosed, criterion: float | None) -> bool:
    """Whether a damper beside T0, C and k predicts whole tests kept back far better than another law with this W_s."""
    found = one.diagnosis.prediction
    if criterion is None or found is None or found.hold_out != "tests":
        return False
    return found.W_s <= thresholds.BETTER_THAN_KNEE * criterion


def _selected(campaign: Campaign, baseline: Damper, config: DiagnoseConfig) -> Selection:
    """Select effects; with T0, C and k at each temperature where a law of the temperature turns out wrong.

    The drift knows T0 and C alone. Where k follows the temperature too the gains of the tests do it in its place, or
    something is left; what was measured at each temperature needs no law.
    """
    found = select_effects(campaign, baseline, config, campaign.jobs)
    drifts = tuple(name for name in found.adopted if library()[name].place == "material" and name not in config.force)
    if not drifts or len(baseline.base) == len(rows_per_voltage(baseline.base)):
        return found
    left, trend = found.final_evidence.gap(found.fitted), nuisance_trend(campaign, found.fitted.damper, config)
    if trend is None and left < config.visible:
        return found
    forbidding = config.model_copy(update={"forbid": (*config.forbid, *drifts)})
    by_rows = select_effects(campaign, baseline, forbidding, campaign.jobs, rows_by_temperature=True)
    most = max(left, config.visible) if trend else thresholds.ROWS_INSTEAD * left
    less = by_rows.final_evidence.gap(by_rows.fitted) <= most
    return by_rows if less and nuisance_trend(campaign, by_rows.fitted.damper, config) is None else found


@dataclass(frozen=True, eq=False)
class _Judged:
    """A campaign, and what is judged of it."""

    campaign: Campaign
    baseline: Damper
    """The damper without effects."""
    config: DiagnoseConfig
    unit: str
    """Of the control signal, for the reason."""
    validation: CrossValidation
    conclusion: Conclusion
    zeros: str = ""
    """What the reason says of the zeros of the load cell."""
    without_seal: Selection | None = None
    """What was selected beside T0, C and k alone, where this is beside a seal: it has the simple model."""


def _judged(campaign: Campaign, baseline: Damper, config: DiagnoseConfig, unit: str) -> _Judged:
    """Select effects, and judge them."""
    selected = _selected(campaign, baseline, config)
    validation = cross_validation_of(campaign, baseline, config.visible)
    return _Judged(campaign, baseline, config, unit, validation, judge(selected, validation, config, unit))


def _with_zeros_of_tests(first: _Judged) -> _Judged:
    """Judge again where an offset of each test, larger than most stands have, takes much of what has no name.

    A load cell is zeroed by hand, warms, or is made for ten times the force. No law gives a force that is constant in
    every test and another one in each, so that such a gap names nothing of the damper. The first judgement stands where
    nothing is explained by it.
    """
    campaign, config, (adoption, decision) = first.campaign, first.config, first.conclusion
    if decision.verdict != "unexplained" or not config.nuisance.offset:
        return first
    damper, allowed = adoption.selection.fitted.damper, max(thresholds.LARGEST_ZERO, config.nuisance.offset)
    checks = campaign.with_offset(allowed).checks(damper)
    if visible_gap(checks) > thresholds.ZEROS_LEAVE * visible_gap(campaign.checks(damper)):
        return first
    zeros = np.array([float(np.mean(check.nuisances[check.wanted])) for check in checks])
    spread = rms(zeros / np.array([check.peak for check in checks]))
    wider = campaign.with_offset(float(np.clip(spread, config.nuisance.offset, allowed)))
    again = _judged(wider, first.baseline, config, first.unit)
    if again.conclusion[1].verdict == "unexplained":
        return first
    told = f"; the zero of the load cell differs from test to test, by {np.ptp(zeros):.2g} N in all"
    return replace(again, zeros=told)


def _with_seal(first: _Judged) -> _Judged:
    """Judge again beside the friction of a seal on the rod, where effects leave a little that has no name.

    T0 lies behind the oil spring and turns round with the flow; a seal turns round with the rod. That is no effect that
    anybody asks for, and beside one that is missing it would leave the whole without a name. The first judgement stands
    where the effects have none with it either, or kept-back tests are predicted worse.
    """
    config, (adoption, decision) = first.config, first.conclusion
    selection, checks = adoption.selection, first.campaign.checks
    left = visible_gap(checks(selection.fitted.damper))
    if decision.verdict != "unexplained" or config.force or first.campaign.law or left > thresholds.SEAL_LEAVES:
        return first
    # The seal takes the place of what looked like another effect, and brings none.
    sure = {*selection.adopted} - {*decision.alike}
    if not sure:
        return first
    campaign = replace(first.campaign, law=(seal.EFFECT.name,))
    scales = selection.initial_evidence.whole.scales
    start = {p.name: p.search.starts[0] * p.search.scale(scales) for p in seal.EFFECT.parameters}

    def rubbed(damper: Damper) -> Damper:
        rows = [row.model_copy(update={"T0_N": max(row.T0_N - start["F_s"], 0.0)}) for row in damper.base]
        return damper.model_copy(update={"base": tuple(rows)}).with_effect(seal.EFFECT.name, start)

    # Where all of them leave too much beside a seal, so does any part of them: nothing need be searched for.
    together = rubbed(selection.fitted.damper.without_effects(*decision.alike))
    beside = campaign.checks(refit(evidence_of(campaign, together).whole, together).damper)
    sizes = visible_gap(checks(selection.baseline.damper)), visible_gap(beside)
    if leaves_too_much(sizes, probability_of_noise(beside), config):
        return first
    again = _judged(campaign, rubbed(first.baseline), config, first.unit)
    found, named = again.conclusion
    if named.verdict not in ("named", "ambiguous") or not {*found.selection.adopted} <= sure:
        return first
    plain = adoption.baseline_error
    if predicts_worse(found.error, adoption.error) or not improves(found.error, plain, again.validation):
        return first
    return replace(again, conclusion=(replace(found, baseline_error=plain), named), without_seal=selection)


def _seal_note(damper: Damper, law: Sequence[str]) -> str:
    """Return the end of a reason that tells of a seal which the law that identify found does not have."""
    if law or seal.EFFECT.name not in damper.effects:
        return ""
    rubs = damper.effects[seal.EFFECT.name]["F_s"]
    return f"; beside the friction of a seal of {rubs:.3g} N, which turns round with the rod and is no part of T0"


ALONE = "nothing is left with it, and nothing else explains the tests"


def _with_one_alone(first: _Judged) -> _Judged:
    """Judge again with an effect that is named where alone it leaves nothing, if what is missing has no other name.

    Such a law may take part of much that is missing, but the whole of little. Another one of them that leaves nothing
    as well is its rival.
    """
    config, (adoption, decision) = first.config, first.conclusion
    if decision.verdict != "unexplained" or config.force:
        return first
    evidence, plain = adoption.selection.initial_evidence, adoption.selection.baseline
    whole = evidence.whole
    wanted = [e for e in library().values() if e.named_alone and e.name not in config.forbid and has_name(whole, e)]
    tried = [converged(whole, plain, candidate(whole, plain, effect)) for effect in wanted]
    closing = [each for each in tried if not evidence.gap_is_significant(each.fitted, config)]
    for each in sorted(closing, key=lambda c: c.delta_bic):
        again = _judged_with(first, (each.effect,))
        if again is None:
            continue
        alike = [c.effect for c in closing if c is not each and c.delta_bic - each.delta_bic < config.rival_bic]
        adoption, decision = again
        if alike:
            words = f"{decision.reason}; {' and '.join(alike)} would do as well on these tests"
            possible = (*decision.possible, *alike)
            decision = replace(decision, verdict="ambiguous", reason=words, possible=possible)
        return replace(first, conclusion=(adoption, decision))
    return first


def _concluded(first: _Judged) -> Conclusion:
    """Conclude; and where what was added for its prediction leaves nothing, judge it by itself.

    It came in as what predicts, beside whatever stood there first; without that it may be all that is missing.
    """
    config = first.config
    adoption, decision = concluded = conclude(first.conclusion, first.validation, config)
    selection, named = adoption.selection, nameable()
    names = selection.adopted
    if (
        decision.verdict == "unexplained"
        and 0 < len(names) <= thresholds.MOST_ALONE
        and not config.force
        and all(name in named or library()[name].named_alone for name in names)
        and not selection.initial_evidence.gap_is_significant(selection.fitted, config)
    ):
        again = _judged_with(first, names)
        if again is not None:
            return conclude(again, first.validation, config)
    return concluded


def _judged_with(first: _Judged, names: tuple[str, ...]) -> Conclusion | None:
    """Judge some effects by themselves: they leave nothing, the tests determine them, and they predict those kept back.

    Parameters
    ----------
    first : judgement without them
    names : of the effects

    Returns
    -------
    what is adopted, and the verdict on it; None where these do not explain the tests
    """
    only = first.config.model_copy(update={"force": names, "most_effects": len(names)})
    selected = select_effects(first.campaign, first.baseline, only, first.campaign.jobs, forced_because=ALONE)
    adoption, decision = judge(selected, first.validation, only, first.unit)
    kept = adoption.selection
    before, after = adoption.baseline_error.criterion, adoption.error.criterion
    if decision.verdict == "unexplained" or {*kept.adopted} != {*names} or before is None or after is None:
        return None
    if any(library()[name].named_alone for name in names) and after > thresholds.ALONE_LEAVES * before:
        return None
    determined = first_undetermined(kept.final_evidence.whole, kept.fitted, ()) is None
    predicts = improves(adoption.error, adoption.baseline_error, first.validation)
    return (adoption, decision) if determined and predicts else None


def fitted_to_all(adoption: Adoption, validation: CrossValidation, forced: Sequence[str]) -> Selection:
    """Fit the adopted damper to every test, those too on which it was judged: what is handed on predicts the next one.

    The plain damper is that of every test, and so is one that was fitted by criterion (4). Where an effect is not
    determined by all of them, as in tests that contradict each other, the fit that was judged stays.

    Parameters
    ----------
    adoption : the damper, fitted to what was not held out
    validation : of every test
    forced : effects that the config asks for, whatever they do
    """
    selection = adoption.selection
    if not selection.adopted or adoption.by_criterion:
        return selection
    damper = selection.fitted.damper
    whole = evidence_of(validation.campaign, damper).whole
    fitted = polished(whole, refit(whole, damper))
    if first_undetermined(whole, fitted, forced):
        return selection
    return replace(selection, fitted=fitted, final_evidence=replace(selection.final_evidence, whole=whole))


def _hum(checks: Sequence[ResidualCheck]) -> str:
    """Say in how many tests mains hum was found, which counts as no gap."""
    loud = [check.hum for check in checks if check.hum > 0.0]
    return f"; mains hum of up to {max(loud):.2g} N in {counted(len(loud), 'test')} is taken for no gap" if loud else ""


def _next_test(
    adoption: Adoption,
    decision: Decision,
    final: Damper,
    zero: float,
    validation: CrossValidation,
    recorded: Sequence[CleanedRecord],
    envelope: OperatingEnvelope,
) -> NextTest | None:
    """Propose the test that separates rivals, or without rivals one at a voltage where the prediction is worst.

    What may be chance of few tests, or is not excluded by them, is settled by one more.
    """
    selection = adoption.selection
    campaign, temperature = selection.initial_evidence.campaign, selection.initial_evidence.whole.reference_temperature
    if selection.rival_dampers:
        rivals = [(name, damper.moved(zero)) for name, damper in selection.rival_dampers]
        offsets = [campaign.offset(damper) for _, damper in selection.rival_dampers]
        return next_test.separating_test(rivals, envelope, temperature, offsets)
    if decision.doubtful:
        # A hysteresis or a lag of the drive that is not excluded shows where the control signal moves alone.
        told = [library()[name] for name in (*selection.adopted, *decision.possible) if name in library()]
        of_drive = [effect.name for effect in told if effect.place == "drive"]
        moving = of_drive if {*of_drive} & {*decision.possible} else ()
        return next_test.repeated_longest_test(recorded, envelope, moving)
    offset = campaign.offset(final.moved(-zero))
    errors = adoption.error, adoption.interpolation_error
    return next_test.intermediate_voltage_test(final, offset, errors, validation, recorded, envelope, temperature)
