"""What is missing from the simple model: where it fails, how sure the verdict is, and what would settle it."""

from __future__ import annotations

from pzd.artefacts import Diagnosis, Hypotheses, HypothesisRow, NextTest, Ranked
from pzd.artefacts.csv_rows import Estimate
from pzd.damper.confounders import known
from pzd.quantities import Control
from pzd.report import tables
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
    listed,
    number,
    percent,
    sentence,
    spelled,
)
from pzd.report.columns import PAGE, Column, Quantity, Table
from pzd.report.context import ReportContext
from pzd.report.damper_models import effect_in_words, effects_in_words
from pzd.report.diagnosis_text import UNNAMED_FORCE, no_gap, noise_named

MIDDLE_DIGITS = 6
"""Of the middle of a test: as it is given, for the amplitude about it leaves nothing of the recorded stroke."""
_FOLD = 6

# --- Where the simple model fails ---


def render_simple_model(context: ReportContext, pictures: Pictures) -> Section:
    """Return the section on the gap between measured and simulated force, and where it lies."""
    element = (
        "The knee law has dry friction, and bleed, knee and blow-off of each direction"
        if context.damper.fitted_law
        else "The simple model is the Bingham element of the paper: dry friction T0 and viscous damping C"
    )
    text = f"{element} in series with the oil spring k. {_gap(context.diagnosed.diagnosis)}"
    blocks: list[Block] = [Paragraph(text), *galleries(pictures["model"])]
    where = context.diagnosed.diagnosis.where
    if where:
        columns = (Column("region", "region"), tables.share("share_of_gap", "share of the gap"))
        blocks.append(Table("Where the gap lies; regions overlap, and so do their shares", columns, where).block())
    return Section("model", f"Where the {context.damper.baseline_name} fails", tuple(blocks))


def _gap(diagnosis: Diagnosis) -> str:
    gap = diagnosis.gap
    if gap is None:
        return f"Its error on data that no fit has seen {'was ' * diagnosis.by_knee_law}{no_gap(diagnosis)}."
    return (
        f"On data that no fit has seen it leaves W_s = {number(gap.before)}, where {noise_named(gap)} would "
        f"leave {number(gap.noise_floor)}. W_s is a share of the mean square of the force; in r.m.s. the residual is "
        f"{percent(gap.before**0.5)} of the force, and {noise_named(gap)} would be {percent(gap.noise_floor**0.5)}."
    )


# --- What is missing, and how sure that is ---


def render(context: ReportContext, pictures: Pictures) -> Section:
    """Return the section on the verdict and its evidence."""
    diagnosis = context.diagnosed.diagnosis
    sure = (
        "" if diagnosis.confidence is None else f" The confidence in this verdict is {percent(diagnosis.confidence)}."
    )
    blocks: list[Block] = [Paragraph(f"{verdict(context)}{sure}")]
    told = (sentence(diagnosis.reason), _of_peak(diagnosis), _gap_closed(diagnosis))
    blocks += [Paragraph(text) for text in told if text]
    blocks += [*galleries(pictures["missing"])]
    if diagnosis.parameters:
        blocks.append(tables.effect_parameters(diagnosis, context.control).block())
        if diagnosis.verdict == "unexplained":
            blocks.append(Paragraph(f"The intervals {UNNAMED_FORCE}."))
    if diagnosis.prediction:
        blocks.append(tables.prediction(diagnosis.prediction, context.control).block())
    if diagnosis.ranking:
        blocks.append(_ranking(diagnosis, context.control))
    blocks += _hypothesis_blocks(context.diagnosed.hypotheses)
    blocks.append(Notes((next_test(context, diagnosis.next_test),)))
    return Section("missing", "What is missing, and how sure that is", tuple(blocks))


def verdict(context: ReportContext) -> str:
    """Return the verdict in plain words."""
    diagnosis = context.diagnosed.diagnosis
    adopted = listed(effects_in_words(diagnosis.effects))
    if diagnosis.verdict == "named":
        text = f"Missing from the {context.damper.baseline_name}: {adopted}"
    elif diagnosis.verdict == "ambiguous" and not diagnosis.effects:
        rivals = listed(effects_in_words(diagnosis.rivals), "or")
        text = f"These tests do not settle whether anything is missing{f'; possible: {rivals}' if rivals else ''}"
    elif diagnosis.verdict == "ambiguous":
        rivals = listed(effects_in_words(diagnosis.rivals), "or")
        also = f"; also possible: {rivals}" if rivals else ""
        text = f"These tests do not settle what is missing. Best: {adopted or DASH}{also}"
    elif diagnosis.verdict == "none":
        name = context.damper.baseline_name
        text = f"Nothing is missing: what the {name} leaves is within the noise and the scatter between tests"
    else:
        for_prediction = {name for name, each in diagnosis.support.items() if each.added}
        known = [name for name in diagnosis.effects if name not in for_prediction]
        added = [name for name in diagnosis.effects if name in for_prediction]
        found = f"; {listed(effects_in_words(known))} is part of it" if known else ""
        stands = "it stands" if len(added) == 1 else "these stand"
        best = listed([spelled(name) for name in added])
        found += f"; unseen tests are predicted best with {best}, whatever {stands} for" if added else ""
        text = f"Something is missing that the library of effects does not explain{found}"
    return f"{text}."


def _of_peak(diagnosis: Diagnosis) -> str:
    """Return what the reason counts in % of peak, beside the errors in % of the force elsewhere."""
    if diagnosis.gap is None or "of peak" not in diagnosis.reason:
        return ""
    return (
        "A gap in % of peak is its r.m.s. above the noise, beside the peak force: 0 % where nothing stands out of the "
        "noise. An error in % of the force is an r.m.s. with the noise in it, beside the r.m.s. force."
    )


def _gap_closed(diagnosis: Diagnosis) -> str:
    gap = diagnosis.gap
    if gap is None:
        return ""
    left = f"standard error {number(gap.standard_error, 2)}, {noise_named(gap)} {number(gap.noise_floor)}"
    if gap.after == gap.before:
        text = f"The model stays as it is: W_s on held-out data is {number(gap.before)} ({left})."
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


def _ranking(diagnosis: Diagnosis, control: Control) -> TextTable:
    return Table(
        "Every candidate, best first",
        (
            Column("effect", "effect"),
            Column("gap_after", "W_s left"),
            Column("delta_bic", "delta BIC", value=lambda row: float(round(row.delta_bic)), digits=6),
            Column("parameters", "fitted", value=lambda row: _fitted(row, control)),
            Column("reason", "what became of it"),
        ),
        diagnosis.ranking,
        _FOLD,
    ).block()


def _fitted(ranked: Ranked, control: Control) -> str:
    effect = known().get(ranked.effect)
    units = {p.name: control.own_unit(p.unit) for p in effect.parameters} if effect else {}
    texts = []
    for name, value in ranked.parameters.items():
        *others, last = value if isinstance(value, tuple) else (value,)
        texts.append(f"{name} = {', '.join([*map(number, others), amount(last, units.get(name, ''))])}")
    return "; ".join(texts) or DASH


# --- Hypotheses: shapes of the residual force where the verdict is `unexplained` ---


def _hypothesis_blocks(found: Hypotheses) -> tuple[Block, ...]:
    """Return a sentence and a table; nothing where none was looked for."""
    if not found.sought:
        return ()
    if not found.rows:
        return (Paragraph("No shape of what is left predicts held-out tests better by more than two standard errors."),)
    best = found.alone[0]
    return (
        Paragraph(
            f"A hypothesis on what is left: c {best.shape}, {best.physics}. It would close {percent(best.closes)} of "
            "the gap on held-out tests. It is adopted nowhere: what has this shape may be something else."
        ),
        Table(
            "Shapes of what is left, each by itself, and below beside the best",
            (
                Column("shape", "shape", value=lambda r: ", beside ".join(filter(None, (f"c {r.shape}", r.beside)))),
                Column("coefficient", "coefficient (95 % interval)", value=_coefficient),
                Column("parameter", "searched", value=_searched),
                tables.share("closes", "gap closed"),
                Column("standard_errors", "standard errors", digits=2),
                Column("physics", "physics", value=lambda r: f"{r.physics} ({r.library})" if r.library else r.physics),
            ),
            found.rows,
        ).block(),
    )


def _coefficient(row: HypothesisRow) -> str | Quantity:
    estimate = Estimate.of(row, "coefficient")
    if row.second_coefficient is None:
        return Quantity(estimate, row.unit)
    return f"{PAGE.interval(estimate)}; {number(row.second_coefficient)} with the cosine {PAGE.unit(row.unit)}".rstrip()


def _searched(row: HypothesisRow) -> str | None:
    if row.parameter is None:
        return None
    return f"{row.parameter} = {amount(row.parameter_value, row.parameter_unit or '')}"


# --- The next test ---


def next_test(context: ReportContext, test: NextTest | None) -> str:
    """Return the next rig test in plain words, with what it would settle."""
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
    """Return between which voltages the force is known least; empty where the test is to tell rivals apart."""
    if test.between_voltage_V is None:
        return ""
    low, high = (context.voltage(voltage) for voltage in test.between_voltage_V)
    return f"Between {low} and {high} the force is known least"


def _reached(test: NextTest) -> str:
    """Return the largest speed and force of a test."""
    peaks = ((test.peak_speed_m_per_s, "m/s"), (test.peak_force_N, "N"))
    reached = [amount(value, unit) for value, unit in peaks if value is not None]
    return f". It would reach {listed(reached)}" if reached else ""


def rig_test(context: ReportContext, test: NextTest) -> str:
    """Return a rig test in a few words."""
    parts = [test.waveform.replace("_", " ")]
    parts += [amount(test.frequency_Hz, "Hz")] if test.frequency_Hz is not None else []
    about = "" if test.middle_m is None else f" about {number(1000.0 * test.middle_m, MIDDLE_DIGITS)} mm"
    parts += [f"amplitude {number(1000.0 * test.amplitude_m)} mm{about}"] if test.amplitude_m is not None else []
    if test.voltage_V is not None:
        volts = test.voltage_V if isinstance(test.voltage_V, tuple) else (test.voltage_V,)
        parts.append(f"at {' and '.join(context.voltage(v) for v in volts)}")
    return ", ".join(parts)
