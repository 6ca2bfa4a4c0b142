"""The diagnose stage: where simulation and measurement disagree, and what is missing."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pzd.artefacts import (
    Diagnosed,
    Diagnosis,
    Gap,
    Identified,
    KneeRow,
    NextTest,
    ParameterRow,
    Prediction,
    Rig,
    base_of,
    identified_damper,
)
from pzd.artefacts.csv_rows import Estimate
from pzd.diagnosis.campaign import Campaign, gap_of
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.cross_validation import Trials
from pzd.diagnosis.data import TRAINING, Prepared
from pzd.diagnosis.fit.least_squares import base_half_widths, fit
from pzd.diagnosis.fit.likelihood import FEWEST_SAMPLES, enough
from pzd.diagnosis.fit.parameters import Work
from pzd.diagnosis.next_test import MANY_CYCLES, Reach, one_more
from pzd.diagnosis.search.acceptance import Selection
from pzd.diagnosis.verdict import Verdict
from pzd.identification.bingham_fit import Bingham
from pzd.identification.condition import parameter_row
from pzd.identification.config import IdentifyConfig
from pzd.identification.trust import PARAMETER_NAMES, ParameterEvidence, parameter_scales
from pzd.quantities import Control
from pzd.record import Mask, mid_stroke
from pzd.rig.config import RigConfig
from pzd.schema.errors import counted

# ----------------------------------------------------------------------------------------------------
# What is said where the records are too short to tell a gap from noise, and what to record instead.


def too_short(campaign: Campaign) -> bool:
    """Whether nothing of what naming may see, or of what it is to be fitted to, can be weighed."""
    return not all(_any_enough(campaign.prepared, masks) for masks in (campaign.seen, campaign.in_role(TRAINING)))


def _any_enough(prepared: Sequence[Prepared], masks: Sequence[Mask]) -> bool:
    return any(enough(p, mask) for p, mask in zip(prepared, masks, strict=True))


def undecided(recorded: Sequence[Prepared], reach: Reach) -> Diagnosis:
    """The diagnosis of records that are too short: nothing is known, and a longer test is asked for.

    Parameters
    ----------
    recorded : the records of the setting, their displacement as recorded
    reach : what a test may reach
    """
    longest = max(p.record.time.size for p in recorded)
    return Diagnosis.without_effects(
        verdict="ambiguous",
        reason=(
            "the records are too short to tell noise from what is missing: too little of them repeats a cycle, and "
            f"a motion that does not repeat takes {FEWEST_SAMPLES} samples to fit, the same to choose and to hold out "
            f"(the longest record has {longest}); record {MANY_CYCLES} cycles of a test, of at least 40 samples each"
        ),
        gap=None,
        next_test=one_more(recorded, reach),
    )


# ----------------------------------------------------------------------------------------------------
# The knee law is handed on as identify fitted it: what is said of the damper where no effect is looked for.


def as_fitted(identified: Identified, setting: str | None, config: DiagnoseConfig) -> Diagnosed:
    """The damper with the knee law, unchanged: `none` where it misses nothing visible, else `unexplained`.

    Effects are weighed beside one T0 and C; under another law of the element their evidence would mean something else.

    Parameters
    ----------
    identified : with the knee law of the setting
    setting : of the rig's settings, the one in use
    config : what is visible
    """
    rows, damper = identified.knees.of(setting), identified_damper(identified, setting)
    missed = max(row.missed_share for row in rows)
    left = f"it misses up to {missed:.1%} of peak beyond noise" if missed else "it misses nothing beyond noise"
    law = next(row for row in identified.knees.laws if row.setting == setting)
    diagnosis = Diagnosis.without_effects(
        "unexplained" if missed >= config.visible else "none",
        f"the knee law of 2-identify/knee.csv is handed on as it was fitted, and {left}; {law.reason}; no effect was "
        "looked for: identify.law: bingham looks for them, beside one T0 and C",
        gap=None,
    )
    return Diagnosed(diagnosis.model_copy(update={"zero_m": damper.zero_m}), damper, damper, tuple(map(_row, rows)))


def _row(row: KneeRow) -> ParameterRow:
    """T0, C (mean bleed of both directions) and k of one condition."""
    return ParameterRow(
        setting=row.setting,
        voltage_V=row.voltage_V,
        temperature_degC=row.temperature_degC,
        **Estimate.of(row, "friction_N").columns("T0_N"),
        **Estimate(0.5 * (row.rebound_bleed_Ns_per_m + row.compression_bleed_Ns_per_m)).columns("C_Ns_per_m"),
        **Estimate.of(row, "k_N_per_m").columns("k_N_per_m"),
        W_s=row.W_s,
        rmse_N=row.rmse_N,
        status="ok" if row.status == "ok" else "weak: T0, C, k (2-identify/knee.csv says why)",
    )


# ----------------------------------------------------------------------------------------------------
# T0, C and k of the damper with what was adopted, with their 95 % intervals: one row a base row.


DOUBTS: dict[Verdict, str] = {
    "unexplained": "something is still missed: the parameters are the model's, not the damper's",
    "ambiguous": "a rival effect would leave other values",
}
"""Why no row is `ok` under a verdict."""
SHOWN = 1.0
"""Share of the force that a parameter moves, for its status: what the tests do not show has a wide interval here."""


def base_parameters(selection: Selection, verdict: Verdict, setting: str | None) -> tuple[ParameterRow, ...]:
    """T0, C and k beside the effects adopted, judged by their intervals as those of identify are.

    An interval allows for noise, for the sensors' priors, and for how far the tests disagree; it
    holds the damper's own parameters where the effects adopted are all that there is.

    Parameters
    ----------
    selection : what was adopted
    verdict : what was decided
    setting : of the rig's settings, the one in use
    """
    fitted, whole = selection.fitted, selection.last.whole
    compared = [(o.place, o.measured, f) for o, f in zip(whole.observations, fitted.simulated, strict=True)]
    rows = []
    for place, (row, widths) in enumerate(
        zip(fitted.damper.base, base_half_widths(fitted, whole.scales.force), strict=True)
    ):
        mine = [(m, f) for at, m, f in compared if at == place] or [(m, f) for _, m, f in compared]
        measured = np.concatenate([m for m, _ in mine])
        residuals = measured - np.concatenate([f for _, f in mine])
        parameters = Bingham(row.T0_N, row.C_Ns_per_m, row.k_N_per_m)
        evidence = [
            ParameterEvidence(name, scale, width, width, SHOWN, doubt=DOUBTS.get(verdict))
            for name, scale, width in zip(
                PARAMETER_NAMES, parameter_scales(parameters, measured).tolist(), widths.tolist(), strict=True
            )
        ]
        labels = (setting, row.voltage_V, row.temperature_degC)
        rows.append(parameter_row(labels, parameters, widths, evidence, (measured, residuals)))
    return tuple(rows)


# ----------------------------------------------------------------------------------------------------
# The gap on what no fit has seen, before and after: both dampers fitted to the training samples alone.


def held_out_gap(selection: Selection, trials: Trials | None = None) -> Gap:
    """Criterion (4) on the untouched samples, nuisances at their prior mean, before and after alike.

    Parameters
    ----------
    selection : what was adopted, and the evidence whose first half trains
    trials : the tests, where the damper handed on is fitted by criterion (4); None where it is by likelihood
    """
    campaign, training = selection.first.campaign, selection.first.halves[0]
    plain = fit(training, (), training.start()).damper
    before = gap_of(campaign.untouched(plain), campaign.parts)
    if not selection.adopted:
        return before
    seen_later = [~mask for mask in campaign.in_role(TRAINING)]
    found = None if trials is None else trials.fitted_by_criterion(selection.fitted.damper, seen_later)
    training = selection.last.halves[0]
    adopted = found[1] if found else fit(training, selection.adopted, training.start_with(selection.fitted.damper))
    after = gap_of(campaign.untouched(adopted.damper), campaign.parts)
    return after.model_copy(update={"before": before.before})


# ----------------------------------------------------------------------------------------------------


if TYPE_CHECKING:
    from pzd.damper.model import Damper
    from pzd.diagnosis.adoption import HandedOn
    from pzd.diagnosis.campaign import Campaign, ResidualCheck
    from pzd.diagnosis.cross_validation import Trials
    from pzd.diagnosis.data import Prepared
    from pzd.diagnosis.next_test import Reach
    from pzd.diagnosis.verdict import Decision

log = logging.getLogger(__name__)


def diagnose(
    diagnose: DiagnoseConfig,
    identify: IdentifyConfig,
    stand: RigConfig,
    rig: Rig,
    identified: Identified,
    control: Control,
    setting: str | None,
    jobs: int,
) -> Diagnosed:
    """What the identified damper misses, named where the data allow it, and the damper with it added.

    Parameters
    ----------
    diagnose : the config's block
    identify : that of identify, for what counts as one condition
    stand : that of the rig, for what the stand can do
    rig : the records
    identified : the Bingham parameters
    control : the control signal, for the words
    setting : of the rig's settings, the one in use
    jobs : candidates fitted at the same time

    Returns
    -------
    the verdict, and the damper with what was adopted; unchanged where nothing was, and under the knee law
    """
    from pzd.diagnosis.campaign import Campaign
    from pzd.diagnosis.cross_validation import trials_of
    from pzd.diagnosis.data import about, prepare, split, whole_records
    from pzd.diagnosis.hypotheses.summary import hypotheses
    from pzd.diagnosis.next_test import reach_of
    from pzd.diagnosis.search.forward_selection import select_effects
    from pzd.diagnosis.verdict import concluded, parameters_of, ranking_of
    from pzd.diagnosis.where import regions

    if identified.knees.law_of(setting) == "knee":
        return as_fitted(identified, setting, diagnose)
    records, cut_off = whole_records(rig, setting)
    recorded = prepare(records)
    prepared = about(recorded, zero := mid_stroke(each.record.displacement for each in recorded))
    parts = split(prepared, identify.group.voltage_V, identify.group.temperature_degC)
    plain = base_of(identified.rows, setting)
    campaign = Campaign(prepared, parts, diagnose.nuisance, jobs, Work(diagnose.most_evaluations))
    rows = tuple(row for row in identified.rows if row.setting == setting)
    reach = reach_of(stand.limits, recorded, [row.voltage_V for row in plain.base if row.voltage_V is not None])
    if too_short(campaign):
        return Diagnosed(undecided(recorded, reach), plain, plain, rows)
    trials = trials_of(campaign, plain, diagnose.visible)
    handed, decision = concluded(select_effects(campaign, plain, diagnose, jobs), trials, diagnose, control.unit)
    selection, prediction = handed.selection, handed.prediction(trials)
    before = campaign.checks(selection.plain.damper)
    log.info("diagnose: %s, %s; %.2g forces computed", decision.verdict, decision.reason, campaign.work.spent)
    found = selection.fitted.damper.moved(zero) if selection.adopted else plain
    diagnosis = Diagnosis(
        verdict=decision.verdict,
        reason=decision.reason + _notes(campaign, prediction, cut_off) + _hum(before),
        effects=selection.adopted,
        confidence=decision.confidence,
        gap=held_out_gap(selection, trials if handed.by_criterion else None),
        parameters=parameters_of(selection, control),
        prediction=prediction,
        zero_m=found.zero_m,
        ranking=ranking_of(selection, selection.first),
        rivals=(*selection.rivals, *decision.possible),
        where=() if decision.verdict == "none" else regions(before, control.unit, zero),
        next_test=_next_test(handed, decision, found, zero, trials, recorded, reach),
    )
    if selection.adopted:
        rows = base_parameters(selection, decision.verdict, setting)
    return Diagnosed(diagnosis, found, plain, rows, hypotheses(trials, found.moved(-zero), control, decision.verdict))


def _notes(campaign: Campaign, prediction: Prediction | None, cut_off: Sequence[str]) -> str:
    """What limits a verdict: a search that was ended, and tests that were few or left out."""
    from pzd.diagnosis.data import without
    from pzd.diagnosis.verdict import unpredicted, weak

    return campaign.work.words + weak(campaign.parts.hold_out) + unpredicted(prediction) + without(cut_off)


def _hum(checks: Sequence[ResidualCheck]) -> str:
    """In how many tests the mains hum, which is taken for no gap."""
    loud = [check.hum for check in checks if check.hum > 0.0]
    return f"; mains hum of up to {max(loud):.2g} N in {counted(len(loud), 'test')} is taken for no gap" if loud else ""


def _next_test(
    handed: HandedOn,
    decision: Decision,
    found: Damper,
    zero: float,
    trials: Trials,
    recorded: Sequence[Prepared],
    reach: Reach,
) -> NextTest | None:
    """The test that tells rivals apart; without rivals one at a voltage at which the force is known least.

    What may be chance of few tests, or is not excluded by them, is settled by one more.
    """
    from pzd.diagnosis.next_test import PredictingDamper, next_test, next_voltage, one_more

    selection = handed.selection
    warmth, campaign = selection.first.whole.reference, selection.first.campaign
    if selection.rivalling:
        rivals = [(name, damper.moved(zero)) for name, damper in selection.rivalling]
        return next_test(rivals, reach, warmth, [campaign.offset(damper) for _, damper in selection.rivalling])
    if decision.doubtful:
        return one_more(recorded, reach)
    offset = campaign.offset(found.moved(-zero) if selection.adopted else found)
    predicting = PredictingDamper(found, offset, handed.missed, handed.between)
    return next_voltage(predicting, trials, recorded, reach, warmth)
