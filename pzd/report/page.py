"""report.html: the headline and all sections, in one file that asks nothing of the net and runs no script."""

from __future__ import annotations

from collections.abc import Mapping

from pzd.artefacts import ForceRow, Gap
from pzd.report.blocks import WIDE, Card, Section, amount, listed, number, percent, sentence, spelled
from pzd.report.context import ReportContext
from pzd.report.damper_models import effect_in_words
from pzd.report.drawing import pictures
from pzd.report.plots import library
from pzd.report.ride_comfort import UNCONTROLLED, Comparison, RatedRides
from pzd.report.sections import damper, missing, passenger, tested, trust
from pzd.report.sections.missing import least_known, rig_test, verdict
from pzd.report.sections.passenger import change
from pzd.simulate.study.plan import assumed

# --- The headline: damper, missing effect, confidence, next test, comfort ---


def cards(context: ReportContext) -> tuple[Card, ...]:
    """Answer four questions on the damper, and one on the comfort where it was ridden."""
    question = f"What is missing from the {context.damper.baseline_name}?"
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
    rest = context.damper.static_force_in_words((low.voltage_V, high.voltage_V))
    at += f"; {rest} of it act at rest as well." if rest else "."
    if low.voltage_V == high.voltage_V:
        return Card(question, f"It gives {_force(context, low)}", at)
    ends = [f"{_force(context, row)} at {context.voltage(row.voltage_V)}" for row in (low, high)]
    return Card(question, " to ".join(ends), at)


def _force(context: ReportContext, row: ForceRow) -> str:
    """Return a force of the table as a rig would measure it, with the static force."""
    return amount((row.force_N or 0.0) + context.damper.static_force(row.voltage_V), "N")


def _missing(context: ReportContext) -> str:
    diagnosis = context.diagnosed.diagnosis
    names = listed([spelled(effect) for effect in diagnosis.effects])
    if diagnosis.verdict == "named":
        return _capital(names)
    if diagnosis.verdict == "ambiguous" and not diagnosis.effects:
        return "Not settled by these tests"
    if diagnosis.verdict == "ambiguous":
        return _capital(listed([spelled(e) for e in (*diagnosis.effects, *diagnosis.rivals)], "or")) + ": not settled"
    if diagnosis.verdict == "none":
        return "Nothing that these tests can see"
    if context.damper.fitted_law:
        return "Nothing was looked for"
    return f"Something unexplained, beside {names}" if names else "Something unexplained"


def _meaning(context: ReportContext) -> str:
    diagnosis = context.diagnosed.diagnosis
    if diagnosis.verdict == "named":
        return sentence("; ".join(effect_in_words(effect) for effect in diagnosis.effects))
    return verdict(context)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _confidence(context: ReportContext) -> Card:
    diagnosis = context.diagnosed.diagnosis
    sure = percent(diagnosis.confidence) if diagnosis.confidence is not None else "Not stated"
    return Card("How sure is that?", sure, _gap(diagnosis.gap))


def _gap(gap: Gap | None) -> str:
    if gap is None:
        return "The gap could not be measured."
    before, after = number(gap.before), number(gap.after)
    course = f"stays {before}" if gap.after == gap.before else f"goes from {before} to {after}"
    return f"The gap W_s on held-out data {course}; noise alone is {number(gap.noise_floor)}."


def _next(context: ReportContext) -> Card:
    test = context.diagnosed.diagnosis.next_test
    if test is None:
        return Card("Which test next?", "None is proposed", "")
    names = listed([spelled(effect) for effect in test.separates])
    why = sentence(f"it separates {names}") if names else ""
    return Card("Which test next?", _capital(rig_test(context, test)), sentence(least_known(context, test)) or why)


def _comfort(context: ReportContext) -> Card:
    rated = context.rated
    if not context.controlled:
        return Card("What does the passenger feel?", _comfort_levels(rated), "")
    question = "What does control give the passenger?"
    found = {road: compared[0] for road in rated.roads if (compared := rated.comparisons(road))}
    if not found:
        return Card(question, "Nothing controls the dampers", _comfort_levels(rated))
    first = next(iter(found.values()))
    against = first.others[0].policy
    answer = "; ".join(f"{rated.road_label(road)}: a_w {_gain(rated, one)}" for road, one in found.items())
    policy = _capital(spelled(first.controlled.policy))
    beside = f"{policy} beside {_the(against)}, both {first.controlled.fidelity}"
    return Card(question, answer, f"{beside}. {_price(rated, found)} {_gain_on_others(rated, found)}".strip())


def _comfort_levels(rated: RatedRides) -> str:
    """Return a_w on every road, where no policy is compared with others."""
    rides = [(road, ride) for road in rated.roads for ride in rated.most_realistic(road)[:1]]
    levels = "; ".join(
        f"{rated.road_label(road)}: a_w {amount(rated.a_w(ride), 'm/s2')}, {rated.label(ride)}" for road, ride in rides
    )
    return sentence(levels)


def _gain(rated: RatedRides, one: Comparison, other: int = 0) -> str:
    """Return the change of a_w by control, compared with one of the others."""
    return change(rated.a_w(one.others[other]), rated.a_w(one.controlled))


def _price(rated: RatedRides, found: Mapping[str, Comparison]) -> str:
    """Return what control costs in wheel load and travel, compared with the same ride."""
    parts = []
    for road, one in found.items():
        load = change(one.others[0].rms_wheel_load_N, one.controlled.rms_wheel_load_N)
        travel = change(one.others[0].peak_deflection_m, one.controlled.peak_deflection_m)
        parts.append(f"{rated.road_label(road)}: wheel load {load}, travel {travel}")
    return f"Its price: {'; '.join(parts)}."


def _gain_on_others(rated: RatedRides, found: Mapping[str, Comparison]) -> str:
    """Return the change of a_w compared with each of the other rides at the same fidelity."""
    texts = []
    for policy in UNCONTROLLED:
        gains = [
            f"{rated.road_label(road)} {_gain(rated, one, place)}"
            for road, one in found.items()
            for place, other in enumerate(one.others)
            if place > 0 and other.policy == policy
        ]
        if gains:
            texts.append(f"Beside {_the(policy)} a_w is: {'; '.join(gains)}.")
    return " ".join(texts)


def _the(policy: str) -> str:
    return {"passive": "the passive damper", "constant": "constant c"}.get(policy, f"the {spelled(policy)}")


# --- The page ---


def page(context: ReportContext, jobs: int = 1) -> str:
    """Write the whole page as HTML.

    Parameters
    ----------
    context : the run
    jobs : pictures drawn at the same time
    """
    drawn = pictures(tuple(library().values()), context, jobs)
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
    title = "Damper and comfort report" if context.ridden else "Damper report"
    return render(": ".join(filter(None, (title, context.setting))), cards(context), _assumed(context), sections)


def _assumed(context: ReportContext) -> tuple[str, ...]:
    """Return what the rides assume because the config does not say it."""
    if not context.ridden:
        return ()
    damper = context.diagnosed.damper
    return assumed(context.simulate, damper.effects, all(row.voltage_V is not None for row in damper.base))


_FOOTER = "Written by pzd. Every number of this page stands in the files of the run beside it, or follows from them."


def render(
    title: str,
    headline: tuple[Card, ...],
    assumed: tuple[str, ...],
    sections: tuple[Section, ...],
    footer: str = _FOOTER,
) -> str:
    """Fill the template of the report."""
    texts = {
        "title": title,
        "cards": headline,
        "assumed": assumed,
        "sections": sections,
        "footer": footer,
        "wide": WIDE,
    }
    return filled("pzd.report", "report.html", texts)


def filled(package: str, template: str, texts: Mapping[str, object]) -> str:
    """Fill a template in the folder `templates` of a package, which escapes every text."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader(package, "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template(template).render(texts)
