"""Search for the effects with which held-out tests are predicted best, where a gap has no name.

Weights by noise mislead there: each law is bent towards what is missing, and takes other values on other tests. So all
fits are by criterion (4), every sample weighted alike, and what decides is the prediction error of tests held out of
the fit. The search adds an effect, or lets one differ by voltage; where no addition helps it exchanges an adopted
effect for another, or for two, and where none of these helps, several for one.

A step is taken if held-out tests are predicted better, beyond chance, and at no voltage worse, or as well by fewer
parameters; if the interpolation error at left-out voltages is not larger, or where no step is like that, if it loses
less there than it gains; and if the force half-way between two voltages passes `interpolation_check`. What is off, or
that the prediction does not need, beside the new effect goes.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from pzd.damper.compose import respond, sensors_of
from pzd.damper.effect import NODE_VOLTAGES
from pzd.damper.effects import library
from pzd.damper.model import Damper
from pzd.diagnosis import thresholds
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.cross_validation import CrossValidation
from pzd.diagnosis.fit.least_squares import FitResult, refit
from pzd.diagnosis.fit.prediction import comparable_samples, simulation_motion
from pzd.diagnosis.fit.problem import Problem
from pzd.diagnosis.search.candidates import (
    Candidate,
    Promise,
    candidate,
    most_promising,
    per_voltage_candidates,
    problem_for,
    testable,
)
from pzd.diagnosis.search.determination import MAY_BE_OFF, cancelling, showing, undetermined
from pzd.fit.cross_validation import PredictionError
from pzd.record import Array
from pzd.signals.measures import rms

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class CriterionFit:
    """A damper fitted by criterion (4), and its prediction errors."""

    problem: Problem
    fitted: FitResult
    error: PredictionError
    """Of held-out tests."""
    interpolation_error: PredictionError
    """Of left-out voltages."""


@dataclass(frozen=True, eq=False)
class _Proposal:
    """A damper that a step of the search may go to, and its prediction error to first order."""

    problem: Problem
    fitted: FitResult
    estimate: float
    """W_s of held-out tests, see `CrossValidation.error_to_first_order`."""

    @classmethod
    def of(cls, problem: Problem, fitted: FitResult, validation: CrossValidation) -> _Proposal:
        return cls(problem, fitted, validation.error_to_first_order(problem, fitted).criterion or 0.0)


@dataclass(eq=False)
class PredictiveSearch:
    """The search of one campaign: what it may try, and what it remembers of effects that it tried before."""

    validation: CrossValidation
    config: DiagnoseConfig
    most_effects: int
    """That the damper may have."""
    reached: dict[str, Array] = field(default_factory=dict)
    """Values in the units of the search that the last fit of an effect reached: where the next one starts."""
    off: set[str] = field(default_factory=set)
    """Effects that were off beside an added one, or cancel another: they are not tried again."""
    alternatives: dict[str, str] = field(default_factory=dict)
    """What would predict as well in the place of an effect of the damper that the search ended with."""
    bent: set[str] = field(default_factory=set)
    """Effects that go wrong between voltages beside those of the current damper: not tried before it is another."""
    losing: list[CriterionFit] = field(default_factory=list)
    """Steps from the current damper that lose between voltages less than they gain: taken where no other is left."""

    def improve(self, current: CriterionFit) -> CriterionFit:
        """Add and exchange effects until nothing improves the prediction or the budget is spent."""
        while self.validation.campaign.budget.allows_more():
            log.info("diagnose: looks for what predicts kept-back tests, beside %s", _names(current) or "no effect")
            self.losing.clear()
            best = (self._best(current, proposals) for proposals in self._neighbours(current))
            better = next((found for found in best if found is not None), None)
            # Where every step loses something between voltages, that which loses least for what it gains.
            better = better or min(self.losing, key=_merit, default=None)
            if better is None:
                return current
            log.info("diagnose: %s, W_s of kept-back tests %.4g", _names(better), better.error.criterion)
            # What is off beside the new effect goes at once: something else may explain what it had stood in for.
            needed = without_replaced(better, self.validation, self.config.force)
            current = without_off(needed, self.validation, self.config.force)
            self.off |= {*better.fitted.effects} - {*current.fitted.effects}
            self.bent.clear()
        return current

    def _neighbours(self, current: CriterionFit) -> Iterator[list[_Proposal]]:
        """Yield what a step may go to: one effect more, two, one for another, what is asked last, one for several."""
        added = self._additions(current.problem, current.fitted)
        yield added
        budget = self.validation.campaign.budget
        sound = [each for each in added if self.bent.isdisjoint(each.fitted.effects)]
        if sound and budget.allows_more():
            first = min(sound, key=lambda each: each.estimate)
            yield self._additions(first.problem, first.fitted)
        if budget.allows_more():
            yield self._exchanges(current)
        if budget.allows_more():
            last = self._further(current.problem, current.fitted, thresholds.SCREENED_EFFECTS, asked_last=True)
            # By several numbers, that six evaluations do not find.
            yield [self._searched_on(each) for each in self._possible(current.problem, last)]
        if budget.allows_more():
            yield self._one_for_several(current)

    def _best(self, current: CriterionFit, tried: Sequence[_Proposal]) -> CriterionFit | None:
        """Return what predicts best of those that promise to; None where none improves the prediction."""
        here = _Proposal.of(current.problem, current.fitted, self.validation).estimate
        promising = sorted((each for each in tried if each.estimate < here), key=lambda each: each.estimate)
        better: list[Tried] = []
        for each in promising[: thresholds.CROSS_VALIDATED_CANDIDATES]:
            error = self.validation.error_by_criterion(each.fitted.damper)
            fewer = each.fitted.optimum.size < current.fitted.optimum.size
            wanted = as_good if fewer else improves
            if wanted(error, current.error, self.validation):
                between = self.validation.interpolation_error(each.fitted.damper, by_criterion=True)
                better.append(Tried(each, error, between))
        while better:
            # What goes wrong between voltages is no measure of what is alike: the best of the others is.
            tried_on = min(better, key=_fewest_parameters_of_alike(better))
            better.remove(tried_on)
            damper = tried_on.proposal.fitted.damper
            found = self.validation.fit_by_criterion(damper, self.validation.no_samples)
            new = {*tried_on.proposal.fitted.effects} - {*current.fitted.effects}
            # A candidate is fitted in a few evaluations: at its optimum it may be two forces of any size that cancel.
            cancelled = new & {name for pair in cancelling(*found) for name in pair} if found and new else set()
            self.off |= cancelled
            if cancelled or (found is not None and _shown_early(found[1].damper)):
                continue
            too_much = loses_between(current, tried_on, self.validation.baseline_interpolation_error)
            if found is not None and not too_much and interpolation_check(found[1].damper, self.validation):
                step = CriterionFit(*found, tried_on.error, tried_on.interpolation_error)
                if not current.interpolation_error.visibly_below(step.interpolation_error):
                    return step
                self.losing.append(step)
            self.bent |= new
        return None

    def _additions(self, problem: Problem, fitted: FitResult) -> list[_Proposal]:
        """Return what a further effect gives, or an adopted one with its parameters per voltage."""
        found = per_voltage_candidates(problem, fitted, self.validation.campaign.jobs)
        found += self._further(problem, fitted, thresholds.SCREENED_EFFECTS)
        return self._possible(problem, found)

    def _further(
        self,
        problem: Problem,
        fitted: FitResult,
        count: int,
        barred: Sequence[str] = (),
        *,
        asked_last: bool = False,
        for_several: bool = False,
    ) -> list[Candidate]:
        """Fit the most promising effects beside those of a fit, either those that are asked last or all others.

        Until so many move the force visibly: what comes to nothing takes no place from the next one. What begins at
        some displacement is not tried: it would grow beyond the recorded stroke, where no test shows it.
        """
        if len(fitted.effects) >= self.most_effects and not for_several:
            return []
        bent = () if for_several else self.bent
        barred = (*fitted.effects, *problem.law, *self.config.forbid, *self.off, *bent, *barred)
        new = [
            effect
            for effect in library().values()
            if effect.name not in barred
            and effect.asked_last == asked_last
            and not effect.needs_displacement_zero
            and testable(problem, fitted, effect)
        ]
        promises = most_promising(problem, fitted, new, self.reached, self.validation.campaign.jobs)
        found: list[Candidate] = []
        while promises and (places := count - sum(self._moves_force(each) for each in found)):
            found += self._tried(problem, fitted, promises[:places])
            promises = promises[places:]
        return found + self._alike(problem, fitted, found)

    def _tried(self, problem: Problem, fitted: FitResult, promises: Sequence[Promise]) -> list[Candidate]:
        """Fit effects beside those of a fit, and remember the values that they reached.

        Not of what came to nothing: from there a linearised step promises what no search keeps.
        """
        fits = self.validation.campaign.parallel_map(
            lambda each: candidate(each.problem, fitted, each.effect, each.start), promises
        )
        self.reached.update((c.effect, c.fitted.optimum[fitted.optimum.size :]) for c in fits if self._moves_force(c))
        pairs = zip(fits, promises, strict=True)
        return [replace(each, varies=promise.problem is not problem) for each, promise in pairs]

    def _alike(self, problem: Problem, fitted: FitResult, found: Sequence[Candidate]) -> list[Candidate]:
        """Fit effects whose parameters follow T0 from voltage to voltage with one value at all, as a seal has."""

        def alike(each: Candidate) -> Candidate:
            own = each.fitted.optimum[fitted.optimum.size :].reshape(len(problem.voltages), -1)
            return candidate(problem, fitted, library()[each.effect], own.mean(axis=0))

        varying = [each for each in found if each.varies and self._moves_force(each)]
        return list(self.validation.campaign.parallel_map(alike, varying))

    def _moves_force(self, found: Candidate) -> bool:
        return found.explained >= self.config.visible

    def _possible(self, problem: Problem, found: Sequence[Candidate]) -> list[_Proposal]:
        """Return the candidates that move the force visibly, with values that nature has and the tests determine.

        Whether one may be off is for the prediction to say: where two of its parameters go together, as the length of a
        pocket and its pressure do, the interval of either holds zero though both together are there.
        """

        def proposal(each: Candidate) -> _Proposal | None:
            if not self._moves_force(each) or each.fitted.unphysical or _shown_early(each.fitted.damper):
                return None
            own = problem_for(problem, library()[each.effect])  # it may have fewer base rows
            own = replace(own, per_voltage=own.per_voltage | ({each.effect} if each.varies else set()))
            none = undetermined(own, each.fitted).get(each.effect, MAY_BE_OFF) != MAY_BE_OFF
            return None if none else _Proposal.of(own, each.fitted, self.validation)

        made = self.validation.campaign.parallel_map(proposal, found)
        return [each for each in made if each is not None]

    def _searched_on(self, proposal: _Proposal) -> _Proposal:
        """Return a proposal at its optimum: candidates are fitted in a few evaluations."""
        return _Proposal.of(proposal.problem, refit(proposal.problem, proposal.fitted.damper), self.validation)

    def _exchanges(self, current: CriterionFit) -> list[_Proposal]:
        """Return what another effect gives in the place of an adopted one, and two in the place of the best such."""
        proposals: list[_Proposal] = []
        here = _Proposal.of(current.problem, current.fitted, self.validation).estimate
        self.alternatives.clear()
        for name in current.fitted.effects:
            if name in self.config.force:
                continue
            if (found := self._fit_without(current.fitted, name)) is not None:
                tried = self._possible(found[0], self._further(*found, thresholds.EXCHANGED_EFFECTS, (name,)))
                tried.sort(key=lambda each: each.estimate)
                tried = [self._searched_on(t) if t is tried[0] or _replaces(t, name) else t for t in tried]
                tried.sort(key=lambda each: each.estimate)
                proposals += tried
                if tried and tried[0].estimate < (1.0 + thresholds.LEAST_PREDICTION_GAIN) * here:
                    self.alternatives[name] = tried[0].fitted.effects[-1]
        if not proposals:
            return []
        best = min(proposals, key=lambda each: each.estimate)
        gone = tuple({*current.fitted.effects} - {*best.fitted.effects})
        two = self._further(best.problem, best.fitted, thresholds.EXCHANGED_EFFECTS, gone)
        return proposals + self._possible(best.problem, two)

    def _one_for_several(self, current: CriterionFit) -> list[_Proposal]:
        """Return what one more effect gives without those that are needed least beside it, one by one.

        Two that stand together for a third keep it out: in the place of either it is no better, and beside both it goes
        wrong between voltages.
        """
        proposals: list[_Proposal] = []
        here = _Proposal.of(current.problem, current.fitted, self.validation).estimate
        further = self._further(current.problem, current.fitted, thresholds.SCREENED_FOR_SEVERAL, for_several=True)
        begun = sorted(self._possible(current.problem, further), key=lambda each: each.estimate)
        for beside_all in begun[: thresholds.FOR_SEVERAL]:
            at, kept = beside_all, {beside_all.fitted.effects[-1], *self.config.force}
            while at.estimate < thresholds.NO_WAY_BACK * here:
                fits = [self._fit_without(at.fitted, name) for name in at.fitted.effects if name not in kept]
                fewer = [_Proposal.of(*found, self.validation) for found in fits if found is not None]
                if not fewer:
                    break
                at = min(fewer, key=lambda each: each.estimate)
                proposals.append(at)
        return [each for each in proposals if len(each.fitted.effects) <= self.most_effects]

    def _fit_without(self, fitted: FitResult, name: str) -> tuple[Problem, FitResult] | None:
        """Fit a damper again without one of its effects."""
        return self.validation.fit_by_criterion(fitted.damper.without_effects(name), self.validation.no_samples)


@dataclass(frozen=True, eq=False)
class Tried:
    """A proposal with its prediction errors."""

    proposal: _Proposal
    error: PredictionError
    interpolation_error: PredictionError


def _merit(found: CriterionFit | Tried) -> float:
    """Compute what a step lowers: W_s of held-out tests times that of left-out voltages, where there are any."""
    held_out, between = found.error.criterion, found.interpolation_error.criterion
    return (1.0 if held_out is None else held_out) * (1.0 if between is None else between)


def loses_between(current: CriterionFit | Tried, tried: Tried, plain: PredictionError) -> bool:
    """Whether a step loses at left-out voltages more than it gains at held-out tests, or what is no one's to lose.

    By the ratio of either error: a step that halves the one may cost the other a few per cent, which the next one may
    win back, but nothing beyond what the plain damper misses there.
    """
    if not current.interpolation_error.visibly_below(tried.interpolation_error):
        return False
    return plain.visibly_below(tried.interpolation_error) or _merit(tried) >= _merit(current)


def _fewest_parameters_of_alike(better: Sequence[Tried]) -> Callable[[Tried], tuple[float, float]]:
    """Return the order of what was tried: the best, and what predicts alike, by the parameters, then the others."""
    least = min((each.error.criterion or 0.0 for each in better), default=0.0)

    def order(tried: Tried) -> tuple[float, float]:
        criterion = tried.error.criterion or 0.0
        alike = (1.0 - thresholds.LEAST_PREDICTION_GAIN) * criterion <= least
        return (float(tried.proposal.fitted.optimum.size) if alike else np.inf), criterion

    return order


def _shown_early(damper: Damper) -> bool:
    """Whether a channel would show the force before it acts: then it stands for something of the damper.

    What is the sensor's is taken out of the force at the rod, and the damper would miss there what stood in it.
    """
    return any(value < 0.0 for values in sensors_of(damper).values() for value in values.values())


def _replaces(proposal: _Proposal, name: str) -> bool:
    """Whether the last effect of a proposal acts at the place of another one, of which it may be the whole law."""
    return library()[proposal.fitted.effects[-1]].place == library()[name].place == "branch"


def _names(found: CriterionFit) -> str:
    return " and ".join(effect_names(found.fitted.damper))


def effect_names(damper: Damper) -> list[str]:
    """Return the effects of a damper, those `by voltage` that differ by it."""
    return [f"{name} by voltage" if NODE_VOLTAGES in values else name for name, values in damper.effects.items()]


def improves(one: PredictionError, other: PredictionError, validation: CrossValidation) -> bool:
    """Whether held-out tests are predicted better, visibly and beyond chance, and at no voltage worse."""
    if one.criterion is None or other.criterion is None:
        return False
    less = one.criterion <= (1.0 - thresholds.LEAST_PREDICTION_GAIN) * other.criterion
    return less and bool(validation.better_at(one, other)) and not validation.worse_at(one, other)


def as_good(one: PredictionError, other: PredictionError, validation: CrossValidation) -> bool:
    """Whether held-out tests are predicted no worse in all, and at no voltage: then fewer parameters do as well."""
    if one.criterion is None or other.criterion is None:
        return False
    return one.criterion <= other.criterion and not validation.worse_at(one, other)


def without_replaced(current: CriterionFit, validation: CrossValidation, forced: Sequence[str]) -> CriterionFit:
    """Remove effects that the data do not determine beside the others, and that the prediction does not need."""
    while True:
        fewer = []
        for name in _removable(current.fitted):
            if name in forced:
                continue
            damper = current.fitted.damper.without_effects(name)
            error = validation.error_by_criterion(damper)
            found = validation.fit_by_criterion(damper, validation.no_samples)
            if found is None or improves(current.error, error, validation):
                continue
            if interpolation_check(found[1].damper, validation):
                fewer.append((*found, error))
        if not fewer:
            return current
        problem, fitted, error = min(fewer, key=lambda each: each[2].criterion or 0.0)
        between = validation.interpolation_error(fitted.damper, by_criterion=True)
        current = CriterionFit(problem, fitted, error, between)


def without_off(current: CriterionFit, validation: CrossValidation, forced: Sequence[str]) -> CriterionFit:
    """Remove effects that may as well be off beside what was added, unless the prediction needs them; refit the rest.

    What begins at some displacement goes whatever it predicts: within the tests it does little either way; beyond them,
    as a stop at the end of the stroke, anything.
    """
    needed = set[str]()
    while True:
        shown = {*showing(current.fitted), *forced, *needed}
        off = next((name for name in current.fitted.effects if name not in shown), None)
        damper = current.fitted.damper.without_effects(off or "")
        found = validation.fit_by_criterion(damper, validation.no_samples) if off else None
        if off is None or found is None:
            return current
        error = validation.error_by_criterion(damper)
        if not library()[off].needs_displacement_zero and improves(current.error, error, validation):
            needed.add(off)
            continue
        between = validation.interpolation_error(found[1].damper, by_criterion=True)
        current = CriterionFit(*found, error, between)


def _removable(fitted: FitResult) -> list[str]:
    """Return the effects whose strength may as well be zero, or with impossible values."""
    shown, odd = showing(fitted), fitted.unphysical
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
    cleaned = validation.campaign.cleaned[record]
    motion, samples = simulation_motion(cleaned.record)

    def force(voltage: float) -> Array:
        """Compute the force at another voltage, where it does not depend on how the test began."""
        fixed_voltage = replace(motion, voltage=np.full(motion.time.size, voltage))
        found = respond(damper, fixed_voltage, float(cleaned.record.force[0]), TOLERANCE)
        return found[samples][comparable_samples(cleaned)]

    below, half_way, above = force(low), force(0.5 * (low + high)), force(high)
    off = rms(half_way - 0.5 * (below + above))
    seen = validation.visible * float(max(np.max(np.abs(below)), np.max(np.abs(above))))
    return off <= max(thresholds.INTERPOLATION_DEPARTURE * rms(above - below), seen)
