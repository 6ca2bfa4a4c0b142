"""A diagnosis as about ten lines of text."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.artefacts import Diagnosis, Hypotheses, HypothesisRow, KeptBack, NextTest, Prediction, Value
from pzd.cli.layout import interval, number
from pzd.quantities import Control
from pzd.schema.wording import counted

_VERDICTS = {
    "named": "one answer fits, and no other does",
    "ambiguous": "several answers fit the data",
    "none": "nothing is missing that the data can show",
    "unexplained": "a gap that repeats remains, and no name accounts for it",
}
_MOST = 3
"""How many places and candidates are listed."""
_MOST_SHAPES = 2
"""How many shapes of what is left, each by itself."""
NONE_SOUGHT = Hypotheses()


def diagnosis_lines(
    diagnosis: Diagnosis, control: Control, *, every_test: bool = False, hypotheses: Hypotheses = NONE_SOUGHT
) -> list[str]:
    """The lines: what is missing, where, how sure that is, how far it closes the gap, and what to test next.

    Parameters
    ----------
    diagnosis : the artefact of diagnose
    control : the control signal, for its unit
    every_test : whether the prediction of each kept-back test and each voltage left out is listed too
    hypotheses : which shape what is left has
    """
    unit = control.unit
    lines = [
        f"verdict: {diagnosis.verdict}, {_VERDICTS[diagnosis.verdict]}",
        f"reason: {diagnosis.reason}",
        _gap(diagnosis),
    ]
    if diagnosis.prediction:
        lines += _prediction(diagnosis.prediction, unit, every_test=every_test)
    lines += [f"where: {where.region}, {where.share_of_gap:.0%} of the gap" for where in diagnosis.where[:_MOST]]
    lines += [f"adopted: {name}, {_parameters(diagnosis, name, unit)}" for name in diagnosis.effects]
    if diagnosis.confidence is not None:
        lines.append(f"confidence: {diagnosis.confidence:.0%}{_confident_of(diagnosis)}")
    if diagnosis.rivals:
        lines.append(f"rivals: {', '.join(diagnosis.rivals)}")
    lines += [*_rejected(diagnosis), *_hypotheses(hypotheses)]
    if diagnosis.next_test:
        lines.append(_next(diagnosis.next_test, unit))
    return lines


def _confident_of(diagnosis: Diagnosis) -> str:
    """What the confidence of an open verdict is in."""
    if diagnosis.verdict != "ambiguous":
        return ""
    named = [*diagnosis.effects, *diagnosis.rivals] + ["nothing"] * (not diagnosis.effects)
    return f" that it is {' or '.join(named)}" if len(named) > 1 else ""


def _gap(diagnosis: Diagnosis) -> str:
    gap = diagnosis.gap
    if gap is None:
        return "gap: could not be measured"
    share = f", {1.0 - gap.after / gap.before:.0%} less" if gap.after < gap.before else ""
    records = counted(len(gap.held_out), "record")
    held = {"records": records, "mixed": f"{records}, whole or in part"}.get(
        gap.hold_out, f"{gap.hold_out} of {records}"
    )
    return (
        f"gap on what no fit has seen ({held}): W_s {number(gap.before)} before, {number(gap.after)} after{share}; "
        f"noise alone gives {number(gap.noise_floor)}"
    )


def _prediction(found: Prediction, unit: str, *, every_test: bool) -> Iterator[str]:
    kept_back = {"tests": "whole tests", "mixed": "whole tests, or halves"}.get(found.hold_out, f"{found.hold_out}")
    yield f"prediction of {kept_back} kept back: W_s {number(found.W_s_plain)} plain, {number(found.W_s)} as handed on"
    if every_test:
        for each in found.by:
            at = "" if each.voltage is None else f" at {number(each.voltage)} {unit}"
            figures = f"W_s {number(each.W_s_plain)} plain, {number(each.W_s)} as handed on"
            yield f"kept back: {each.record}{at}, {figures}{_explained(each)}"
    listed = sorted(found.left_out_voltages, key=lambda left: -left.W_s)
    for left in listed if every_test else listed[:1]:
        figures = f"W_s {number(left.W_s_plain)} plain, {number(left.W_s)} as handed on"
        yield f"left out: {number(left.voltage)} {unit}, predicted from its neighbours with {figures}"


def _explained(each: KeptBack) -> str:
    """R2 of one test; nothing where an earlier version wrote the file."""
    return "" if each.R2 is None or each.R2_plain is None else f"; R2 {each.R2_plain:.4f} and {each.R2:.4f}"


def _parameters(diagnosis: Diagnosis, effect: str, unit: str) -> str:
    values = diagnosis.parameters.get(effect, {})
    text = ", ".join(f"{name} = {_value(value, unit)}" for name, value in values.items())
    return f"{text} to either side of x = {diagnosis.zero_m:.4g} m" if effect == "end_stop" else text


def _value(value: Value, unit: str) -> str:
    if isinstance(value.value, tuple):
        places = zip(value.value, value.at_voltage_V or (), strict=False)
        return "; ".join(
            f"{number(one)} {value.unit} at {number(voltage)} {unit}" for one, voltage in places
        ) + _by_hand(value)
    low = None if isinstance(value.low95, tuple) else value.low95
    high = None if isinstance(value.high95, tuple) else value.high95
    return f"{interval(value.value, low, high)} {value.unit}{_by_hand(value)}"


def _by_hand(value: Value) -> str:
    """Said of what nobody fitted."""
    return " (edited by hand)" if value.low95 is None and value.high95 is None else ""


def _rejected(diagnosis: Diagnosis) -> Iterator[str]:
    listed = {*diagnosis.effects, *diagnosis.rivals}
    others = [one for one in diagnosis.ranking if one.effect not in listed]
    adopted = {one.effect: one.gap_after for one in diagnosis.ranking if one.effect in diagnosis.effects}
    # What was added for its prediction alone was in no round of the search: then no figure there is the damper's.
    whole = adopted.keys() == {*diagnosis.effects}
    against = f" against {number(min(adopted.values()))}" if adopted and whole else ""
    for one in others[:_MOST]:
        yield f"not taken: {one.effect}, W_s {number(one.gap_after)}{against} on the tests seen, {one.reason}"


def _hypotheses(found: Hypotheses) -> Iterator[str]:
    """The best shapes of what is left, and what stands beside the best; nothing where none was looked for."""
    if found.sought and not found.rows:
        yield "hypothesis: none, no shape of what is left predicts tests kept back beyond two standard errors"
    for row in found.alone[:_MOST_SHAPES]:
        yield f"{'hypothesis' if row.place == 1 else 'or'}: {hypothesis(row)}; {row.physics}{of_library(row)}"
    for row in found.together:
        yield f"and beside {row.beside}: {hypothesis(row)} together; {row.physics}{of_library(row)}"


def hypothesis(row: HypothesisRow) -> str:
    """A shape with its coefficient, and what it would close."""
    more = f" and {number(row.second_coefficient)} with the cosine" if row.second_coefficient is not None else ""
    value = interval(row.coefficient, row.coefficient_low95, row.coefficient_high95)
    at = f", {row.parameter} = {number(row.parameter_value)} {row.parameter_unit}" if row.parameter else ""
    closes = f"would close {row.closes:.0%} of the gap on tests kept back"
    return f"c {row.shape}, c = {value}{more} {row.unit}{at}: {closes}"


def of_library(row: HypothesisRow) -> str:
    """Which effect of the library has the shape; empty where none has."""
    return f" ({row.library} has this shape)" if row.library else ""


def _next(test: NextTest, unit: str) -> str:
    voltages = test.voltage_V if isinstance(test.voltage_V, tuple) else (test.voltage_V,)
    parts = [
        test.waveform,
        f"{number(test.frequency_Hz)} Hz" if test.frequency_Hz is not None else "",
        f"{number(test.amplitude_m)} m" if test.amplitude_m is not None else "",
        f"about {test.middle_m:.6g} m" if test.middle_m is not None else "",
        f"at {' and '.join(f'{number(v)} {unit}' for v in voltages)}" if voltages != (None,) else "",
    ]
    reached = [
        f"{number(value)} {of}"
        for value, of in ((test.peak_speed_m_per_s, "m/s"), (test.peak_force_N, "N"))
        if value is not None
    ]
    far = f", up to {' and '.join(reached)}" if reached else ""
    aim = f" to tell {' from '.join(test.separates)}" if test.separates else ""
    if test.between_voltage_V is not None:
        low, high = (number(voltage) for voltage in test.between_voltage_V)
        aim = f", since between {low} and {high} {unit} the force is known least"
    return f"next test: {' '.join(part for part in parts if part)}{far}{aim}"
