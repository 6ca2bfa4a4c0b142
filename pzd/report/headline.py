"""The five lines on top of the page: damper, missing effect, confidence, next test, comfort."""

from __future__ import annotations

from pzd.artefacts import ForceRow, Gap, SummaryRow
from pzd.comfort import iso2631_1978
from pzd.report.blocks import Card
from pzd.report.context import ReportContext, effect_in_words, policy_in_words
from pzd.report.sections.missing import rig_test, verdict
from pzd.report.sections.passenger import change, times
from pzd.report.wording import DASH, amount, listed, number, percent, sentence


def cards(context: ReportContext) -> tuple[Card, ...]:
    """Damper, missing effect, confidence, next test, comfort: each a question with its answer."""
    question = "What is missing from the simple model?"
    missing = Card(question, _missing(context), _meaning(context))
    return _damper(context), missing, _confidence(context), _next(context), _comfort(context)


def _damper(context: ReportContext) -> Card:
    rows = [row for row in context.table.force if row.force_N is not None and row.velocity_m_per_s > 0.0]
    question = "What is the damper?"
    if not rows:
        return Card(question, "No force is known", "")
    reached = context.table.notes.reached_m_per_s
    speed = min({row.velocity_m_per_s for row in rows}, key=lambda v: abs(v - reached))
    first = min((row.temperature_degC for row in rows), key=lambda t: float("-inf") if t is None else t)
    here = [row for row in rows if row.velocity_m_per_s == speed and row.temperature_degC == first]
    low, high = (end(here, key=lambda row: row.voltage_V or 0.0) for end in (min, max))
    at = f"In rebound at {amount(speed, 'm/s')}" + (f" and {amount(first, 'degC')}." if first is not None else ".")
    if low.voltage_V == high.voltage_V:
        return Card(question, f"It gives {amount(low.force_N, 'N')}", at)
    return Card(question, f"{_force(context, low)} to {_force(context, high)}", at)


def _force(context: ReportContext, row: ForceRow) -> str:
    return f"{amount(row.force_N, 'N')} at {context.voltage(row.voltage_V)}"


def _missing(context: ReportContext) -> str:
    diagnosis = context.diagnosed.diagnosis
    names = listed([_name(effect) for effect in diagnosis.effects])
    if diagnosis.verdict == "named":
        return _capital(names)
    if diagnosis.verdict == "ambiguous" and not diagnosis.effects:
        return "Not settled by these tests"
    if diagnosis.verdict == "ambiguous":
        return _capital(listed([_name(e) for e in (*diagnosis.effects, *diagnosis.rivals)], "or")) + ": not settled"
    if diagnosis.verdict == "none":
        return "Nothing that these tests can see"
    return f"Something unexplained, beside {names}" if names else "Something unexplained"


def _meaning(context: ReportContext) -> str:
    diagnosis = context.diagnosed.diagnosis
    if diagnosis.verdict == "named":
        return sentence("; ".join(effect_in_words(effect) for effect in diagnosis.effects))
    return verdict(diagnosis)


def _name(effect: str) -> str:
    return effect.replace("_", " ")


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _confidence(context: ReportContext) -> Card:
    diagnosis = context.diagnosed.diagnosis
    sure = percent(diagnosis.confidence) if diagnosis.confidence is not None else "Not stated"
    return Card("How sure is that?", sure, _gap(diagnosis.gap))


def _gap(gap: Gap | None) -> str:
    if gap is None:
        return "The gap could not be measured."
    moved = (
        f"stays {number(gap.before)}"
        if gap.after == gap.before
        else f"goes from {number(gap.before)} to {number(gap.after)}"
    )
    return f"The gap W_s on held-out data {moved}; noise alone is {number(gap.noise_floor)}."


def _next(context: ReportContext) -> Card:
    test = context.diagnosed.diagnosis.next_test
    if test is None:
        return Card("Which test next?", "None is proposed", "")
    names = listed([_name(effect) for effect in test.separates])
    return Card(
        "Which test next?", _capital(rig_test(context, test)), sentence(f"it separates {names}") if names else ""
    )


def _comfort(context: ReportContext) -> Card:
    pairs = [(road, context.reference(road), context.controlled(road)) for road in context.roads]
    compared = [(context.road(road), a, rows) for road, a, rows in pairs if a is not None and rows]
    gain = "What does the passenger gain?"
    if not compared:
        return Card(gain, "Not compared", "No ride at constant damping stands beside another.")
    _, reference, rows = compared[0]
    beside = f"{_capital(policy_in_words(rows[0]))}, beside {policy_in_words(reference)}."
    levels = "; ".join(f"{road}: {_levels(context, a, b[0])}" for road, a, b in compared)
    if iso2631_1978.EDITION not in context.config.editions:
        return Card(gain, levels, f"Acceleration a_w. {beside}")
    longer = "; ".join(f"{road}: {times(context, a, b[0])}" for road, a, b in compared)
    source = f"Within reduced comfort, if nothing else is said, {iso2631_1978.EDITION} ({iso2631_1978.TRUST})."
    detail = f"{beside} {source} Acceleration a_w: {levels}.{_ideal(context, compared)}"
    return Card("How much longer can a passenger sit?", longer, detail)


def _ideal(context: ReportContext, compared: list[tuple[str, SummaryRow, tuple[SummaryRow, ...]]]) -> str:
    """What control would reach if every demanded force were there at once."""
    found = [(road, a, row) for road, a, rows in compared for row in rows[1:] if row.fidelity == "ideal"]
    texts = "; ".join(f"{road}: {times(context, a, row)}" for road, a, row in found)
    return f" With ideal dampers: {texts}." if texts else ""


def _levels(context: ReportContext, reference: SummaryRow, controlled: SummaryRow) -> str:
    before, after = (context.value(row.case, "a_w") for row in (reference, controlled))
    if before is None or after is None:
        before, after = reference.rms_aK_m_per_s2, controlled.rms_aK_m_per_s2
    return change(before, after) if before else DASH
