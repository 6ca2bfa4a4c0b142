"""How sure a verdict is: the share that what it says has of all that the tests leave possible."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence

import numpy as np

from pzd.diagnose.config import DiagnoseConfig
from pzd.diagnose.search.detection import Detection, of_fit
from pzd.diagnose.search.selection import Selection
from pzd.diagnose.thresholds import LARGEST_GAP, NOT_EXCLUDED, OUTSIDE_LIBRARY, SMALLEST_GAP


def confidence_of(selection: Selection, config: DiagnoseConfig, beside: Collection[str] = ()) -> float:
    """Probability that what is missing is what was adopted or a rival of it, and that nothing else that counts is.

    Before the tests, something more is missing as likely as not, each effect of the library is as likely as any other,
    and each size of its gap as likely as any other by its logarithm. What is not in the library is expected to be seen
    as well as what is, but for a share that looks like one of its effects or like nothing.

    Equation: P = (1 - q) prod_r sum_(i named) B_i / (n B_0 + sum_i B_i), B_i as in `Detection.log_odds` over the sizes
    that count, B_0 = (1 + mean_i B_i below them) / 2; r every step that adopted something, and what was tried after the
    last, where nothing more is named as well; q `OUTSIDE_LIBRARY`
                                                        Source: Kass and Raftery 1995, J. Am. Stat. Assoc. 90, eq. (1)

    Parameters
    ----------
    selection : what was adopted, and what was tried
    config : which gaps count
    beside : effects that are told as possible beside what was adopted
    """
    said = {*selection.adopted, *selection.rivals}
    sure = 1.0 - OUTSIDE_LIBRARY
    for step in selection.rounds:
        if step.chosen in selection.adopted:
            tried = {c.effect: of_fit(c, selection.last.whole.scales.low_force) for c in step.contenders}
            sure *= _together(_probabilities(tried, config.visible), said)
    sure *= _together(_left_open(selection, config), {None, *selection.undecided, *beside})
    for competition in selection.competitions:
        sure /= 1.0 + float(np.exp(-0.5 * competition.behind))
    return round(sure, 3)


def not_excluded(selection: Selection, config: DiagnoseConfig) -> dict[str, Detection]:
    """The effects beside those adopted and their rivals that the tests do not exclude, the likeliest first.

    Parameters
    ----------
    selection : what was adopted, and what was tried
    config : which gaps count
    """
    chances = _left_open(selection, config)
    likely = [name for name, chance in chances.items() if name is not None and chance >= NOT_EXCLUDED]
    likely.sort(key=chances.__getitem__, reverse=True)
    return {name: max(selection.left_open[name], key=lambda each: each.size) for name in likely}


def _left_open(selection: Selection, config: DiagnoseConfig) -> dict[str | None, float]:
    """Probability of every effect beside those adopted and their rivals, and under None that of nothing more."""
    said = {*selection.adopted, *selection.rivals}
    beside = {name: told for name, told in selection.left_open.items() if name not in said}
    return _probabilities(beside, config.visible)


def _probabilities(tried: Mapping[str, Sequence[Detection]], visible: float) -> dict[str | None, float]:
    """What each of some effects, and under None nothing, has of the probability of all of them and nothing."""
    from scipy.special import logsumexp, softmax

    known = {name: told for name, told in tried.items() if told}
    if not known:
        return {None: 1.0}
    small = [_log_odds(told, lambda each: (SMALLEST_GAP * visible, _least(each, visible))) for told in known.values()]
    nothing = float(np.logaddexp(0.0, logsumexp(small) - np.log(len(known)))) - np.log(2.0) + np.log(len(known))
    odds: dict[str | None, float] = {
        None: nothing,
        **{name: _log_odds(told, lambda each: (_least(each, visible), LARGEST_GAP)) for name, told in known.items()},
    }
    return dict(zip(odds, map(float, softmax([*odds.values()])), strict=True))


def _together(chances: Mapping[str | None, float], named: Collection[str | None]) -> float:
    return sum(chance for name, chance in chances.items() if name in named)


def _least(told: Detection, visible: float) -> float:
    """The smallest gap of an effect that counts, as a share of peak."""
    return min(max(visible, told.counts_from), LARGEST_GAP / 2.0)


def _log_odds(told: Sequence[Detection], sizes: Callable[[Detection], tuple[float, float]]) -> float:
    """Logarithm of the mean odds over the starting values of an effect, each as likely as any other.

    Parameters
    ----------
    told : of each starting value
    sizes : the smallest and the largest gap that is looked at
    """
    from scipy.special import logsumexp

    return float(logsumexp([each.log_odds(*sizes(each)) for each in told]) - np.log(len(told)))
