"""Which of the adopted effects are handed on: those with which the damper predicts kept-back tests no worse."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pzd.artefacts import Prediction
from pzd.damper.effects import library
from pzd.damper.nature import against_nature
from pzd.diagnose.added_by_prediction import with_predictive_effects
from pzd.diagnose.config import DiagnoseConfig
from pzd.diagnose.fit.least_squares import fit
from pzd.diagnose.kept_back import Trials
from pzd.diagnose.missed import Missed
from pzd.diagnose.search.evidence import evidence_of
from pzd.diagnose.search.selection import Selection

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
        missed, by_criterion = _best(kept, trials)
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


def _best(selection: Selection, trials: Trials) -> tuple[Missed, bool]:
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
