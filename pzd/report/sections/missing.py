"""What is missing from the simple model, how sure that is, and what would settle it."""

from __future__ import annotations

from pzd.artefacts import Diagnosis, Gap, Hypotheses, HypothesisRow, NextTest, Prediction, Ranked, Value
from pzd.damper.confounders import known
from pzd.quantities import Control
from pzd.report.blocks import (
    DASH,
    Block,
    Notes,
    Paragraph,
    Pictures,
    Section,
    TextTable,
    amount,
    galleries,
    interval,
    listed,
    number,
    percent,
    sentence,
    unit_of,
)
from pzd.report.context import ReportContext
from pzd.report.damper_models import effect_in_words, effects_in_words

# ----------------------------------------------------------------------------------------------------
# Where the simple model fails: measured against simulated, and where the gap lies.


def render_simple_model(context: ReportContext, pictures: Pictures) -> Section:
    """The second section."""
    element = (
        "The knee law has dry friction T0, and bleed, knee and blow-off of each direction"
        if context.damper.fitted_law
        else "The simple model is the Bingham element of the paper: dry friction T0 and viscous damping C"
    )
    text = f"{element} in series with the oil spring k. {_gap(context.diagnosed.diagnosis.gap)}"
    blocks: list[Block] = [Paragraph(text), *galleries(pictures["model"])]
    where = context.diagnosed.diagnosis.where
    if where:
        rows = tuple((region.region, percent(region.share_of_gap)) for region in where)
        blocks.append(TextTable("Where the gap lies", ("region", "share of the gap"), rows))
    return Section("model", f"Where the {context.damper.baseline_name} fails", tuple(blocks))


def _gap(gap: Gap | None) -> str:
    if gap is None:
        return "How far it misses the measured force could not be measured."
    return (
        f"On data that no fit has seen it leaves W_s = {number(gap.before)}, where noise alone would "
        f"leave {number(gap.noise_floor)}. W_s is a share of the mean square of the force; in r.m.s. the model misses "
        f"{percent(gap.before**0.5)} of the force, and noise alone would be {percent(gap.noise_floor**0.5)}."
    )


# ----------------------------------------------------------------------------------------------------
# Which shape what is left has, where the verdict is `unexplained`: hypotheses, beside the picture of the best.


def hypothesis_blocks(found: Hypotheses) -> tuple[Block, ...]:
    """A sentence and a table; nothing where none was looked for."""
    if not found.sought:
        return ()
    if not found.rows:
        return (Paragraph("No shape of what is left predicts tests kept back better beyond two standard errors."),)
    best = found.alone[0]
    return (
        Paragraph(
            f"A hypothesis on what is left: c {best.shape}, {best.physics}. It would close {percent(best.closes)} of "
            "the gap on tests kept back. It is adopted nowhere: what has this shape may be something else."
        ),
        TextTable(
            "Shapes of what is left, each by itself, and below beside the best",
            ("shape", "coefficient (95 % interval)", "searched", "gap closed", "standard errors", "physics"),
            tuple(_cells(row) for row in found.rows),
        ),
    )


def _cells(row: HypothesisRow) -> tuple[str, ...]:
    value = interval(row.coefficient, row.coefficient_low95, row.coefficient_high95)
    second = f"; {number(row.second_coefficient)} with the cosine" if row.second_coefficient is not None else ""
    searched = DASH
    if row.parameter is not None:
        searched = f"{row.parameter} = {amount(row.parameter_value, row.parameter_unit or '')}"
    return (
        f"c {row.shape}" if row.beside is None else f"c {row.shape}, beside {row.beside}",
        f"{value}{second} {unit_of(row.unit)}".rstrip(),
        searched,
        percent(row.closes),
        number(row.standard_errors, 2),
        f"{row.physics} ({row.library})" if row.library else row.physics,
    )


# ----------------------------------------------------------------------------------------------------


_FOLD = 6
MIDDLE_DIGITS = 6
"""Of the middle of a test: as it is given, for the amplitude about it leaves nothing of the recorded stroke."""


def render(context: ReportContext, pictures: Pictures) -> Section:
    """The third section."""
    diagnosis = context.diagnosed.diagnosis
    sure = (
        "" if diagnosis.confidence is None else f" The confidence in this verdict is {percent(diagnosis.confidence)}."
    )
    blocks: list[Block] = [Paragraph(f"{verdict(context)}{sure}")]
    blocks += [Paragraph(text) for text in (sentence(diagnosis.reason), _missing_gap(diagnosis)) if text]
    blocks += [*galleries(pictures["missing"])]
    if diagnosis.parameters:
        blocks.append(_parameters(context, diagnosis))
    if diagnosis.prediction:
        blocks.append(_prediction(context, diagnosis.prediction))
    if diagnosis.ranking:
        blocks.append(_ranking(diagnosis, context.control))
    blocks += hypothesis_blocks(context.diagnosed.hypotheses)
    blocks.append(Notes((next_test(context, diagnosis.next_test),)))
    return Section("missing", "What is missing, and how sure that is", tuple(blocks))


def verdict(context: ReportContext) -> str:
    """The verdict in plain words."""
    diagnosis = context.diagnosed.diagnosis
    adopted = listed(effects_in_words(diagnosis.effects))
    if diagnosis.verdict == "named":
        text = f"Missing from the {context.damper.baseline_name}: {adopted}"
    elif diagnosis.verdict == "ambiguous" and not diagnosis.effects:
        rivals = listed(effects_in_words(diagnosis.rivals), "or")
        text = f"These tests do not settle whether anything is missing{f'; possible: {rivals}' if rivals else ''}"
    elif diagnosis.verdict == "ambiguous":
        rivals = listed(effects_in_words(diagnosis.rivals), "or")
        text = f"These tests do not settle what is missing. Best: {adopted or DASH}; also possible: {rivals or DASH}"
    elif diagnosis.verdict == "none":
        name = context.damper.baseline_name
        text = f"Nothing is missing: what the {name} leaves is within the noise and the scatter between tests"
    elif context.damper.fitted_law:
        text = "The knee law leaves a gap that repeats, and no effect was looked for beside it"
    else:
        found = f"; {adopted} is part of it" if adopted else ""
        text = f"Something is missing that the library of effects does not explain{found}"
    return f"{text}."


def _missing_gap(diagnosis: Diagnosis) -> str:
    gap = diagnosis.gap
    if gap is None:
        return ""
    left = f"standard error {number(gap.standard_error, 2)}, noise alone {number(gap.noise_floor)}"
    if gap.after == gap.before:
        text = f"The model is handed on unchanged: W_s on held-out data is {number(gap.before)} ({left})."
    else:
        cut = percent(1.0 - gap.after / gap.before) if gap.before > 0.0 else DASH
        text = f"On held-out data W_s goes from {number(gap.before)} to {number(gap.after)} ({left}): {cut} less."
    weak = {
        "records": "Whole records were held out.",
        "cycles": "Only cycles of the same records were held out, which is a weak test.",
        "segments": "Segments of the same records were held out, which is a weaker test than whole records.",
        "mixed": "Some whole records and some parts of records were held out.",
    }
    return f"{text} {weak[gap.hold_out]}"


def _prediction(context: ReportContext, found: Prediction) -> TextTable:
    """W_s of every kept-back test and of every voltage left out, by the plain damper and the one handed on."""
    tests = [
        (
            each.record,
            DASH if each.voltage is None else context.voltage(each.voltage),
            number(each.W_s_plain),
            number(each.W_s),
        )
        for each in found.by
    ]
    left_out = [
        (f"all tests at {context.voltage(each.voltage)}", "left out", number(each.W_s_plain), number(each.W_s))
        for each in found.left_out_voltages
    ]
    whole = ("all of them", DASH, number(found.W_s_plain), number(found.W_s))
    how = {"tests": "whole tests", "mixed": "whole tests, halves of those that are alone"}.get(
        found.hold_out, f"halves of a test, by {found.hold_out}, which is weak"
    )
    return TextTable(
        f"What was kept back from the fit ({how}), and how it is predicted",
        ("kept back", context.control.name, "W_s, simple model", "W_s, as handed on"),
        (whole, *tests, *left_out),
        folded=len(tests) > _FOLD,
    ).without_empty(context.control.name)


def _parameters(context: ReportContext, diagnosis: Diagnosis) -> TextTable:
    rows = [
        row
        for effect, values in diagnosis.parameters.items()
        for name, value in values.items()
        for row in _value_rows(context, effect, _measured_from(diagnosis, effect, name), value)
    ]
    return TextTable("What was added", ("effect", "parameter", "value (95 % interval)", "unit"), tuple(rows))


def _measured_from(diagnosis: Diagnosis, effect: str, name: str) -> str:
    """The name of a parameter, with the recorded displacement from which a place is counted."""
    if (effect, name) != ("end_stop", "x_e"):
        return name
    return f"{name} to either side of x = {number(1000.0 * diagnosis.zero_m)} mm"


def _value_rows(context: ReportContext, effect: str, name: str, value: Value) -> list[tuple[str, ...]]:
    unit = unit_of(value.unit)
    if not isinstance(value.value, tuple):
        low, high = (bound if not isinstance(bound, tuple) else None for bound in (value.low95, value.high95))
        return [(effect, name, _with_interval(value.value, low, high), unit)]
    nodes = value.at_voltage_V or (None,) * len(value.value)
    unknown = (None,) * len(value.value)
    lows, highs = (bound if isinstance(bound, tuple) else unknown for bound in (value.low95, value.high95))
    return [
        (effect, f"{name} at {context.voltage(node)}", _with_interval(each, low, high), unit)
        for node, each, low, high in zip(nodes, value.value, lows, highs, strict=True)
    ]


def _with_interval(value: float, low: float | None, high: float | None) -> str:
    """A value with its interval, which only what nobody fitted lacks."""
    return f"{number(value)} (edited by hand)" if low is None and high is None else interval(value, low, high)


def _ranking(diagnosis: Diagnosis, control: Control) -> TextTable:
    rows = tuple(
        (r.effect, number(r.gap_after), number(round(r.delta_bic), 6), _fitted(r, control), r.reason)
        for r in diagnosis.ranking
    )
    header = ("effect", "W_s left", "delta BIC", "fitted", "what became of it")
    return TextTable("Every candidate, best first", header, rows, folded=len(rows) > _FOLD)


def _fitted(ranked: Ranked, control: Control) -> str:
    effects = known()
    texts = []
    for name, value in ranked.parameters.items():
        effect = effects.get(ranked.effect)
        unit = next((p.unit for p in effect.parameters if p.name == name), "") if effect else ""
        values = value if isinstance(value, tuple) else (value,)
        shown = ", ".join(number(each) for each in values)
        texts.append(f"{name} = {shown} {unit_of(control.own_unit(unit))}".rstrip())
    return "; ".join(texts) or DASH


def next_test(context: ReportContext, test: NextTest | None) -> str:
    """The next rig test in plain words, with what it would settle."""
    if test is None:
        return "Next test: none is proposed."
    names = [effect_in_words(name) if name in known() else name for name in test.separates]
    aim = f". It separates: {'; '.join(names)}" if names else ""
    if least := least_known(context, test):
        aim = f". {least}"
    far = (
        f". They differ there by {number(test.distance_percent, 2)} % of the peak force"
        if test.distance_percent
        else ""
    )
    return f"Next test: {rig_test(context, test)}{_reached(test)}{aim}{far}."


def least_known(context: ReportContext, test: NextTest) -> str:
    """Between which voltages the force is known least, which the test is to show; empty where it tells rivals apart."""
    if test.between_voltage_V is None:
        return ""
    low, high = (context.voltage(voltage) for voltage in test.between_voltage_V)
    return f"Between {low} and {high} the force is known least"


def _reached(test: NextTest) -> str:
    """The largest speed and force of a test."""
    reached = [
        text
        for value, text in (
            (test.peak_speed_m_per_s, amount(test.peak_speed_m_per_s, "m/s")),
            (test.peak_force_N, amount(test.peak_force_N, "N")),
        )
        if value is not None
    ]
    return f". It would reach {listed(reached)}" if reached else ""


def rig_test(context: ReportContext, test: NextTest) -> str:
    """A rig test in a few words."""
    parts = [test.waveform.replace("_", " ")]
    parts += [amount(test.frequency_Hz, "Hz")] if test.frequency_Hz is not None else []
    about = "" if test.middle_m is None else f" about {number(1000.0 * test.middle_m, MIDDLE_DIGITS)} mm"
    parts += [f"amplitude {number(1000.0 * test.amplitude_m)} mm{about}"] if test.amplitude_m is not None else []
    if test.voltage_V is not None:
        volts = test.voltage_V if isinstance(test.voltage_V, tuple) else (test.voltage_V,)
        parts.append(f"at {' and '.join(context.voltage(v) for v in volts)}")
    return ", ".join(parts)
