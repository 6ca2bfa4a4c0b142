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
from itertools import pairwise

import numpy as np

from pzd.artefacts import Prediction
from pzd.damper.compose import respond
from pzd.damper.effects import library
from pzd.damper.model import Damper, against_nature
from pzd.damper.motion import Motion
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.cross_validation import Missed, Trials
from pzd.diagnosis.fit.least_squares import LEVEL, Fitted, fit, standard_errors
from pzd.diagnosis.fit.parameters import Problem
from pzd.diagnosis.fit.prediction import counted, motion_of
from pzd.diagnosis.search.acceptance import Selection
from pzd.diagnosis.search.candidates import Candidate, by_voltage, candidate, most_promising, seen_in
from pzd.diagnosis.search.evidence import evidence_of
from pzd.diagnosis.thresholds import FARTHEST_HALF_WAY, LEAST_CUT_IN_PREDICTION, PREDICTED_AT_ONCE, SCREENED
from pzd.record import Array
from pzd.signals.measures import rms

# ----------------------------------------------------------------------------------------------------
# Whether a damper's force half-way between two tested voltages lies between its forces at either.
#
# No test is there to show it, and no voltage left out either: that is predicted from voltages twice as far apart. T0, C
# and k lie on lines between voltages, and the force nearly does. An effect whose parameters differ by voltage may leave
# that line where the tests of one voltage hardly know them: each pair predicts its own tests, and what lies between two
# pairs is no damper.


TOLERANCE = 1e-5
"""Of the damper's path, as a share of the force: far below the shares that are compared."""


def between_neighbours(damper: Damper, trials: Trials) -> bool:
    """Whether the force half-way between any two voltages lies near the mean of those at either, in their tests.

    Equation: rms(F((u + w)/2) - (F(u) + F(w))/2) <= s rms(F(w) - F(u)), s = 1/4

    Parameters
    ----------
    damper : the one tried
    trials : the tests, of which those at a voltage that stands still are driven at both and half-way

    Returns
    -------
    False where in any of them it lies visibly farther off
    """
    groups = {v: group for v, group in zip(trials.voltages, trials.groups, strict=True) if v is not None}
    return all(
        _lies_between(damper, trials, record, low, high)
        for low, high in pairwise(sorted(groups))
        for record in (*groups[low], *groups[high])
    )


def _lies_between(damper: Damper, trials: Trials, record: int, low: float, high: float) -> bool:
    below, half_way, above = _forces(damper, trials, record, (low, 0.5 * (low + high), high))
    off = rms(half_way - 0.5 * (below + above))
    seen = trials.visible * float(max(np.max(np.abs(below)), np.max(np.abs(above))))
    return off <= max(FARTHEST_HALF_WAY * rms(above - below), seen)


def _forces(damper: Damper, trials: Trials, record: int, voltages: tuple[float, ...]) -> Iterator[Array]:
    """The force under the motion of a test at other voltages, as far as it does not depend on how the test began."""
    prepared = trials.campaign.prepared[record]
    motion, places = motion_of(prepared.record)
    for voltage in voltages:
        held: Motion = replace(motion, voltage=np.full(motion.time.size, voltage))
        yield respond(damper, held, float(prepared.record.force[0]), TOLERANCE)[places][counted(prepared)]


# ----------------------------------------------------------------------------------------------------


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
            and not effect.needs_displacement_zero
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


# ----------------------------------------------------------------------------------------------------
# Which of the adopted effects are handed on: those with which the damper predicts kept-back tests no worse.


HARMFUL = "the damper predicts kept-back tests worse with it"
IMPOSSIBLE = "stand-in: fits with a value alone that it has nowhere in nature"


@dataclass(frozen=True, eq=False)
class HandedOn:
    """What was adopted and does no harm, and what it predicts."""

    selection: Selection
    plain: Missed
    """What the plain damper misses of kept-back tests."""
    missed: Missed
    """What the damper handed on misses of them."""
    between: Missed
    """What it misses of the voltages between others, each left out of the fit."""
    refused: str | None
    """Why the plain damper is handed on although effects fitted the tests; None where it is not."""
    by_criterion: bool = False
    """Whether the last fit is by criterion (4), every sample alike: what is left is then no noise to weigh by."""
    added: tuple[str, ...] = ()
    """What was added for what the damper predicts with it, and for nothing else, in words."""

    def prediction(self, trials: Trials) -> Prediction | None:
        """What is predicted of kept-back tests and voltages, for diagnosis.json; None where nothing could be."""
        return trials.prediction(self.plain, self.missed, self.between)


def handed_on(selection: Selection, trials: Trials, forced: Sequence[str], unit: str) -> HandedOn:
    """Take back what makes the prediction of kept-back tests worse, until the damper does no harm or is the plain one.

    An effect goes without which the damper predicts better; and the last adopted one for as long as the plain damper,
    as identify finds it without the kept-back tests, predicts better at any voltage, or much better a voltage between
    two others.

    Parameters
    ----------
    selection : what was adopted
    trials : the tests, dealt into folds
    forced : effects that the config asks for, whatever they do
    unit : of the control signal, for the words
    """
    plain = trials.plain_missed()
    kept, refused = _without_impossible(selection, forced)
    missed, between, by_criterion = plain, trials.plain_missed_between, False
    while kept.adopted:
        missed, by_criterion = _handed_on_best(kept, trials)
        between = trials.missed_between(kept.fitted.damper, by_criterion=by_criterion)
        ours = [name for name in kept.adopted if name not in forced]
        compared, kind = (missed, plain), "kept-back ones"
        worse = trials.worse(*compared)
        if not worse:
            compared, kind = (between, trials.plain_missed_between), "those of a voltage left out"
            worse = trials.worse_between(between)
        harmful = _harmful(kept, trials, missed, ours, by_criterion=by_criterion) or (
            ours[-1] if worse and ours else None
        )
        if harmful is None:
            break
        if worse and len(kept.adopted) == 1:
            refused = _refused(selection, f"{kind} are predicted", compared, trials, worse, unit)
        kept = _without(kept, harmful)
    if not kept.adopted:
        return HandedOn(kept, plain, plain, trials.plain_missed_between, refused)
    found = trials.fitted_by_criterion(kept.fitted.damper, trials.nothing) if by_criterion else None
    if found is not None:
        kept = replace(kept, fitted=found[1], last=replace(kept.last, whole=found[0]))
    return HandedOn(kept, plain, missed, between, None, by_criterion)


def with_additions(handed: HandedOn, trials: Trials, config: DiagnoseConfig) -> HandedOn:
    """The same with the effects that improve the prediction of kept-back tests, where a gap has no name.

    Parameters
    ----------
    handed : what does no harm
    trials : the tests, dealt into folds
    config : how many effects there may be, which are forbidden, what is visible
    """
    more = with_predictive_effects(handed.selection, handed.missed, handed.between, trials, config)
    if more is None:
        return handed
    return replace(
        handed,
        selection=more.selection,
        missed=more.missed,
        between=more.between,
        refused=None,
        by_criterion=True,
        added=more.added,
    )


def _without_impossible(selection: Selection, forced: Sequence[str]) -> tuple[Selection, str | None]:
    """The selection without effects that fit with impossible values alone; and why nothing is left, if nothing is.

    One with a rival stays: there the verdict is `ambiguous`, and what is adopted is the best of several.
    """
    kept = selection
    while odd := [] if kept.rivals else [name for name in against_nature(kept.fitted.damper) if name not in forced]:
        kept = _without(kept, odd[-1], IMPOSSIBLE)
    if kept.adopted or kept is selection:
        return kept, None
    words = [f"{name} with {_values(selection, name)}" for name in selection.adopted]
    return kept, (
        f"{' and '.join(words)} would fit the tests, but nowhere in nature is there such a value: something else that "
        "looks alike is missing"
    )


def _values(selection: Selection, effect: str) -> str:
    """The parameters of an effect as a sentence shows them."""
    values = selection.fitted.damper.effects[effect]
    return ", ".join(
        f"{p.name} = {' and '.join(f'{value:.3g}' for value in np.atleast_1d(values[p.name]))} {p.unit}"
        for p in library()[effect].parameters
    )


def _handed_on_best(selection: Selection, trials: Trials) -> tuple[Missed, bool]:
    """What the damper misses, and whether it is fitted by criterion (4) since that predicts visibly better.

    The likelihood weighs by noise: the best there is as long as noise is what is left, and misled where a law is
    missing, which the gap shows.
    """
    weighed = trials.missed(selection.fitted.damper)
    if selection.last.gap(selection.fitted) < trials.visible:
        return weighed, False
    alike = trials.missed_by_criterion(selection.fitted.damper)
    return (alike, True) if alike.less_than(weighed) else (weighed, False)


def _harmful(
    selection: Selection, trials: Trials, missed: Missed, ours: Sequence[str], *, by_criterion: bool
) -> str | None:
    """An effect without which the others predict better; a lone one is held against the plain damper instead."""
    if len(selection.adopted) == 1:
        return None
    asked = trials.missed_by_criterion if by_criterion else trials.missed
    without = ((name, asked(_without(selection, name).fitted.damper)) for name in reversed(ours))
    return next((name for name, other in without if trials.worse(missed, other)), None)


def _without(selection: Selection, effect: str, reason: str = HARMFUL) -> Selection:
    """The selection with one effect taken back for a reason, the rest fitted anew."""
    fewer = selection.fitted.damper.without_effects(effect)
    reasons = {**selection.reasons, effect: reason}
    if not fewer.effects:
        return replace(
            selection,
            fitted=selection.plain,
            last=selection.first,
            competitions=(),
            reasons=reasons,
        )
    last = evidence_of(selection.last.campaign, fewer)
    return replace(
        selection,
        fitted=fit(last.whole, tuple(fewer.effects), last.whole.start_with(fewer)),
        last=last,
        competitions=tuple(c for c in selection.competitions if c.effect != effect),
        reasons=reasons,
    )


def _refused(
    selection: Selection,
    predicted: str,
    missed: tuple[Missed, Missed],
    trials: Trials,
    worse: Sequence[float | None],
    unit: str,
) -> str:
    """Why nothing that was adopted is handed on, with the figures where it is worst."""
    groups = dict(zip(trials.voltages, trials.groups, strict=True))

    def figures(voltage: float | None) -> tuple[float, float]:
        adopted, plain = (each.of(groups[voltage]).criterion or 0.0 for each in missed)
        return adopted, plain

    worst = max(worse, key=lambda voltage: figures(voltage)[0] - figures(voltage)[1])
    adopted, plain = figures(worst)
    at = "" if worst is None or len(groups) == 1 else f" at {worst:.4g} {unit}"
    return (
        f"{' and '.join(selection.adopted)} would fit the tests, but {predicted} worse than by the "
        f"plain damper (W_s {adopted:.2g} against {plain:.2g}{at}), which is handed on"
    )
