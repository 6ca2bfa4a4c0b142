"""The story in five lines."""

from __future__ import annotations

from pzd.artefacts import ForceRow, SummaryRow
from pzd.report.blocks import Card
from pzd.report.comfort import iso2631_1978
from pzd.report.comfort.iso2631_1978 import LONGEST_MIN
from pzd.report.sections.missing import next_test, verdict
from pzd.report.sections.passenger import COMFORT_TIME, change
from pzd.report.story import Story, policy_in_words
from pzd.report.wording import DASH, amount, listed, minutes, number, percent


def cards(story: Story) -> tuple[Card, ...]:
    """Damper, missing effect, confidence, next test, comfort: each a question with its answer."""
    diagnosis = story.diagnosed.diagnosis
    test = next_test(story, diagnosis.next_test).removeprefix("Next test: ")
    return (
        _damper(story),
        Card("What is missing from the simple model?", _missing(story), _kept(verdict(diagnosis))),
        _confidence(story),
        Card("Which test next?", test[0].upper() + test[1:], ""),
        _comfort(story),
    )


def _damper(story: Story) -> Card:
    rows = [row for row in story.table.force if row.force_N is not None and row.velocity_m_per_s > 0.0]
    question = "What is the damper?"
    if not rows:
        return Card(question, "No force is known", "")
    reached = story.table.notes.reached_m_per_s
    speed = min({row.velocity_m_per_s for row in rows}, key=lambda v: abs(v - reached))
    first = min((row.temperature_degC for row in rows), key=lambda t: float("-inf") if t is None else t)
    here = [row for row in rows if row.velocity_m_per_s == speed and row.temperature_degC == first]
    low, high = (end(here, key=lambda row: row.voltage_V or 0.0) for end in (min, max))
    at = f"at {amount(speed, 'm/s')}" + (f" and {amount(first, 'degC')}" if first is not None else "")
    if low == high:
        return Card(question, f"{amount(low.force_N, 'N')} {at}", "")
    return Card(question, f"{_force(story, low)} to {_force(story, high)}", at)


def _force(story: Story, row: ForceRow) -> str:
    return f"{amount(row.force_N, 'N')} at {story.voltage(row.voltage_V)}"


def _missing(story: Story) -> str:
    diagnosis = story.diagnosed.diagnosis
    names = [name.replace("_", " ") for name in diagnosis.effects]
    if diagnosis.verdict == "named":
        return listed(names).capitalize()
    if diagnosis.verdict == "ambiguous":
        rivals = [name.replace("_", " ") for name in diagnosis.rivals]
        return listed([*names, *rivals], "or").capitalize() + ": not settled"
    if diagnosis.verdict == "none":
        return "Nothing that can be seen"
    return f"Unexplained, with {listed(names)} as a part" if names else "Unexplained"


def _kept(text: str) -> str:
    return text.split(" (confidence")[0].rstrip(".") + "."


def _confidence(story: Story) -> Card:
    diagnosis = story.diagnosed.diagnosis
    gap = diagnosis.gap
    answer = percent(diagnosis.confidence) if diagnosis.confidence is not None else "Not stated"
    if gap.after == gap.before:
        return Card("How sure is that?", answer, f"Gap on held-out data: W_s {number(gap.before)}, noise {number(gap.noise_floor)}.")
    return Card("How sure is that?", answer, f"Gap on held-out data: W_s from {number(gap.before)} to {number(gap.after)}, noise {number(gap.noise_floor)}.")


def _comfort(story: Story) -> Card:
    pairs = [(road, story.reference(road), story.controlled(road)) for road in story.roads]
    told = [(road, a, b) for road, a, b in pairs if a is not None and b is not None]
    if not told:
        return Card("What does the passenger gain?", "Not compared", "No ride at constant damping stands beside another.")
    if iso2631_1978.EDITION in story.config.editions:
        answers = [f"{road}: {_times(story, a, b)}" for road, a, b in told]
        note = f"Within reduced comfort, {policy_in_words(told[0][2])} against constant c; {iso2631_1978.EDITION}, {iso2631_1978.TRUST}."
        return Card("How much longer can a passenger sit?", "; ".join(answers), note)
    answers = [f"{road}: {_levels(story, a, b)}" for road, a, b in told]
    return Card("What does the passenger gain?", "; ".join(answers), f"Weighted r.m.s. a_w, {policy_in_words(told[0][2])} against constant c.")


def _times(story: Story, reference: SummaryRow, controlled: SummaryRow) -> str:
    before, after = (story.value(row.case, COMFORT_TIME) for row in (reference, controlled))
    if before is None or after is None:
        return DASH
    if before == after:
        return f"{minutes(after)} either way"
    if 0.0 < before < LONGEST_MIN and 0.0 < after < LONGEST_MIN:
        return f"{minutes(after)} instead of {minutes(before)} ({number(after / before, 2)} times)"
    return f"{minutes(after)} instead of {minutes(before)}"


def _levels(story: Story, reference: SummaryRow, controlled: SummaryRow) -> str:
    before, after = (story.value(row.case, "a_w") for row in (reference, controlled))
    if before is None or after is None:
        before, after = reference.rms_aK_m_per_s2, controlled.rms_aK_m_per_s2
    return change(before, after) if before else DASH
