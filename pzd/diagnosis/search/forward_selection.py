"""Forward selection: effects are adopted one after another, as long as the data support the next by themselves."""

from __future__ import annotations

import itertools
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from pzd.damper.effects import library
from pzd.damper.fitted_laws import fitted_laws, knee
from pzd.damper.model import Damper
from pzd.diagnosis import thresholds
from pzd.diagnosis.campaign import Campaign, Evidence, evidence_of, nearest_row
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.fit.least_squares import FitResult, fit, plain_fit, refit, standard_errors
from pzd.diagnosis.fit.prediction import predicted_force
from pzd.diagnosis.fit.problem import Problem
from pzd.diagnosis.gap import visible_gap
from pzd.diagnosis.search import acceptance
from pzd.diagnosis.search.acceptance import ConfounderMatch, Detection, Selection, SelectionStep
from pzd.diagnosis.search.candidates import (
    Candidate,
    as_candidate,
    best_confounder,
    candidate,
    candidates,
    converged,
    delta_bic,
    force_change,
    nearly_as_good,
    per_voltage_candidates,
)
from pzd.diagnosis.search.determination import contradiction
from pzd.identification.knee import fitted_knee_damper
from pzd.record import Record


def reweighted(
    weigh: Callable[[Damper], Evidence], evidence: Evidence, current: FitResult
) -> tuple[Evidence, FitResult]:
    """Iterate fit and weights until the parameters no longer depend on the damper that the weights came from.

    The delay of a test acts along the slope of the force that the damper gives, and shifts its corners.

    Parameters
    ----------
    weigh : gives the evidence weighed by what a damper leaves
    evidence : of the present optimum
    current : optimum with the adopted effects
    """
    for _ in range(thresholds.MOST_REWEIGHTINGS if current.effects else 0):
        before, evidence = current, weigh(current.damper)
        current = refit(evidence.whole, before.damper, thresholds.MOST_EVALUATIONS_OF_BEST)
        moved = [abs(u.value_in(current.damper) - u.value_in(before.damper)) for u in before.unknowns]
        if np.all(moved <= thresholds.CONVERGED_CHANGE * standard_errors(current)):
            break
    return evidence, current


# --- Swap step (exchange): other effects in the place of one adopted early


def swap_step(
    problem: Problem,
    without: FitResult,
    name: str,
    current: FitResult,
    refused: Callable[[Candidate], str | None],
    config: DiagnoseConfig,
    jobs: int,
) -> tuple[SelectionStep, Candidate]:
    """Repeat the step in which an effect was adopted, with all effects adopted since; return what it adopts now.

    What came first was chosen beside less than is adopted now, and may have stood in for what came later. It stays
    unless something that the data support is better by more than rivals differ, its own values are impossible, or
    beside what came later it has come to its limit, where a simpler law is the same.

    Parameters
    ----------
    problem : observations and starting values
    without : optimum with all adopted effects but this one
    name : of the effect
    current : optimum with it
    refused : gives why the data do not support a candidate beside `without`, None where they do
    config : how near a rival comes
    jobs : candidates fitted at the same time
    """
    own = as_candidate(problem, without, name, current)
    tried = [c for c in candidates(problem, without, config.forbid, jobs) if c.effect != name]
    ended = sorted((own, *nearly_as_good(problem, without, own, tried)), key=lambda c: c.delta_bic)
    close = [
        c
        for c in ended
        if c is not own and (c.delta_bic - own.delta_bic < config.rival_bic or acceptance.has_come_down_to(own, c))
    ]
    spurious_effects = frozenset(c.effect for c in close if refused(c))
    alike = [c for c in close if c.effect not in spurious_effects]
    kept = next((c for c in alike if _replaces(c, own, config.rival_bic)), own)
    rivals = acceptance.rivals_of(kept, (*alike, own), config)
    return SelectionStep(tuple(ended), kept.effect, rivals, spurious_effects), kept


def _replaces(other: Candidate, own: Candidate, rival_bic: float) -> bool:
    """Whether a candidate replaces the adopted effect."""
    if other.fitted.unphysical:
        return False
    if other.delta_bic <= own.delta_bic and acceptance.says_the_same(own, other):
        return True
    if acceptance.has_come_down_to(own, other):
        return True
    return other.delta_bic < own.delta_bic - rival_bic or bool(own.fitted.unphysical)


# --- Forward selection


log = logging.getLogger(__name__)


def select_effects(
    campaign: Campaign,
    damper: Damper,
    config: DiagnoseConfig,
    jobs: int = 1,
    *,
    rows_by_temperature: bool = False,
    forced_because: str = "the config asks for it",
) -> Selection:
    """Adopt effects one after another while the next improves the fit, is supported by itself, and a gap is left.

    Parameters
    ----------
    campaign : the records of one setting
    damper : baseline, at which the fits start
    config : thresholds, forced and forbidden effects
    jobs : candidates fitted at the same time
    rows_by_temperature : whether T0, C and k stay those of each temperature, whatever rows of a voltage would pay
    forced_because : why the forced effects are adopted
    """
    weigh = partial(evidence_of, campaign)
    evidence = weigh(damper)
    search = _ForwardSelection(config, weigh, jobs, damper, evidence, plain_fit(evidence.whole))
    search.settle_weights()
    search.choose_oil_spring()
    if not rows_by_temperature:
        search.choose_temperature_axis()
    initial_evidence, search.baseline = search.evidence, search.current
    search.adopt_forced(forced_because)
    while len(search.steps) < 2 * config.most_effects and campaign.budget.allows_more() and search.step():
        pass
    search.swap()
    search.reweight_until_stable()
    undecided = search.undecided()  # gives reasons as well
    return Selection(
        search.baseline,
        search.current,
        tuple(search.steps),
        search.reasons,
        initial_evidence,
        search.evidence,
        search.competing_confounders(),
        undecided,
        search.open_detections,
    )


@dataclass(eq=False)
class _ForwardSelection:
    """State of the forward selection: current fit, steps so far, and why each effect was adopted or not."""

    config: DiagnoseConfig
    weigh: Callable[[Damper], Evidence]
    jobs: int
    identified: Damper
    """Baseline with the base rows of identify, or of the fit that the weights are from."""
    evidence: Evidence
    """Weighed by what the current damper leaves."""
    current: FitResult
    baseline: FitResult = field(init=False)
    """Without effects."""
    steps: list[SelectionStep] = field(default_factory=list)
    reasons: dict[str, str] = field(default_factory=dict)
    open_detections: dict[str, tuple[Detection, ...]] = field(default_factory=dict)

    def settle_weights(self) -> None:
        """Weigh by what the baseline leaves where the identified damper leaves visibly more.

        T0 or C may be empty there, as where a force is late: weights by what is left without it believe no test.
        """
        for _ in range(thresholds.MOST_REWEIGHTINGS):
            weighed_by = visible_gap(self.evidence.campaign.checks(self.identified))
            left = max(self.evidence.gap(self.current), self.config.negligible)
            if weighed_by <= thresholds.LARGEST_GAP_GROWTH * left:
                break
            self.identified = self.current.damper
            self.evidence = self.weigh(self.identified)
            self.current = plain_fit(self.evidence.whole)

    def choose_oil_spring(self) -> None:
        """Take a gap for one only where neither softer nor rigid oil springs close it.

        A search that begins rigid may end there, for beside a delay of the test a flank within a few samples is one
        more jump: softer springs are tried too. And where friction turns within a sample or two its flank is left to
        chance, and any stiff spring fits as well: the gap is asked of the flank.
        """
        if not self.evidence.gap_is_significant(self.current, self.config):
            return
        whole, elastic = self.evidence.whole, slice(2, 3 * len(self.evidence.whole.base), 3)
        for compliance in thresholds.COMPLIANCES_TRIED:
            begin = self.current.optimum.copy()
            begin[elastic] = np.maximum(begin[elastic], compliance)
            softer = fit(whole, (), begin)
            if softer.misfit < self.current.misfit - thresholds.STUCK_MISFIT:
                self.current = softer
        rigid = fit(replace(whole, rigid=True), (), self.current.optimum)
        if rigid.misfit - self.current.misfit >= self.config.rival_bic:
            return
        if self.evidence.gap(rigid) < self.evidence.gap(self.current):
            self.current = rigid

    def adopt_forced(self, because: str) -> None:
        """Adopt what is asked for."""
        for name in self.config.force:
            whole, before = self.evidence.whole, self.current
            self.current = converged(whole, before, candidate(whole, before, library()[name])).fitted
            self.reasons[name] = f"adopted because {because}"

    def choose_temperature_axis(self) -> None:
        """Keep rows by temperature where they improve the criterion more than an effect; else one per voltage.

        Rows by temperature follow each test's own gain, and bend between the tests what is missing.
        """
        if len(self.identified.base) == len(self.evidence.whole.voltages) or self._drifts():
            return
        damper = self.current.damper
        kept = {"effects": damper.effects, "zero_m": damper.zero_m}
        whole = self.weigh(self.identified.model_copy(update=kept)).whole
        pooled = whole.pooled_temperatures()
        rows, one = (refit(problem, damper) for problem in (whole, pooled))
        pays = delta_bic(one, rows)
        if pays <= self.config.adopt_bic and not one.effects:
            drifts = tuple(name for name, effect in library().items() if effect.place == "material")
            tried = candidates(pooled, one, (*self.config.forbid, *drifts), self.jobs)
            pays -= min((c.delta_bic for c in tried), default=0.0)
        self._reweight(rows if pays <= self.config.adopt_bic else one)

    def _drifts(self) -> bool:
        return any(library()[name].place == "material" for name in self.current.effects)

    def step(self) -> bool:
        """Adopt one more effect, an adopted one per voltage, or a supported pair; return whether any was."""
        log.info(
            "diagnose: looks for an effect beside %s", " and ".join(self.current.effects) or "the law of the element"
        )
        tried = self._candidates(self.evidence, self.current)
        if self._descends_from(tried):
            tried = self._candidates(self.evidence, self.current)
        varied = per_voltage_candidates(self.evidence.whole, self.current, self.jobs)
        steps = sorted((*tried, *varied), key=lambda c: c.delta_bic)
        first = self._best_supported(steps)
        closes = first is not None and acceptance.closes_gap(self.evidence, self.config, self.current, first)
        if not closes and (afresh := self._begun_afresh(tried)):
            tried = afresh
            steps = sorted((*tried, *varied), key=lambda c: c.delta_bic)
            first = self._best_supported(steps)
        if first is None:
            return self._pair(tried)
        ended = converged(self.evidence.whole, self.current, self._physically_possible(first, steps))
        self._adopt(ended, nearly_as_good(self.evidence.whole, self.current, ended, tried), _ranked_above(first, steps))
        return True

    def _begun_afresh(self, tried: Sequence[Candidate]) -> tuple[Candidate, ...]:
        """Fit the candidates that pay with each adopted effect begun from its own starting values beside them.

        An effect adopted alone stands in for what is missing beside it: a friction that falls over the whole range of
        speeds for a power law. From there the search for both ends in a valley of its own.

        Returns
        -------
        the candidates, the better ones in the place of those tried, best first; empty where none is better
        """
        whole, current = self.evidence.whole, self.current
        if not self.evidence.gap_is_significant(current, self.config):
            return ()
        found = dict(zip((c.effect for c in tried), tried, strict=True))
        for each in tried:
            if each.delta_bic > self.config.adopt_bic or library()[each.effect].place == "material":
                continue
            for name in current.effects[len(self.config.force) :]:
                if name in whole.per_voltage or library()[name].place == "material":
                    continue
                again = candidate(whole, refit(whole, each.fitted.damper.without_effects(name)), library()[name])
                if again.fitted.misfit < found[each.effect].fitted.misfit - thresholds.STUCK_MISFIT:
                    damper = again.fitted.damper
                    effects = {key: damper.effects[key] for key in (*whole.law, *current.effects, each.effect)}
                    better = refit(whole, damper.model_copy(update={"effects": effects}))
                    found[each.effect] = as_candidate(whole, current, each.effect, better)
        if all(found[c.effect] is c for c in tried):
            return ()
        return tuple(sorted(found.values(), key=lambda c: c.delta_bic))

    def _descends_from(self, tried: Sequence[Candidate]) -> bool:
        """Search on from T0, C and k of the best candidate, without its effect; return whether that is a better fit.

        Where a force jumps between samples the misfit has steps, and a fit may end on one. An effect that gets over it
        would be paid for what T0, C and k do by themselves.
        """
        alike = [c for c in tried if c.delta_bic < 0.0 and len(c.fitted.damper.base) == len(self.current.damper.base)]
        if not alike:
            return False
        best = min(alike, key=lambda c: c.fitted.misfit)
        begin = best.fitted.optimum[: self.current.optimum.size]
        found = fit(self.evidence.whole, self.current.effects, begin)
        if found.misfit > self.current.misfit - thresholds.STUCK_MISFIT:
            return False
        if self.baseline is self.current:
            self.baseline = found
        self.current = found
        return True

    def _physically_possible(self, first: Candidate, steps: Sequence[Candidate]) -> Candidate:
        """Return the best supported candidate with possible values of those as good as the first; else the first."""
        if not first.fitted.unphysical:
            return first
        alike = [c for c in steps if not c.varies and c.delta_bic - first.delta_bic < self.config.rival_bic]
        return self._best_supported([c for c in alike if not c.fitted.unphysical]) or first

    def _candidates(self, evidence: Evidence, current: FitResult) -> tuple[Candidate, ...]:
        if len(current.effects) == self.config.most_effects:
            return ()
        silent = not evidence.gap_is_significant(current, self.config)
        return candidates(evidence.whole, current, self.config.forbid, self.jobs, silent=silent)

    def _best_supported(self, tried: Sequence[Candidate]) -> Candidate | None:
        """Return the best candidate that the data support by itself; a better one that fails is spurious."""
        for each in tried:
            reason = self._refused(self.config, each)
            if reason is None:
                return each
            if not each.varies:
                self.reasons[each.effect] = reason
            if each.delta_bic > self.config.adopt_bic:
                break
        return None

    def _reason_against(self, evidence: Evidence, before: FitResult, each: Candidate) -> str | None:
        return acceptance.insufficient_support(evidence, self.config, each) or self._leaves_gap(evidence, before, each)

    def _leaves_gap(self, evidence: Evidence, before: FitResult, each: Candidate) -> str | None:
        """Say why a candidate is spurious by the gap that it leaves, weighed by the residual without it and with it.

        What is left without it is slow: with these weights the fit follows what is quick, where the displacement is
        known worst, and T0, C and k are bent.
        """
        reason = acceptance.leaves_gap(evidence, self.config, before, each)
        if reason is None or each.varies:
            return reason
        again = refit(self.weigh(each.fitted.damper).whole, each.fitted.damper)
        return acceptance.leaves_gap(evidence, self.config, before, replace(each, fitted=again))

    def _pair(self, tried: tuple[Candidate, ...]) -> bool:
        """Adopt two effects at once: alone either takes on values that the other distorts.

        Where all that are large enough leave the gap alone, or widen it, the best of these leads: an asymmetry that a
        zero of the load cell bends widens the gap of slow tests. Both together have to close it.
        """
        missing = self.evidence.gap_is_significant(self.current, self.config)
        leads = (c for c in tried if missing and self._reason_against(self.evidence, self.current, c) is None)
        large = (c for c in tried if missing and not acceptance.insufficient_support(self.evidence, self.config, c))
        lead = next(leads, None) or next(large, None)
        found = None if lead is None else self._with_second(lead)
        if lead is None or found is None:
            self.open_detections = acceptance.detections(self.evidence.whole, self.current, tried)
            # Once noise explains what is left, the round that adopted something tells more of the others.
            self.steps += [SelectionStep(tried, None)] if tried and (missing or not self.steps) else []
            return False
        self.steps.append(SelectionStep(tried, lead.effect, rejected=_ranked_above(lead, tried)))
        self.reasons[lead.effect] = "adopted"
        self._adopt(*found)
        return True

    def _with_second(self, lead: Candidate) -> tuple[Candidate, tuple[Candidate, ...], frozenset[str]] | None:
        """Return the effect that is supported together with another, what else was tried, and what was refused."""
        evidence = self.weigh(lead.fitted.damper)
        at = refit(evidence.whole, lead.fitted.damper)
        seconds = self._candidates(evidence, at)
        best = next((c for c in seconds if self._reason_against(evidence, at, c) is None), None)
        if best is None:
            return None
        both = converged(evidence.whole, at, best)
        if not acceptance.closes_gap(self.evidence, self.config, self.current, both):
            return None
        if acceptance.spurious(self.evidence, self.weigh(both.fitted.damper), self.config, self.current, both):
            return None
        return both, nearly_as_good(evidence.whole, at, both, seconds), _ranked_above(best, seconds)

    def _adopt(self, chosen: Candidate, tried: tuple[Candidate, ...], refused: frozenset[str]) -> None:
        self.reasons[chosen.effect] = "adopted, its parameters by voltage" if chosen.varies else "adopted"
        if not chosen.varies:
            finished = tuple(chosen if c.effect == chosen.effect else c for c in tried)
            force = self.evidence.whole.scales.force
            none = {c.effect for c in tried if contradiction(c.fitted.damper, c.effect, force)}
            step = SelectionStep(finished, chosen.effect, rejected=refused | none)
            self.steps.append(replace(step, rivals=acceptance.rivals_of(chosen, step.contenders, self.config)))
        log.info("diagnose: %s %s, delta BIC %.0f", chosen.effect, self.reasons[chosen.effect], chosen.delta_bic)
        self._reweight(chosen.fitted)
        self._begin_law_afresh()
        self.choose_temperature_axis()
        for name in self.current.effects[len(self.config.force) : -1]:
            self._drop_needless(name, chosen.effect)

    def _begin_law_afresh(self) -> None:
        """Fit the law of the element anew to what the adopted effects leave of the forces, where a gap remains.

        Alone it bends towards what is missing, as the knees towards a stop, and no descent leads back from there.
        """
        whole, current = self.evidence.whole, self.current
        if knee.EFFECT.name not in whole.law or not self.evidence.gap_is_significant(current, self.config):
            return
        law = law_beside(self.evidence.campaign, current.damper, current.effects)
        if law is None:
            return
        of_law = {name: law.effects[name] for name in law.effects if name in (*whole.law, *fitted_laws())}
        effects = {**current.damper.effects, **of_law}
        damper = current.damper.model_copy(update={"base": law.base, "effects": effects})
        again = refit(whole.started_at(damper), damper, thresholds.MOST_EVALUATIONS_OF_BEST)
        if again.misfit < current.misfit - thresholds.STUCK_MISFIT:
            log.info("diagnose: the law begun afresh, misfit %.4g in the place of %.4g", again.misfit, current.misfit)
            self._reweight(again)

    def _reweight(self, found: FitResult) -> None:
        """Continue from an optimum with weights by what it leaves, unless these bend it to a wider gap.

        To its end, or a further effect would be paid for the rest of the way: where the force shows the length of a
        pocket by its stiffness alone, one set of weights leaves a valley in which the next moves far.
        """
        self.evidence = self.weigh(found.damper)
        self.current = refit(self.evidence.whole, found.damper, thresholds.MOST_EVALUATIONS_OF_BEST)
        if self._widens_gap(self.current, found):
            self.current = refit(self.evidence.whole, found.damper, evaluations=1)

    def swap(self) -> None:
        """Repeat the step of each effect adopted before the last, and keep what does better."""
        for name in self.current.effects[len(self.config.force) : -1]:
            step = next((i for i, each in enumerate(self.steps) if each.chosen == name), None)
            fixed = name in self.evidence.whole.per_voltage or library()[name].place == "material"
            if step is None or fixed or not self.evidence.campaign.budget.allows_more():
                continue
            without = self._without(name)
            refused = partial(self._refused, self.config, before=without)
            whole = self.evidence.whole
            self.steps[step], best = swap_step(whole, without, name, self.current, refused, self.config, self.jobs)
            if best.effect != name:
                self.reasons[name] = f"stand-in: {best.effect} does better beside what was adopted later"
                self.reasons[best.effect] = "adopted"
                self._reweight(best.fitted)

    def reweight_until_stable(self) -> None:
        """Iterate fit and weights until no parameter moves, unless that widens the gap."""
        evidence, current = reweighted(self.weigh, self.evidence, self.current)
        if not self._widens_gap(current, self.current):
            self.evidence, self.current = evidence, current

    def _widens_gap(self, fitted: FitResult, before: FitResult) -> bool:
        most = thresholds.LARGEST_GAP_GROWTH * self.evidence.gap(before)
        return self.evidence.gap(fitted) > max(most, self.config.negligible)

    def _without(self, effect: str) -> FitResult:
        """Fit without one of the adopted effects."""
        return refit(self.evidence.whole, self.current.damper.without_effects(effect))

    def competing_confounders(self) -> tuple[ConfounderMatch, ...]:
        """Return the confounders that would do as well as an adopted effect, in its place."""
        found = []
        for name in self.current.effects[len(self.config.force) :]:
            without = self._without(name)
            other = best_confounder(self.evidence.whole, without)
            difference = other.delta_bic - delta_bic(without, self.current)
            if difference < self.config.rival_bic:
                found.append(ConfounderMatch(name, self.current.damper, other.effect, other.fitted.damper, difference))
        return tuple(found)

    def undecided(self) -> tuple[str, ...]:
        """Return the effects that fit better where nothing was adopted but are rivals of none, each with its reason."""
        if self.current.effects:
            return ()
        short = [c for c in (self.steps[-1].tried if self.steps else ()) if c.delta_bic > self.config.adopt_bic]
        best = min((c.delta_bic for c in short), default=0.0)
        if best <= -self.config.rival_bic:
            lenient = self.config.model_copy(update={"adopt_bic": min(best + self.config.rival_bic, 0.0)})
            for each in short:
                if each.delta_bic <= lenient.adopt_bic:
                    self.reasons[each.effect] = self._refused(lenient, each) or acceptance.MAY_BE_CHANCE
        if self._may_be_late():
            self.reasons["sensor_delay"] = acceptance.LATE_OR_ELASTIC
        undecided = acceptance.MAY_BE_TEST_SCATTER, acceptance.MAY_BE_CHANCE, acceptance.LATE_OR_ELASTIC
        return tuple(name for name, why in self.reasons.items() if why in undecided)

    def _may_be_late(self) -> bool:
        """Tell whether a late force would do in the place of the oil springs, or beside them in that of a part."""
        whole, current, config = self.evidence.whole, self.current, self.config
        late = [c for c in (self.steps[-1].tried if self.steps else ()) if c.effect == "sensor_delay"]
        if any(acceptance.late_beside_springs(c, whole, current, config) for c in late):
            return True
        explained = not self.evidence.gap_is_significant(current, config)
        return explained and acceptance.late_or_elastic(self.weigh, whole, current, config)

    def _refused(self, config: DiagnoseConfig, each: Candidate, before: FitResult | None = None) -> str | None:
        """Say why a candidate is too little, or spurious; None where the data support it by itself."""
        evidence, before = self.evidence, before or self.current
        return (
            acceptance.insufficient_support(evidence, config, each)
            or self._leaves_gap(evidence, before, each)
            or acceptance.spurious(evidence, self.weigh(each.fitted.damper), config, before, each)
        )

    def _drop_needless(self, effect: str, newest: str) -> None:
        """Remove an earlier effect that no longer improves the criterion or no longer moves the force."""
        whole, current = self.evidence.whole, self.current
        if library()[effect].place == "material":
            return
        without = self._without(effect)
        pays = delta_bic(without, current) <= self.config.adopt_bic
        if not pays or force_change(whole, without.simulated, current.simulated) < self.config.visible:
            self.current, self.reasons[effect] = without, f"stand-in: not needed beside {newest}"


def law_beside(campaign: Campaign, damper: Damper, effects: Sequence[str]) -> Damper | None:
    """Fit the knee law to the measured forces less what some effects of a damper make of them.

    Parameters
    ----------
    campaign : the records
    damper : with the law and the effects
    effects : names of those that are taken off

    Returns
    -------
    the damper with the law alone, about the zero of the displacement; None where a base row has no test
    """
    without = damper.without_effects(*effects)
    tests: dict[int, list[Record]] = {}
    for p in campaign.cleaned:
        if p.constant:
            force = p.record.force - (predicted_force(damper, p) - predicted_force(without, p))
            tests.setdefault(nearest_row(damper.base, p), []).append(replace(p.record, force=force))
    if len(tests) < len(damper.base):
        return None
    rows = [(damper.base[i], tests[i]) for i in sorted(tests)]
    return fitted_knee_damper(
        [((None, row.voltage_V, row.temperature_degC), records, row.k_N_per_m) for row, records in rows]
    ).about(0.0)


def _ranked_above(chosen: Candidate, tried: Sequence[Candidate]) -> frozenset[str]:
    """Return the effects that ranked above the chosen one: they were refused."""
    return frozenset(c.effect for c in itertools.takewhile(lambda c: c is not chosen, tried) if not c.varies)
