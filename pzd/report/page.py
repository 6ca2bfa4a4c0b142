"""report.html: all sections in one file that asks nothing of the net and runs no script."""

from __future__ import annotations

from collections.abc import Mapping

from pzd.artefacts import ForceRow, Gap
from pzd.report.blocks import Card, Pictures, Section, amount, listed, number, percent, sentence
from pzd.report.context import (
    BASELINES,
    Comparison,
    ReportContext,
    effect_in_words,
    static_force_at,
    static_force_in_words,
)
from pzd.report.drawing import pictures
from pzd.report.plots import library
from pzd.report.sections import damper, missing, passenger, tested, trust
from pzd.report.sections.missing import least_known, rig_test, verdict
from pzd.report.sections.passenger import change

# ----------------------------------------------------------------------------------------------------
# The five lines on top of the page: damper, missing effect, confidence, next test, comfort.


def cards(context: ReportContext) -> tuple[Card, ...]:
    """Damper, missing effect, confidence, next test, and comfort if ridden: each a question with its answer."""
    question = f"What is missing from the {context.model}?"
    missing = Card(question, _missing(context), _meaning(context))
    comfort = (_comfort(context),) if context.ridden else ()
    return _damper(context), missing, _confidence(context), _next(context), *comfort


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
    at = f"In rebound at {amount(speed, 'm/s')}" + (f" and {amount(first, 'degC')}" if first is not None else "")
    rest = static_force_in_words(context, (low.voltage_V, high.voltage_V))
    at += f"; {rest} of it act at rest as well." if rest else "."
    if low.voltage_V == high.voltage_V:
        return Card(question, f"It gives {_force(context, low)}", at)
    ends = [f"{_force(context, row)} at {context.voltage(row.voltage_V)}" for row in (low, high)]
    return Card(question, " to ".join(ends), at)


def _force(context: ReportContext, row: ForceRow) -> str:
    """As a rig would measure it, with what is there at rest."""
    return amount((row.force_N or 0.0) + static_force_at(context, row.voltage_V), "N")


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
    if context.fitted_law:
        return "Nothing was looked for"
    return f"Something unexplained, beside {names}" if names else "Something unexplained"


def _meaning(context: ReportContext) -> str:
    diagnosis = context.diagnosed.diagnosis
    if diagnosis.verdict == "named":
        return sentence("; ".join(effect_in_words(effect) for effect in diagnosis.effects))
    return verdict(context)


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
    why = sentence(f"it separates {names}") if names else ""
    return Card("Which test next?", _capital(rig_test(context, test)), sentence(least_known(context, test)) or why)


def _comfort(context: ReportContext) -> Card:
    if not context.controlled:
        return Card("What does the passenger feel?", _uncontrolled(context), "")
    question = "What does control give the passenger?"
    found = {road: compared[0] for road in context.roads if (compared := context.comparisons(road))}
    if not found:
        return Card(question, "Nothing controls the dampers", _uncontrolled(context))
    first = next(iter(found.values()))
    against = first.others[0].policy
    answer = "; ".join(
        f"{context.road(road)}: a_w {change(context.a_w(one.others[0]), context.a_w(one.controlled))}"
        for road, one in found.items()
    )
    beside = f"{_capital(_name(first.controlled.policy))} beside {_the(against)}, both {first.controlled.fidelity}"
    return Card(question, answer, f"{beside}. {_price(context, found)} {_others(context, found)}".strip())


def _uncontrolled(context: ReportContext) -> str:
    """The comfort of the dampers as they are."""
    rows = [(road, context.nearest(road)) for road in context.roads]
    levels = "; ".join(
        f"{context.road(road)}: a_w {amount(context.a_w(rides[0]), 'm/s2')}, {context.dampers(rides[0])}"
        for road, rides in rows
        if rides
    )
    return sentence(levels)


def _price(context: ReportContext, found: Mapping[str, Comparison]) -> str:
    """What it costs in wheel load and travel, beside the same ride."""
    parts = []
    for road, one in found.items():
        load = change(one.others[0].rms_wheel_load_N, one.controlled.rms_wheel_load_N)
        travel = change(one.others[0].peak_deflection_m, one.controlled.peak_deflection_m)
        parts.append(f"{context.road(road)}: wheel load {load}, travel {travel}")
    return f"Its price: {'; '.join(parts)}."


def _others(context: ReportContext, found: Mapping[str, Comparison]) -> str:
    """The same beside each of the other rides at the same fidelity."""
    texts = []
    for policy in BASELINES:
        told = [
            f"{context.road(road)} {change(context.a_w(other), context.a_w(one.controlled))}"
            for road, one in found.items()
            for other in one.others[1:]
            if other.policy == policy
        ]
        if told:
            texts.append(f"Beside {_the(policy)} a_w is: {'; '.join(told)}.")
    return " ".join(texts)


def _the(policy: str) -> str:
    return {"passive": "the passive damper", "constant": "constant c"}.get(policy, f"the {_name(policy)}")


# ----------------------------------------------------------------------------------------------------


_PLACES = ("characteristics", "model", "missing", "damper", "passenger", "policies")


def page(context: ReportContext, jobs: int = 1) -> str:
    """The whole page as text.

    Parameters
    ----------
    context : the run
    jobs : pictures drawn at the same time

    Returns
    -------
    HTML, the same for the same sections
    """
    drawn = _drawn(context, jobs)
    sections = (
        tested.render(context),
        *tested.render_characteristics(context, drawn),
        missing.render_simple_model(context, drawn),
        missing.render(context, drawn),
        damper.render(context, drawn),
        *([passenger.render(context, drawn)] if context.ridden else []),
        *trust.render_expected(context),
        trust.render(context),
        trust.render_provenance(context),
    )
    return render(_title(context), cards(context), context.assumed if context.ridden else (), sections)


def _drawn(context: ReportContext, jobs: int) -> Pictures:
    plots = list(library().values())
    drawn = list(zip(plots, pictures(plots, context, jobs), strict=True))
    return {place: tuple(of_plot for plot, of_plot in drawn if plot.place == place) for place in _PLACES}


def _title(context: ReportContext) -> str:
    kind = "Damper and comfort report" if context.ridden else "Damper report"
    return f"{kind}: {context.chosen}" if context.chosen else kind


_FOOTER = "Written by pzd. Every number of this page stands in the files of the run beside it, or follows from them."


def render(
    title: str,
    headline: tuple[Card, ...],
    assumed: tuple[str, ...],
    sections: tuple[Section, ...],
    footer: str = _FOOTER,
) -> str:
    """Fill the template; every text is escaped there."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("pzd.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template("report.html").render(
        title=title, cards=headline, assumed=assumed, sections=sections, footer=footer
    )
