"""The verdict: named, ambiguous, none or unexplained, its reason, and how sure it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from pzd.artefacts import Prediction, Ranked, Value
from pzd.damper.competing_forms import known
from pzd.damper.effect import Parameter
from pzd.damper.effects import library
from pzd.damper.model import Damper
from pzd.damper.nature import against_nature
from pzd.diagnose.confidence import confidence_of, not_excluded
from pzd.diagnose.config import DiagnoseConfig
from pzd.diagnose.fit.intervals import LEVEL, standard_errors
from pzd.diagnose.gap import probability_of_noise, visible_gap
from pzd.diagnose.search.candidates import moved_by
from pzd.diagnose.search.evidence import Evidence
from pzd.diagnose.search.selection import Selection
from pzd.diagnose.thresholds import CONTRADICTS, DOUBTFUL_BELOW, LIKELIER_THAN_NOT, OF_EACH_TEST
from pzd.diagnose.trends_of_tests import Trend
from pzd.quantities import Control

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
