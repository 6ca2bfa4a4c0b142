"""The verdict: named, ambiguous, none or unexplained, its reason, and how sure it is."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pzd.artefacts import Prediction, Ranked, Value
from pzd.damper.confounders import known
from pzd.damper.effect import Parameter
from pzd.damper.effects import library
from pzd.damper.model import Damper, against_nature
from pzd.diagnosis.adoption import HandedOn, handed_on, with_additions
from pzd.diagnosis.campaign import Campaign, ResidualCheck, probability_of_noise, visible_gap
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.cross_validation import Trials
from pzd.diagnosis.fit.least_squares import LEVEL, standard_errors
from pzd.diagnosis.search.acceptance import Detection, Selection, of_fit
from pzd.diagnosis.search.candidates import moved_by
from pzd.diagnosis.search.evidence import Evidence, nearest_row
from pzd.diagnosis.thresholds import (
    CONTRADICTS,
    DOUBTFUL_BELOW,
    FEWEST_FOR_A_TREND,
    LARGEST_GAP,
    LIKELIER_THAN_NOT,
    NOT_EXCLUDED,
    OF_EACH_TEST,
    OUTSIDE_LIBRARY,
    SMALLEST_GAP,
)
from pzd.quantities import Control
from pzd.record import Array
from pzd.signals.measures import rms
from pzd.signals.nuisance import NuisanceConfig, nuisance_columns

# ----------------------------------------------------------------------------------------------------
# How sure a verdict is: the share that what it says has of all that the tests leave possible.


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


# ----------------------------------------------------------------------------------------------------
# What the tests' own gains, offsets and delays have in common: what follows the motion is no chance of single tests.
#
# A fit allows each test a gain, an offset and a delay of its own. By chance they scatter from test to test. Where they
# follow the frequency, the speed, the stroke or the temperature of the tests, something of the damper or of the stand is
# missing that these allowances hide.


UNIT = NuisanceConfig(offset=0.01, delay_s=0.001, gain=0.01)
"""What they are counted in: a hundredth of the peak force, a millisecond, a hundredth of the force."""
SAME = 1e-6
"""Tests whose frequency, speed or stroke differ by a smaller share do not differ; their temperatures likewise."""
OWN = ("offset", "gain", "delay")
"""What a test may have of its own, in the order of `columns_of`."""


@dataclass(frozen=True)
class Trend:
    """One allowance of the tests that follows one quantity of their motion."""

    own: str
    follows: str
    size: float
    """R.m.s. of the force that it stands for, as a share of peak."""
    probability: float
    """That chance alone makes a trend like it, all pairs that were looked at allowed for."""

    def __str__(self) -> str:
        """The trend in words."""
        return (
            f"the {self.own} that each test is allowed follows its {self.follows} ({100.0 * self.size:.2g} % of peak, "
            f"probability by chance {max(self.probability, 1e-300):.1g}), which no chance of single tests does"
        )


def trend_of_tests(campaign: Campaign, damper: Damper, config: DiagnoseConfig) -> Trend | None:
    """The surest trend of the tests' own gains, offsets and delays over their motion; None where chance explains all.

    Equation: t = b / sqrt(sum e^2 / (n - g - 1) / sum x^2), y = b x + e about the means in each of g conditions
                                                            Source: least squares; Bonferroni over the pairs

    Parameters
    ----------
    campaign : the tests
    damper : what they are compared with
    config : how small a probability is believed, and what is visible
    """
    checks = [c for c in campaign.checks(damper) if c.prepared.constant and c.wanted.any()]
    if not checks:
        return None
    condition = np.array([nearest_row(damper.base, c.prepared) for c in checks])
    own, sizes = _own(checks)
    pairs = [
        (name, follows, _regressed(own[:, i], over, condition), sizes[i])
        for i, name in enumerate(OWN)
        for follows, over in _motions(checks)
    ]
    found = [
        Trend(name, follows, regressed[0] * size, min(1.0, len(pairs) * regressed[1]))
        for name, follows, regressed, size in pairs
        if regressed is not None
    ]
    believed = [t for t in found if t.probability < config.significance and t.size >= CONTRADICTS * config.visible]
    return min(believed, key=lambda t: t.probability, default=None)


def _own(checks: Sequence[ResidualCheck]) -> tuple[Array, Array]:
    """(n, 3) offset, gain and delay of every test in `UNIT`, and (3,) what one of each makes of the force [peak]."""
    found, size = [], []
    for check in checks:
        force = check.predicted[check.wanted]
        columns = nuisance_columns(force, check.prepared.record.rate, UNIT, check.wanted)
        found.append(np.linalg.lstsq(columns, check.residual[check.wanted], rcond=None)[0])
        size.append(np.sqrt(np.mean(columns**2, axis=0)) / check.peak)
    return np.array(found).reshape(-1, 3), np.mean(np.array(size).reshape(-1, 3), axis=0)


def _motions(checks: Sequence[ResidualCheck]) -> Iterator[tuple[str, Array]]:
    """By name, what the tests differ in (n,); NaN where a test has none."""
    records = [c.prepared.record for c in checks]
    cycles = [c.prepared.cycles for c in checks]
    yield "frequency", np.log([np.nan if run is None else run.frequency for run in cycles])
    yield "speed", np.log([rms(r.velocity) for r in records])
    yield "stroke", np.log([float(np.ptp(r.displacement)) for r in records])
    warmth = [r.median_temperature() for r in records]
    yield "temperature", np.array([np.nan if t is None else t for t in warmth])


def _regressed(values: Array, over: Array, condition: NDArray[np.int64]) -> tuple[float, float] | None:
    """R.m.s. of what follows a quantity within conditions, and its probability by chance; None with too few tests."""
    from scipy.special import stdtr

    known = np.isfinite(over)
    y, x, condition = values[known], over[known], condition[known]
    free = y.size - np.unique(condition).size - 1
    if free < FEWEST_FOR_A_TREND:
        return None
    for each in np.unique(condition):
        inside = condition == each
        y[inside] -= y[inside].mean()
        x[inside] -= x[inside].mean()
    if np.ptp(x) <= SAME * max(1.0, float(np.max(np.abs(over[known])))):
        return None
    slope = float(x @ y / (x @ x))
    left = float(np.sum((y - slope * x) ** 2)) / free
    size = abs(slope) * rms(x)
    if left <= 0.0:
        return size, 0.0 if slope else 1.0
    return size, float(2.0 * stdtr(free, -abs(slope) * np.sqrt(float(x @ x) / left)))


# ----------------------------------------------------------------------------------------------------


Verdict = Literal["named", "ambiguous", "none", "unexplained"]

NOT_SEARCHED = "promises too little to be searched for"
"""The reason of a candidate whose figures are those of a trace of it, see `candidates.candidates`."""


@dataclass(frozen=True)
class Decision:
    """What is said, why, and how sure it is."""

    verdict: Verdict
    reason: str
    confidence: float | None
    possible: tuple[str, ...] = ()
    """Effects that may be missing beside those adopted."""
    doubtful: bool = False
    """Whether so much is not excluded that one more test is worth its time."""


def weak(hold_out: str) -> str:
    """What to add where the held-out data come from tests that were also fitted."""
    if hold_out == "records":
        return ""
    parts = {"mixed": "some whole tests, and parts"}.get(hold_out, hold_out)
    return f"; held out were {parts} of tests that were also fitted, which is weak evidence"


def unpredicted(prediction: Prediction | None) -> str:
    """What to add where no test could be kept back."""
    return "" if prediction else "; there is too little to keep a test back, so that nothing shows what this predicts"


def refused(reason: str) -> Decision:
    """The verdict where what fits the tests does not predict others: something is missing, and it has no name."""
    return Decision("unexplained", reason, None)


def unless_systematic(decision: Decision, trend: Trend | None) -> Decision:
    """The decision where the tests' own gains, offsets and delays are chance; `unexplained` where they are not."""
    return decision if trend is None else Decision("unexplained", f"{decision.reason}; but {trend}", None)


def with_added(decision: Decision, added: Sequence[str]) -> Decision:
    """The decision beside effects that were added for what they predict alone: they explain nothing by themselves."""
    if not added:
        return decision
    names, stands = " and ".join(added), "it stands" if len(added) == 1 else "they stand"
    words = f"kept-back tests are predicted better with {names}, whatever {stands} for"
    return replace(decision, reason=f"{decision.reason}; {words}")


def decide(selection: Selection, config: DiagnoseConfig) -> Decision:
    """The verdict on what was adopted, from what is left of the gap.

    Parameters
    ----------
    selection : what was adopted
    config : thresholds
    """
    checks = selection.first.campaign.checks
    before = checks(selection.plain.damper)
    after = checks(selection.fitted.damper) if selection.adopted else before
    sizes = visible_gap(before), visible_gap(after)
    chances = probability_of_noise(before), probability_of_noise(after)
    if not selection.adopted:
        return _nothing_adopted(sizes[0], chances[0], selection, config)
    change = f"{' and '.join(selection.adopted)}: {_change(selection, sizes, config)}"
    if chances[1] < config.significance and _remains(sizes, config):
        words = f"{change}, and what is left repeats (probability by noise alone {max(chances[1], 1e-300):.1g})"
        return Decision("unexplained", words, None)
    odd = against_nature(selection.fitted.damper)
    if odd and not selection.rivals:
        words = (
            f"{change}; but with a value that no {' and no '.join(odd)} has, so that it is something that looks alike"
        )
        return Decision("unexplained", words, None)
    better = [f for f in selection.competitions if f.behind < -config.rival_bic]
    if better:
        others = [f"{known()[f.form].law}, which is not in the library, does better than {f.effect}" for f in better]
        return Decision("unexplained", f"{change}; but {' and '.join(others)}", None)
    return _explained(change, selection, config)


def _explained(change: str, selection: Selection, config: DiagnoseConfig) -> Decision:
    """The verdict where what was adopted explains the gap: whether something else does, or is likely beside it."""
    sure = confidence_of(selection, config)
    if selection.rivals or selection.competitions:
        others = [*selection.rivals, *(f"{known()[f.form].law} (not in the library)" for f in selection.competitions)]
        return Decision("ambiguous", f"{change}; {', '.join(others)} would do as well on these tests", sure)
    if possible := _possible(selection, config):
        words = f"{change}{_not_excluded(selection, config)} beside it"
        return Decision("ambiguous", words, confidence_of(selection, config, possible), possible, doubtful=True)
    doubt = _not_excluded(selection, config) if sure < DOUBTFUL_BELOW else ""
    words = f"{change}; what is left is within the noise or negligible{doubt}"
    return Decision("named", words, sure, doubtful=bool(doubt))


def _change(selection: Selection, sizes: tuple[float, float], config: DiagnoseConfig) -> str:
    """What the adopted effects change: the gap, or where noise hid that, the force in their own direction."""
    if sizes[0] >= config.negligible:
        return f"the gap falls from {_percent(sizes[0])} to {_percent(sizes[1])} of peak"
    moved = moved_by(selection.last.whole, selection.plain, selection.fitted)
    return (
        f"moves the force by {_percent(moved)} of peak, more than noise does in just that way, "
        f"though the gap as a whole ({_percent(sizes[0])} of peak above the noise) does not stand out of it"
    )


def _remains(sizes: tuple[float, float], config: DiagnoseConfig) -> bool:
    """Whether too much of the gap is left, as r.m.s. with the noise floor taken off: as a share, or plain to see."""
    share = sizes[1] > config.unexplained_share * sizes[0] and sizes[1] >= config.negligible
    return share or sizes[1] >= CONTRADICTS * config.visible


def _nothing_adopted(size: float, chance: float, selection: Selection, config: DiagnoseConfig) -> Decision:
    sure = confidence_of(selection, config)
    gap = f"a gap of {_percent(size)} of peak force (r.m.s. above the noise)"
    if chance < config.significance and size >= config.visible:
        alone = f"probability by noise alone {max(chance, 1e-300):.1g}"
        return Decision("unexplained", f"{gap} that repeats ({alone}); no effect of the library fits", None)
    possible = tuple(dict.fromkeys((*selection.undecided, *_possible(selection, config))))
    if possible:
        told = "; ".join(f"{name} {selection.reasons[name]}" for name in selection.undecided)
        words = told or f"{gap}{_not_excluded(selection, config)}"
        sure = confidence_of(selection, config, possible)
        return Decision("ambiguous", f"{words}; more tests would settle it", sure, possible, doubtful=True)
    if chance >= config.significance:
        words = f"{gap} that noise alone shows with probability {chance:.2g}: within the noise"
    else:
        words = f"{gap}, repeatable but smaller than {_percent(config.visible)} of peak: counts as nothing missing"
    doubtful = sure < DOUBTFUL_BELOW
    return Decision("none", words + (_not_excluded(selection, config) if doubtful else ""), sure, doubtful=doubtful)


def _possible(selection: Selection, config: DiagnoseConfig) -> tuple[str, ...]:
    """What the tests do not exclude beside what is said, where it is likelier than that.

    An offset, a delay or a lag may be each test's own: whether these are open is told by their size, see `trivial`.
    """
    if confidence_of(selection, config, OF_EACH_TEST) >= LIKELIER_THAN_NOT:
        return ()
    return tuple(name for name in not_excluded(selection, config) if name not in OF_EACH_TEST)


def _not_excluded(selection: Selection, config: DiagnoseConfig) -> str:
    """What to add of effects that the tests do not exclude."""
    likely = [f"{name} ({told.interval})" for name, told in not_excluded(selection, config).items()]
    return f"; these tests do not exclude {' or '.join(likely)}" if likely else ""


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %"


def ranking_of(selection: Selection, evidence: Evidence) -> tuple[Ranked, ...]:
    """Every candidate in the round that decided on it, best first; what was adopted leads.

    `gap_after` is criterion (4) on the samples seen, the tests' nuisances left in.
    """
    rows: dict[str, Ranked] = {}
    for step in selection.rounds:
        for c in step.tried:
            if step.tried is not selection.deciding(c.effect):
                continue
            reason = "does not pay" if c.delta_bic > 0.0 else "explains less"
            reason = selection.reasons.get(c.effect, reason if c.searched else NOT_SEARCHED)
            rows[c.effect] = Ranked(
                effect=c.effect,
                gap_after=evidence.criterion(c.fitted),
                delta_bic=round(c.delta_bic, 3),
                **_as_fitted(selection.fitted.damper if c.effect in selection.adopted else c.fitted.damper, c.effect),
                reason="rival" if c.effect in selection.rivals else reason,
            )
    return tuple(sorted(rows.values(), key=lambda r: (r.effect not in selection.adopted, r.delta_bic)))


def parameters_of(selection: Selection, control: Control) -> dict[str, dict[str, Value]]:
    """The parameters of what was adopted, with 95 % intervals, in units of this control signal."""
    damper, errors = selection.fitted.damper, standard_errors(selection.fitted)
    found: dict[str, dict[str, Value]] = {}
    for name, values in damper.effects.items():
        nodes = values.get("at_voltage_V")
        for parameter in library()[name].parameters:
            mine = [
                (u.of(damper), float(error))
                for u, error in zip(selection.fitted.unknowns, errors, strict=True)
                if (u.effect, u.parameter.name) == (name, parameter.name)
            ]
            found.setdefault(name, {})[parameter.name] = _value(mine, parameter, nodes, control)
    return found


def _value(
    found: Sequence[tuple[float, float]],
    parameter: Parameter,
    nodes: float | tuple[float, ...] | None,
    control: Control,
) -> Value:
    """A parameter with its 95 % interval inside its limits, one a voltage where it differs by voltage.

    Parameters
    ----------
    found : value and standard error, one a voltage or a single one
    parameter : its unit and limits
    nodes : the voltages [V]; None for a single value
    control : whose unit stands in the place of V
    """
    unit = control.own_unit(parameter.unit)
    middle = tuple(value for value, _ in found)
    low = tuple(max(value - LEVEL * error, parameter.low) for value, error in found)
    high = tuple(min(value + LEVEL * error, parameter.high) for value, error in found)
    if not isinstance(nodes, tuple):
        return Value(value=middle[0], low95=low[0], high95=high[0], unit=unit)
    return Value(value=middle, low95=low, high95=high, unit=unit, at_voltage_V=nodes)


def _as_fitted(damper: Damper, effect: str) -> dict[str, Any]:
    """Parameters of an effect as a ranking shows them: the voltages beside them, not among them."""
    values = dict(damper.effects[effect])
    nodes = values.pop("at_voltage_V", None)
    return {"parameters": values, "at_voltage_V": nodes}


# ----------------------------------------------------------------------------------------------------
# From the effects selected to the damper handed on and the verdict: no harm, no name for what only seems to be one.


def concluded(selection: Selection, trials: Trials, config: DiagnoseConfig, unit: str) -> tuple[HandedOn, Decision]:
    """What is handed on of the selected effects, and the verdict.

    Parameters
    ----------
    selection : what was adopted
    trials : the tests, dealt into folds
    config : thresholds, forced and forbidden effects
    unit : of the control signal, for the words
    """
    handed = handed_on(selection, trials, config.force, unit)
    decision = refused(handed.refused) if handed.refused else decide(handed.selection, config)
    if decision.verdict != "unexplained":
        found = handed.selection.fitted.damper
        decision = unless_systematic(decision, trend_of_tests(selection.first.campaign, found, config))
    if decision.verdict == "unexplained":
        handed = with_additions(handed, trials, config)
        decision = with_added(decision, handed.added)
    return handed, decision
