"""More effects for a damper that leaves a gap without a name: those with which it predicts kept-back tests better.

Where a law is missing that no name accounts for, evidence weighed by noise misleads: each law is bent towards what is
missing, and takes other values on other tests. What counts there is what the damper is for, to predict tests. An effect
is added if whole tests that no fit has seen are predicted better with it, beyond chance, and at no voltage worse; and
if voltages left out are predicted no worse from those around them, beyond chance or not, since a law that takes other
values there is none; and if half-way between two voltages the force lies between those at either. That makes no name of
it: the verdict stays `unexplained`.

What is added may say better what an effect before it stood in for, as a gas that hardens does for a spring beside the
element: then the data no longer know that one's parameters, and it goes if kept-back tests are predicted as well.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from pzd.damper.effects import library
from pzd.damper.nature import against_nature
from pzd.diagnose.config import DiagnoseConfig
from pzd.diagnose.fit.intervals import LEVEL, standard_errors
from pzd.diagnose.fit.least_squares import Fitted
from pzd.diagnose.fit.parameters import Problem
from pzd.diagnose.half_way import between_neighbours
from pzd.diagnose.kept_back import Trials
from pzd.diagnose.missed import Missed
from pzd.diagnose.search.candidates import Candidate, by_voltage, candidate, seen_in
from pzd.diagnose.search.selection import Selection
from pzd.diagnose.search.starts import most_promising
from pzd.diagnose.thresholds import LEAST_CUT_IN_PREDICTION, PREDICTED_AT_ONCE, SCREENED

log = logging.getLogger(__name__)

ADDED = "added: kept-back tests are predicted better with it; what it stands for is open"
REPLACED = "stand-in: kept-back tests are predicted as well without it, beside what was added"


@dataclass(frozen=True, eq=False)
class Extended:
    """A damper with more effects."""

    selection: Selection
    missed: Missed
    """What it misses of kept-back tests."""
    between: Missed
    """What it misses of the voltages between others."""
    added: tuple[str, ...]
    """What was added, best first, in words."""


@dataclass(frozen=True, eq=False)
class _Predicting:
    """A damper fitted by criterion (4), and what it misses."""

    problem: Problem
    fitted: Fitted
    missed: Missed
    between: Missed


def with_predictive_effects(
    selection: Selection, missed: Missed, between: Missed, trials: Trials, config: DiagnoseConfig
) -> Extended | None:
    """The damper with the effects that improve its prediction of kept-back tests, added one after another.

    All fits are by criterion (4), every sample alike, and nothing is fitted to a kept-back test.

    Parameters
    ----------
    selection : what was adopted
    missed, between : what the damper misses of kept-back tests, and of the voltages between others
    trials : the tests, dealt into folds
    config : how many effects there may be, which are forbidden, what is visible

    Returns
    -------
    None where nothing improves the prediction
    """
    fitted = trials.fitted_by_criterion(selection.fitted.damper, trials.nothing)
    if fitted is None:
        return None
    added: list[Candidate] = []
    found = _Predicting(*fitted, missed, between)
    while trials.campaign.work.may_go_on():
        better = _best(found, trials, config, selection.adopted)
        if better is None:
            break
        chosen, found = better
        added.append(chosen)
        log.info("diagnose: %s added, W_s of kept-back tests %.4g", _in_words(chosen), found.missed.criterion)
    if not added:
        return None
    lean = _without_replaced(found, trials, config.force)
    words = tuple(_in_words(each) for each in added if each.effect in lean.fitted.effects)
    if not words:
        return None
    new = {each.effect: ADDED for each in added if each.effect not in selection.adopted}
    gone = dict.fromkeys({*selection.adopted, *new} - {*lean.fitted.effects}, REPLACED)
    return Extended(
        replace(
            selection,
            fitted=lean.fitted,
            last=replace(selection.last, whole=lean.problem),
            reasons={**selection.reasons, **new, **gone},
        ),
        lean.missed,
        lean.between,
        words,
    )


def _without_replaced(found: _Predicting, trials: Trials, forced: Sequence[str]) -> _Predicting:
    """The same without effects that the data do not know beside the others, and that prediction does not need."""
    while True:
        fewer = []
        for name in _undetermined(found.fitted):
            if name in forced:
                continue
            damper = found.fitted.damper.without_effects(name)
            missed, at = trials.missed_by_criterion(damper), trials.fitted_by_criterion(damper, trials.nothing)
            if at is None or _predicts_better(found.missed, missed, trials):
                continue
            if between_neighbours(at[1].damper, trials):
                fewer.append((*at, missed))
        if not fewer:
            return found
        problem, fitted, missed = min(fewer, key=lambda each: each[2].criterion or 0.0)
        between = trials.missed_between(fitted.damper, by_criterion=True)
        found = _Predicting(problem, fitted, missed, between)


def _undetermined(fitted: Fitted) -> list[str]:
    """The effects that may as well be off, or have values that nature does not have.

    May be off: the 95 % interval of the strength, the first parameter, holds its neutral value.
    """
    strengths = {name: library()[name].parameters[0] for name in fitted.effects}
    unknowns = zip(fitted.unknowns, LEVEL * standard_errors(fitted), strict=True)
    known = {
        u.effect
        for u, error in unknowns
        if u.parameter == strengths.get(u.effect) and not abs(u.of(fitted.damper) - u.parameter.neutral) <= error
    }
    odd = against_nature(fitted.damper)
    return [name for name in fitted.effects if (name not in known or name in odd) and len(fitted.effects) > 1]


def _in_words(added: Candidate) -> str:
    return f"{added.effect} by voltage" if added.varies else added.effect


def _best(
    found: _Predicting, trials: Trials, config: DiagnoseConfig, adopted: Sequence[str]
) -> tuple[Candidate, _Predicting] | None:
    """Of the candidates that fit best, the one that predicts best; None where none predicts better than without it."""
    tried = _tried(found.problem, found.fitted, config, adopted)
    better = []
    for each in sorted(tried, key=lambda c: c.delta_bic)[:PREDICTED_AT_ONCE]:
        predicted = trials.missed_by_criterion(each.fitted.damper)
        if _predicts_better(predicted, found.missed, trials):
            better.append((each, predicted))
    for each, predicted in sorted(better, key=lambda pair: pair[1].criterion or 0.0):
        between = trials.missed_between(each.fitted.damper, by_criterion=True)
        if found.between.less_than(between):
            continue
        fitted = trials.fitted_by_criterion(each.fitted.damper, trials.nothing)
        if fitted is not None and between_neighbours(fitted[1].damper, trials):
            return each, _Predicting(*fitted, predicted, between)
    return None


def _tried(problem: Problem, fitted: Fitted, config: DiagnoseConfig, adopted: Sequence[str]) -> Iterator[Candidate]:
    """Candidates that are possible: a new effect each, or an adopted one with its parameters by voltage.

    What a sensor shows is not tried: no ride feels it, and a delay fits any hysteresis a little. Nor is what begins at
    some displacement: it would grow beyond the recorded stroke, where no test shows it.
    """
    found: list[Candidate] = by_voltage(problem, fitted)
    if len({*fitted.effects} - {*adopted}) < config.most_added:
        new = [
            effect
            for effect in library().values()
            if effect.name not in (*fitted.effects, *config.forbid)
            and effect.place != "sensor"
            and not effect.about_zero
            and seen_in(problem, effect)
        ]
        for effect in most_promising(problem, fitted, new, SCREENED):
            own = problem.growing(effect)
            found.append(replace(candidate(own, fitted, effect), varies=own is not problem))
    return (c for c in found if c.explained >= config.visible and not against_nature(c.fitted.damper))


def _predicts_better(one: Missed, other: Missed, trials: Trials) -> bool:
    """Whether kept-back tests are predicted better, visibly and beyond chance, and at no voltage worse."""
    if one.criterion is None or other.criterion is None:
        return False
    less = one.criterion <= (1.0 - LEAST_CUT_IN_PREDICTION) * other.criterion
    return less and bool(trials.better(one, other)) and not trials.worse(one, other)
