"""Pages in one file that ask nothing of the net: the report, and that of `pzd check --plot`."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from pzd.artefacts import Diagnosis, Finding, ForceRow, RecordEntry, Rig, SummaryRow
from pzd.parallel.processes import parallel_map
from pzd.quantities import Control
from pzd.record import Array, Record
from pzd.report.blocks import (
    WIDE,
    Block,
    Card,
    Gallery,
    Notes,
    Opening,
    Paragraph,
    Section,
    amount,
    listed,
    number,
    percent,
    sentence,
    spelled,
    typewritten,
)
from pzd.report.context import ReportContext
from pzd.report.damper_models import effect_in_words
from pzd.report.diagnosis_text import no_gap, noise_named
from pzd.report.drawing import BASELINE, FINAL, MEASURED, Panel, axes, encoded, pictures, styled
from pzd.report.explorer import Explorer, policy, scripts
from pzd.report.explorer import explorer as explorer_of
from pzd.report.plots import library
from pzd.report.ride_comfort import Comparison, RatedRides
from pzd.report.sections import damper, missing, passenger, tested, trust
from pzd.report.sections.missing import least_known, rig_test, verdict
from pzd.report.sections.passenger import SAME, change
from pzd.schema.errors import counted
from pzd.simulate.policies import policies
from pzd.simulate.study.plan import assumed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
    at += ", by the model in steady flow"
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
    question, gap = "How sure is that?", _gap(diagnosis)
    if diagnosis.confidence is not None:
        return Card(question, percent(diagnosis.confidence), gap)
    return Card(question, "Not stated", f"{_unsure(diagnosis)} {gap}")


def _unsure(diagnosis: Diagnosis) -> str:
    """Return why no confidence is stated."""
    if diagnosis.by_knee_law:
        return "The knee law misses nothing visible, so that no effect was tried beside it."
    if not diagnosis.ranking:
        return "No effect was tried on these tests."
    return "A probability is that of a name, and what is left has none."


def _gap(diagnosis: Diagnosis) -> str:
    gap = diagnosis.gap
    if gap is None:
        return f"The gap {'was ' * diagnosis.by_knee_law}{no_gap(diagnosis)}."
    before, after = number(gap.before), number(gap.after)
    course = f"stays {before}" if gap.after == gap.before else f"goes from {before} to {after}"
    return f"The gap W_s on held-out data {course}; {noise_named(gap)} is {number(gap.noise_floor)}."


def _next(context: ReportContext) -> Card:
    test = context.diagnosed.diagnosis.next_test
    if test is None:
        return Card("Which test next?", "None is proposed", "")
    names = listed([spelled(effect) for effect in test.separates])
    why = sentence(f"it separates {names}") if names else ""
    return Card("Which test next?", _capital(rig_test(context, test)), sentence(least_known(context, test)) or why)


_MOST_ROADS = 4
"""Roads of the headline; the others stand in their section."""


def _comfort(context: ReportContext) -> Card:
    rated = context.rated
    if not context.controlled:
        return Card("What does the passenger feel?", _comfort_levels(rated), "")
    question = "Which policy rides best?"
    if not any(policies()[ride.row.policy].controlled for ride in rated.rides):
        return Card(question, "Nothing controls the dampers", _comfort_levels(rated))
    best = {road: row for road in rated.roads[:_MOST_ROADS] if (row := rated.best(road)) is not None}
    answer = "; ".join(f"{rated.road_label(road)}: {_best(rated, road, row)}" for road, row in best.items())
    fidelity = listed(list(dict.fromkeys(row.fidelity for row in best.values())))
    return Card(
        question, _capital(answer), f"Fidelity {fidelity}. {_price(rated, best)} {_controlled(context)}".strip()
    )


def _best(rated: RatedRides, road: str, row: SummaryRow) -> str:
    """Return the best policy on a road with a_w, beside the best that is held."""
    held = rated.held(rated.by_comfort(road))
    text = f"{rated.policy_label(row)}, a_w {amount(rated.a_w(row), 'm/s2')}"
    if held is None or held is row:
        return text
    by = change(rated.a_w(held), rated.a_w(row))
    return f"{text}, {by} {'as' if by == SAME else 'than'} {_the(held.policy)}"


def _price(rated: RatedRides, best: Mapping[str, SummaryRow]) -> str:
    """Return what the best policy costs in wheel load and travel, beside the best that is held."""
    parts = []
    for road, row in best.items():
        held = rated.held(rated.by_comfort(road))
        if held is not None and held is not row:
            load = change(held.rms_wheel_load_N, row.rms_wheel_load_N)
            travel = change(held.peak_deflection_m, row.peak_deflection_m)
            parts.append(f"{rated.road_label(road)}: wheel load {load}, travel {travel}")
    return f"Its price: {'; '.join(parts)}." if parts else ""


def _controlled(context: ReportContext) -> str:
    """Return how the policy under study does where another one leads, and why a law that knows no lag falls behind."""
    rated = context.rated
    roads = [road for road in rated.roads[:_MOST_ROADS] if rated.comparisons(road)]
    first = {road: rated.comparisons(road)[0] for road in roads}
    behind = {road: one for road, one in first.items() if rated.best(road) is not one.controlled}
    if not behind:
        return ""
    one = next(iter(behind.values()))
    law = policies()[one.controlled.policy]
    name = "The law of the paper (policy comfort)" if law.name == "comfort" else f"The policy {spelled(law.name)}"
    changes = "; ".join(f"{rated.road_label(road)}: a_w {_gain(rated, each)}" for road, each in behind.items())
    text = f"{name} beside {_the(one.others[0].policy)}, {one.controlled.fidelity}: {changes}."
    if law.aim == "predict" or one.controlled.fidelity != "dynamic":
        return text
    at_once = [f"{rated.road_label(road)} {_gain(rated, each)}" for road in behind for each in _at_once(rated, road)]
    without = f" Where the force follows at once (fidelity table) it is: {'; '.join(at_once)}." if at_once else ""
    return f"{text} It knows neither the lag of the valve nor the oil spring.{without}"


def _at_once(rated: RatedRides, road: str) -> list[Comparison]:
    return [one for one in rated.comparisons(road) if one.controlled.fidelity == "table"]


def _comfort_levels(rated: RatedRides) -> str:
    """Return a_w on every road, where no policy is compared with others."""
    rides = [(road, ride) for road in rated.roads for ride in rated.most_realistic(road)[:1]]
    levels = "; ".join(
        f"{rated.road_label(road)}: a_w {amount(rated.a_w(ride), 'm/s2')}, {rated.label(ride)}" for road, ride in rides
    )
    return sentence(levels)


def _gain(rated: RatedRides, one: Comparison) -> str:
    """Return the change of a_w by control, compared with the strongest of the others."""
    return change(rated.a_w(one.others[0]), rated.a_w(one.controlled))


def _the(policy: str) -> str:
    return {"passive": "the passive damper", "constant": "constant c"}.get(policy, f"the {spelled(policy)}")


# --- The answer in a sentence ---


def answer(context: ReportContext) -> str:
    """Return what came out, as a person would say it."""
    diagnosis, gap = context.diagnosed.diagnosis, context.diagnosed.diagnosis.gap
    name = context.damper.baseline_name
    names = [effect_in_words(effect).partition(":")[0] for effect in diagnosis.effects]
    if diagnosis.verdict == "named":
        sure = f" ({percent(diagnosis.confidence)} sure)" if diagnosis.confidence is not None else ""
        text = f"The {name} lacks {listed(names)}{sure}"
    elif diagnosis.verdict == "ambiguous" and diagnosis.effects and diagnosis.rivals:
        either = listed([spelled(effect) for effect in (*diagnosis.effects, *diagnosis.rivals)], "or")
        text = f"The {name} lacks {either}, alone or together; these tests do not settle which"
    elif diagnosis.verdict == "none":
        text = f"The {name} describes this damper as well as these tests can tell"
    else:
        text = verdict(context).removesuffix(".")
    if gap is None:
        return f"{text}."
    before, after, least = (percent(math.sqrt(w)) for w in (gap.before, gap.after, gap.noise_floor))
    noise = noise_named(gap)
    on = "on tests that no fit has seen" if gap.hold_out == "records" else "on data that no fit has seen"
    if not context.damper.extended or gap.after == gap.before:
        return f"{text}: its error {on} is {before} of the force, r.m.s., and {noise} would leave {least}."
    falls = f"falls from {before} to {after} of the force, r.m.s."
    return f"{text}: with it the error {on} {falls}; {noise} leaves {least}."


def told(context: ReportContext) -> tuple[str, ...]:
    """Return what a terminal says at the end: the answer, and how the rides compare, a sentence or two a line."""
    comfort = _comfort(context) if context.ridden else None
    lines = [answer(context), *([f"{comfort.question} {sentence(comfort.answer)}", comfort.detail] if comfort else [])]
    return tuple(context.control.told(typewritten(line)) for line in lines if line)


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
    title = ": ".join(
        filter(None, ("Damper and comfort report" if context.ridden else "Damper report", context.setting))
    )
    about = tuple((name, str(value)) for name, value in context.config.about.items())
    first = Opening(answer(context), tuple(picture for row in drawn["answer"] for picture in row), about)
    shown = title, cards(context), _assumed(context), sections
    return render(*shown, opening=first, explorer=explorer_of(context), told=context.control.told)


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
    opening: Opening | None = None,
    explorer: Explorer | None = None,
    told: Callable[[str], str] | None = None,
) -> str:
    """Fill the template of the report.

    Parameters
    ----------
    title : of the page
    headline : questions with their answers
    assumed : what is assumed because nobody said otherwise
    sections : of the page
    footer : its last line
    opening : what stands first, before the headline
    explorer : of the records
    told : gives a text as it is to be told, see `Control.told`
    """
    runs = scripts() if explorer else ()
    texts = {
        "title": title,
        "cards": headline,
        "assumed": assumed,
        "sections": sections,
        "footer": footer,
        "opening": opening,
        "explorer": explorer,
        "scripts": runs,
        "policy": policy(runs),
        "wide": WIDE,
    }
    return filled("pzd.report", "report.html", texts, told)


def filled(package: str, template: str, texts: Mapping[str, object], told: Callable[[str], str] | None = None) -> str:
    """Fill a template in the folder `templates` of a package, which escapes every text, as it is to be told."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    def finalized(value: object) -> object:
        return told(value) if told is not None and type(value) is str else value  # and not in a script

    environment = Environment(
        loader=PackageLoader(package, "templates"),
        autoescape=True,
        finalize=finalized,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template(template).render(texts)


# --- The page of `pzd check --plot`: every record as read, with the findings of the preflight marked in it ---

_BINS = 400
"""Parts of a record; the smallest and the largest sample of each are drawn, so that no spike is passed over."""
_LOOP_POINTS = 2500
"""Points of a loop that are drawn."""
_WHEN = re.compile(r"\b(?:at|after|before|until|from) (-?[\d.]+(?:e[-+]?\d+)?) s\b")
"""A time in the words of a finding."""


def records_page(rig: Rig, control: Control, jobs: int = 1) -> str:
    """Write a page with a section for each record: x, v and F over time, F over v, F over x, and the findings.

    Parameters
    ----------
    rig : the records, with what the preflight found
    control : the control signal, for its unit
    jobs : records drawn at the same time

    Returns
    -------
    HTML that asks nothing of the net and runs no script
    """
    entries: Mapping[str, RecordEntry] = {entry.name: entry for entry in rig.entries}
    with styled():
        sections = parallel_map(lambda record: _section(record, entries[record.name], control), rig.records, jobs)
    count = sum(len(entry.findings) for entry in rig.entries)
    footer = "Written by pzd check. The records stand as they were read: nothing was corrected."
    title = f"{counted(len(rig.records), 'record')} as read, with {counted(count, 'finding')} of the preflight"
    return render(title, (), (), tuple(sections), footer)


def _section(record: Record, entry: RecordEntry, control: Control) -> Section:
    conditions = [
        amount(entry.voltage_V, control.unit) if entry.voltage_V is not None else "",
        amount(entry.temperature_degC, "degC") if entry.temperature_degC is not None else "",
        f"{number(entry.cycles)} cycles at {amount(entry.rate_Hz, 'Hz', 4)}",
        entry.setting or "",
    ]
    pictures = tuple(encoded(panel) for panel in (_over_time(record, entry.findings), *_loops(record, entry.findings)))
    blocks: list[Block] = [Paragraph(f"{', '.join(part for part in conditions if part)}."), Gallery(pictures)]
    if entry.findings:
        lines = (f"{f.check}: {f.where}: {amount(f.size, f.unit)}; {f.follows}" for f in entry.findings)
        blocks.append(Notes(tuple(f"{mark}. {line}" for mark, line in enumerate(lines, 1)), "care"))
    return Section(record.name, record.name, tuple(blocks))


def times_of(findings: Sequence[Finding]) -> list[tuple[int, float]]:
    """Return the times that findings name, each with the number of the finding from 1 [s]."""
    return [(mark, float(when)) for mark, finding in enumerate(findings, 1) for when in _WHEN.findall(finding.where)]


def envelope(time: Array, values: Array) -> tuple[Array, Array]:
    """Return time and value of the smallest and the largest sample of each of many equal parts, in their order.

    Parameters
    ----------
    time : (n,) [s]
    values : (n,) of any channel
    """
    if values.size <= 2 * _BINS:
        return time, values
    edges = np.linspace(0, values.size, _BINS + 1).astype(int)
    rows = sorted(
        {int(first + end(values[first:last])) for first, last in pairwise(edges) for end in (np.argmin, np.argmax)}
    )
    return time[rows], values[rows]


def _over_time(record: Record, findings: Sequence[Finding]) -> Panel:
    from matplotlib.figure import Figure

    figure: Figure = Figure(figsize=(4.5, 4.2))
    channels = (
        ("x [mm]", 1000.0 * record.displacement),
        ("v [m/s]", record.velocity),
        ("F [kN]", record.force / 1000.0),
    )
    plots = figure.subplots(len(channels), 1, sharex=True)
    for ax, (label, values) in zip(plots, channels, strict=True):
        ax.plot(*envelope(record.time, values), color=MEASURED, linewidth=0.8)
        ax.set_ylabel(label)
        for mark, when in times_of(findings):
            ax.axvline(when, color=BASELINE, linewidth=1.2, linestyle="--")
            if ax is plots[0]:
                # 1 point to the right of the line and above the axes
                coordinates = {"xycoords": ("data", "axes fraction"), "textcoords": "offset points"}
                ax.annotate(f"{mark}", (when, 1.0), (1, 1), **coordinates, color=BASELINE)
    plots[-1].set_xlabel("time [s]")
    figure.align_ylabels()
    figure.subplots_adjust(left=0.15, right=0.97, top=0.94, bottom=0.12, hspace=0.12)
    alt = f"Displacement, velocity and force of {record.name} over time."
    return Panel(figure, "Over time", alt, "Dashed: findings, by their number below." if times_of(findings) else "")


def _loops(record: Record, findings: Sequence[Finding]) -> list[Panel]:
    step = max(record.time.size // _LOOP_POINTS, 1)
    marked = [int(np.argmin(np.abs(record.time - when))) for _, when in times_of(findings)]
    panels = []
    for values, label, title in (
        (record.velocity, "velocity [m/s]", "Force over velocity"),
        (1000.0 * record.displacement, "displacement [mm]", "Force over displacement"),
    ):
        figure, ax = axes(label, "force [kN]", height=4.2, key=0)
        ax.plot(values[::step], record.force[::step] / 1000.0, color=FINAL, linewidth=0.6)
        ax.plot(values[marked], record.force[marked] / 1000.0, "o", markersize=8.0, fillstyle="none", color=BASELINE)
        caption = "Circles: where findings are." if marked else ""
        panels.append(Panel(figure, title, f"{title} of {record.name}, all of the record.", caption))
    return panels
