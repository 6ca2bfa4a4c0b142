"""The diagnose stage: where simulation and measurement disagree, and what is missing."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import TYPE_CHECKING

from pzd.artefacts import Diagnosed, Diagnosis, Identified, NextTest, Prediction, Rig, base_of
from pzd.diagnose.as_fitted import as_fitted
from pzd.diagnose.config import DiagnoseConfig
from pzd.diagnose.work import Work
from pzd.identify.config import IdentifyConfig
from pzd.quantities import Control
from pzd.record import mid_stroke
from pzd.rig.config import RigConfig
from pzd.schema.wording import counted

if TYPE_CHECKING:
    from pzd.damper.model import Damper
    from pzd.diagnose.campaign import Campaign
    from pzd.diagnose.data.cleaning import Prepared
    from pzd.diagnose.handed_on import HandedOn
    from pzd.diagnose.kept_back import Trials
    from pzd.diagnose.next_test import Reach
    from pzd.diagnose.residual_check import ResidualCheck
    from pzd.diagnose.verdict import Decision

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
    from pzd.diagnose.base_parameters import base_parameters
    from pzd.diagnose.campaign import Campaign
    from pzd.diagnose.conclusion import concluded
    from pzd.diagnose.data.cleaning import about, prepare
    from pzd.diagnose.data.exclusions import whole_records
    from pzd.diagnose.data.split import split
    from pzd.diagnose.held_out import held_out_gap
    from pzd.diagnose.hypotheses.rows import hypotheses
    from pzd.diagnose.kept_back import trials_of
    from pzd.diagnose.next_test import reach_of
    from pzd.diagnose.search.forward_selection import select_effects
    from pzd.diagnose.too_short import too_short, undecided
    from pzd.diagnose.verdict import parameters_of, ranking_of
    from pzd.diagnose.where import regions

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
    from pzd.diagnose.data.exclusions import without
    from pzd.diagnose.verdict import unpredicted, weak

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
    from pzd.diagnose.next_test import next_test, one_more
    from pzd.diagnose.voltage_between import PredictingDamper, next_voltage

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
