"""The diagnosis as about ten lines of text, for the terminal and a notebook."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from pzd.schema.errors import counted

if TYPE_CHECKING:
    from pzd.artefacts import (
        Diagnosis,
        Gap,
        HeldOutTest,
        HeldOutVoltage,
        Hypotheses,
        HypothesisRow,
        NextTest,
        Prediction,
        Value,
    )
    from pzd.quantities import Control

_VERDICTS = {
    "named": "one answer fits, and no other does",
    "ambiguous": "several answers fit the data",
    "none": "nothing is missing that the data can show",
    "unexplained": "a gap that repeats remains, and no name accounts for it",
}
_DOUBTFUL = {
    "named": "one answer fits, and these tests do not exclude something beside it",
    "none": "nothing stands out of the noise, and these tests do not exclude that something is missing",
}
"""The same where the confidence says so."""
UNNAMED_FORCE = "count noise and how the tests differ; what has no name may move the values by more"
"""What the intervals of adopted effects leave out where the verdict is `unexplained`."""
_MOST = 3
"""How many regions and candidates are listed."""
_MOST_SHAPES = 2
"""How many shapes of the residual force, each by itself."""
_LEAST_SHARE = 0.02
"""Share of the gap from which an effect stands in the headline: of a hundredth rounding makes something or nothing."""
_NOTHING_LEFT = "nothing visible is left, but what closes the gap may be something else"
"""What stands in the place of what is left where that is not visible, and the verdict is `unexplained` all the same."""

_LEAST_OWN = 0.1
"""Share of the noise floor that the tests' own zero, gain and delay take from which they stand beside the noise: in
r.m.s., as the headline has it, less is a twentieth."""


def shown(value: float | None, unit: str = "") -> str:
    """Return a number with its unit as tables of the terminal have it."""
    from pzd.report.columns import TERMINAL  # here, since `pzd --help` needs neither tables nor numpy

    return TERMINAL.amount(value, unit)


def diagnosis_lines(
    diagnosis: Diagnosis, control: Control, *, every_test: bool = False, hypotheses: Hypotheses | None = None
) -> list[str]:
    """Return what is missing, where, how sure that is, how far it closes the gap, and what to test next.

    Parameters
    ----------
    diagnosis : the artefact of diagnose
    control : the control signal, for its name and unit
    every_test : whether the prediction of each held-out test and voltage is listed too
    hypotheses : shapes of the residual force, if any were looked for
    """
    unit = control.unit
    lines = [
        f"verdict: {diagnosis.verdict}, {headline(diagnosis)}",
        f"reason: {diagnosis.reason}",
        _gap(diagnosis),
    ]
    if diagnosis.prediction:
        lines += _prediction(diagnosis.prediction, unit, every_test=every_test)
    lines += [f"where: {where.region}, {where.share_of_gap:.0%} of the gap" for where in diagnosis.where[:_MOST]]
    lines += [
        f"adopted: {name}, {_parameters(diagnosis, name, unit)}{_known_of(diagnosis, name)}"
        for name in diagnosis.effects
    ]
    if diagnosis.effects and diagnosis.verdict == "unexplained":
        lines.append(f"intervals: these {UNNAMED_FORCE}")
    if diagnosis.confidence is not None:
        lines.append(f"confidence: {diagnosis.confidence:.0%}{_open_names(diagnosis)}")
    if diagnosis.rivals:
        lines.append(f"rivals: {', '.join(diagnosis.rivals)}")
    lines += [*_rejected(diagnosis), *(_hypotheses(hypotheses) if hypotheses else ())]
    if diagnosis.next_test:
        lines.append(next_test_line(diagnosis.next_test, unit))
    return [control.told(line) for line in lines]


def headline(diagnosis: Diagnosis) -> str:
    """Return the verdict in words: what is known of the parts first where the whole is unexplained."""
    from pzd.signals.measures import VISIBLE  # here, since `pzd --help` needs no numpy

    supported = [
        (name.replace("_", " "), each, f"({each.share:.0%} of the gap comes back without it)")
        for name, each in sorted(diagnosis.support.items(), key=lambda item: -item[1].share)
        if (_confident(each.confidence) if each.added else each.sure != "open") and each.share >= _LEAST_SHARE
    ]
    known = ", ".join(f"{name} is {each.sure} {share}" for name, each, share in supported if not each.added)
    useful = [f"{name} {share}" for name, each, share in supported if each.added]
    if diagnosis.verdict in _DOUBTFUL and diagnosis.confidence is not None and not _confident(diagnosis.confidence):
        return _DOUBTFUL[diagnosis.verdict]
    if diagnosis.verdict != "unexplained" or not supported or diagnosis.left_of_peak is None:
        return _VERDICTS[diagnosis.verdict]
    predict = "predicts, whatever it stands for" if len(useful) == 1 else "predict, whatever they stand for"
    words = [known] if known else []
    words += [f"{' and '.join(useful)} {predict}"] if useful else []
    left = f"{100.0 * diagnosis.left_of_peak:.2g} % of peak has no name"
    return f"but {'; '.join(words)}; {left if diagnosis.left_of_peak >= VISIBLE else _NOTHING_LEFT}"


def _known_of(diagnosis: Diagnosis, effect: str) -> str:
    """Return how sure an adopted effect is where the whole is unexplained, as words behind it."""
    if diagnosis.verdict != "unexplained" or effect not in diagnosis.support:
        return ""
    support = diagnosis.support[effect]
    if support.added:
        return "; for the prediction, whatever it stands for"
    return "; what it stands for is open" if support.sure == "open" else f"; {support.sure}"


def _confident(confidence: float | None) -> bool:
    """Whether a confidence was stated, and leaves no doubt of the verdict or the prediction that it is of."""
    from pzd.diagnosis.thresholds import DOUBTFUL_BELOW

    return confidence is not None and confidence >= DOUBTFUL_BELOW


def _open_names(diagnosis: Diagnosis) -> str:
    """Return the answers that the confidence of an ambiguous verdict is about: all that was adopted, or a rival."""
    if diagnosis.verdict != "ambiguous" or not diagnosis.rivals:
        return ""
    if not diagnosis.effects:
        return f" that it is nothing or {' or '.join(diagnosis.rivals)}"
    return f" that it is {' or '.join([*diagnosis.effects, *diagnosis.rivals])}, alone or together"


def _gap(diagnosis: Diagnosis) -> str:
    gap = diagnosis.gap
    if gap is None:
        return f"gap: {no_gap(diagnosis)}"
    share = f", {1.0 - gap.after / gap.before:.0%} less" if gap.after < gap.before else ""
    records = counted(len(gap.held_out), "record")
    held_out = {"records": records, "mixed": f"{records}, whole or in part"}.get(
        gap.hold_out, f"{gap.hold_out} of {records}"
    )
    return (
        f"gap on what no fit has seen ({held_out}): W_s {shown(gap.before)} before, {shown(gap.after)} after"
        f"{share}; {noise_named(gap)} gives {shown(gap.noise_floor)}"
    )


def no_gap(diagnosis: Diagnosis) -> str:
    """Return why there is no gap, as words behind it."""
    return "not computed, for the knee law misses nothing visible" if diagnosis.by_knee_law else "could not be measured"


def noise_named(gap: Gap) -> str:
    """Return what the noise floor of a gap stands for: noise, and what tests do by themselves where that is visible."""
    own = gap.tests_own > _LEAST_OWN * gap.noise_floor
    return "noise with the zero, gain and delay that each test may have" if own else "noise alone"


def _prediction(found: Prediction, unit: str, *, every_test: bool) -> Iterator[str]:
    def errors(each: Prediction | HeldOutTest | HeldOutVoltage) -> str:
        return f"W_s {shown(each.W_s_plain)} plain, {shown(each.W_s)} as handed on"

    held_out = {"tests": "whole tests", "mixed": "whole tests, or halves"}.get(found.hold_out, f"{found.hold_out}")
    yield f"prediction of {held_out} kept back: {errors(found)}"
    if every_test:
        for each in found.by:
            at = "" if each.voltage is None else f" at {shown(each.voltage, unit)}"
            # An earlier version wrote no R2.
            R2 = "" if each.R2 is None or each.R2_plain is None else f"; R2 {each.R2_plain:.4f} and {each.R2:.4f}"
            yield f"kept back: {each.record}{at}, {errors(each)}{R2}"
    listed = sorted(found.left_out_voltages, key=lambda left: -left.W_s)
    for left in listed if every_test else listed[:1]:
        yield f"left out: {shown(left.voltage, unit)}, predicted from its neighbours with {errors(left)}"
    levels = sorted({test.voltage for test in found.by if test.voltage is not None})
    if len(levels) == 2 and all(test.voltage is not None for test in found.by):
        low, high = (shown(level) for level in levels)
        yield f"between {low} and {high} {unit}: taken on a line, for no third level was tested that would show it"


def counted_from(diagnosis: Diagnosis, effect: str, name: str, place: str) -> str:
    """Return from which displacement a parameter is counted, as words behind it; empty where it is no place.

    Parameters
    ----------
    diagnosis : that adopted the effect
    effect, name : of the parameter
    place : the displacement `Diagnosis.zero_m`, with its unit
    """
    from pzd.damper.effects import library

    found = library().get(effect)
    words = next((p.position for p in found.parameters if p.name == name), "") if found else ""
    # An end stop stands at both ends: from where it is counted is said also where that is 0.
    return f" {words} x = {place}" if words and (diagnosis.zero_m or effect == "end_stop") else ""


def _parameters(diagnosis: Diagnosis, effect: str, unit: str) -> str:
    zero = f"{diagnosis.zero_m:.4g} m"
    values = diagnosis.parameters.get(effect, {})
    return ", ".join(
        f"{name} = {_value(value, unit)}{counted_from(diagnosis, effect, name, zero)}" for name, value in values.items()
    )


def _value(value: Value, unit: str) -> str:
    """Return a parameter with its interval, or one value for each control value."""
    from pzd.report.columns import TERMINAL

    edited = " (edited by hand)" if value.low95 is None and value.high95 is None else ""
    if value.at_voltage_V is not None:
        pairs = zip(value.estimates, value.at_voltage_V, strict=True)
        return "; ".join(f"{shown(one.value, value.unit)} at {shown(at, unit)}" for one, at in pairs) + edited
    (estimate,) = value.estimates
    if estimate.interval is None:
        return f"{shown(estimate.value, value.unit)}{edited}"
    return f"{TERMINAL.text(estimate, value.unit)}{edited}"


def _rejected(diagnosis: Diagnosis) -> Iterator[str]:
    listed = {*diagnosis.effects, *diagnosis.rivals}
    others = [one for one in diagnosis.ranking if one.effect not in listed]
    adopted = {one.effect: one.gap_after for one in diagnosis.ranking if one.effect in diagnosis.effects}
    # What was added for its prediction alone was in no round of the search: then no figure there is the damper's.
    whole = adopted.keys() == {*diagnosis.effects}
    against = f" against {shown(min(adopted.values()))}" if adopted and whole else ""
    for one in others[:_MOST]:
        yield f"not taken: {one.effect}, W_s {shown(one.gap_after)}{against} on the tests seen, {one.reason}"


def _hypotheses(found: Hypotheses) -> Iterator[str]:
    """Yield the best shapes of the residual force, and those beside the best; nothing where none was looked for."""
    if found.sought and not found.rows:
        yield "hypothesis: none, no shape of what is left predicts tests kept back beyond two standard errors"
    for row in found.alone[:_MOST_SHAPES]:
        yield f"{'hypothesis' if row.place == 1 else 'or'}: {_shape(row)}; {_physics(row)}"
    for row in found.together:
        yield f"and beside {row.beside}: {_shape(row)} together; {_physics(row)}"


def _shape(row: HypothesisRow) -> str:
    """Return a shape with its coefficient, and the share of the gap that it would close."""
    from pzd.artefacts.csv_rows import Estimate
    from pzd.report.columns import TERMINAL

    more = f" and {shown(row.second_coefficient)} with the cosine" if row.second_coefficient is not None else ""
    value = TERMINAL.interval(Estimate.of(row, "coefficient"))
    at = f", {row.parameter} = {shown(row.parameter_value, row.parameter_unit or '')}" if row.parameter else ""
    closes = f"would close {row.closes:.0%} of the gap on tests kept back"
    unit = "" if row.unit == "-" else f" {row.unit}"
    return f"c {row.shape}, c = {value}{more}{unit}{at}: {closes}"


def _physics(row: HypothesisRow) -> str:
    """Return what has the shape, and which effect of the library, if any."""
    return f"{row.physics} ({row.library} has this shape)" if row.library else row.physics


def next_test_line(test: NextTest, unit: str) -> str:
    """Return a proposed test as a line of the terminal."""
    voltages = test.voltage_V if isinstance(test.voltage_V, tuple) else (test.voltage_V,)
    parts = [
        test.waveform,
        shown(test.frequency_Hz, "Hz") if test.frequency_Hz is not None else "",
        shown(test.amplitude_m, "m") if test.amplitude_m is not None else "",
        f"about {test.middle_m:.6g} m" if test.middle_m is not None else "",
        f"at {' and '.join(shown(v, unit) for v in voltages)}" if voltages != (None,) else "",
    ]
    peaks = ((test.peak_speed_m_per_s, "m/s"), (test.peak_force_N, "N"))
    reached = [shown(value, of) for value, of in peaks if value is not None]
    far = f", up to {' and '.join(reached)}" if reached else ""
    names = [name for name in test.separates if name != "nothing"]
    aim = f" to tell {' from '.join(names)}" if names else " to settle what these tests leave open"
    if len(names) == 1 or len(names) < len(test.separates):
        aim = f" to tell whether it is {' or '.join(names)}"
    if test.between_voltage_V is not None:
        low, high = (shown(voltage) for voltage in test.between_voltage_V)
        aim = f", since between {low} and {high} {unit} the force is known least"
    return f"next test: {' '.join(part for part in parts if part)}{far}{aim}"
