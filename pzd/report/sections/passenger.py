"""What the passenger feels: controlled beside constant damping, with and without the missing effect."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.artefacts import SummaryRow
from pzd.comfort import directive, iso2631_1978, iso2631_1997
from pzd.report.blocks import Block, Notes, Paragraph, Section, Sheet
from pzd.report.context import REFERENCE, ReportContext, policy_in_words
from pzd.report.sections.pictures import Pictures, by_turns
from pzd.report.wording import DASH, amount, minutes, number, percent
from pzd.simulate.policies import policies

COMFORT_TIME = "exposure_time_reduced_comfort"
BEYOND_COMFORT = {
    "exposure_time_fatigue_decreased_proficiency": "until fatigue",
    "exposure_time_exposure_limit": "until the exposure limit",
}
"""The boundaries that tell rides apart which are over that of comfort from the start, in words."""


def render(context: ReportContext, pictures: Pictures) -> Section:
    """The fifth section."""
    blocks: list[Block] = [Paragraph(_ride(context)), *_meanings(context)]
    blocks += [block for road in context.roads for block in _compared(context, road)]
    blocks += by_turns(pictures["passenger"])
    blocks += [_accelerations(context), *_exposures(context), _suspension(context), *_daily(context)]
    worth = _worth(context)
    if worth.rows:
        text = "The same rides on the damper before anything was added to it: what the missing effect is worth."
        blocks += [Paragraph(text), worth]
    beyond = tuple(_beyond(context))
    if beyond:
        blocks += [
            Paragraph("The r.m.s. alone understates these rides; read MTVV and VDV beside it:"),
            Notes(beyond, "care"),
        ]
    return Section("passenger", "What the passenger feels", tuple(blocks))


_FIDELITIES = {
    "ideal": "the demanded force is there at once",
    "table": "the voltage comes from the table of force, and the force from the voltage",
    "dynamic": "as table, with the lag of the valve and the damper's own dynamics",
}


def _meanings(context: ReportContext) -> tuple[Notes, ...]:
    """What the names of policies and fidelities stand for."""
    rows = _all(context)
    used = {row.policy for row in rows}
    names = [f"{name}: {policy.meaning}" for name, policy in policies().items() if name in used]
    exact = {row.fidelity for row in rows if row.policy != REFERENCE}
    names += [f"{name}: {text}" for name, text in _FIDELITIES.items() if name in exact]
    return (Notes(tuple(names)),) if names else ()


def _ride(context: ReportContext) -> str:
    config = context.simulate
    car = config.car.car()
    springs = " and ".join(number(k / 1000.0) for k in car.stiffnesses)
    return (
        f"A half-car ({car.name}: {amount(car.mass, 'kg', 4)}, springs {springs} kN/m, wheelbase "
        f"{amount(car.wheelbase, 'm')}) at {amount(config.vehicle_speed_km_per_h, 'km/h')}, judged at point K, "
        f"{amount(abs(car.comfort_point), 'm')} {'behind' if car.comfort_point > 0.0 else 'ahead of'} the centre of "
        f"gravity. Constant c is {amount(config.constant_damping_Ns_per_m, 'N s/m', 4)} at each axle. The first "
        f"{amount(config.settle_s, 's')} of each ride are left out."
    )


def _compared(context: ReportContext, road: str) -> tuple[Block, ...]:
    """One road: constant damping in a sentence, and what each controlled ride makes of it."""
    reference, controlled = context.reference(road), context.controlled(road)
    if reference is None or not controlled:
        return ()
    text = f"{context.road(road)}, at {policy_in_words(reference)}: {_reaction_to(context, reference)}. Under control:"
    items = (
        f"{policy_in_words(row)}: {_reaction_to(context, row)}{_gain(context, reference, row)}" for row in controlled
    )
    return Paragraph(text), Notes(tuple(items))


def _reaction_to(context: ReportContext, row: SummaryRow) -> str:
    a_w = context.value(row.case, "a_w")
    level = "" if a_w is None else f", a_w {amount(a_w, 'm/s2')}"
    return f"peak acceleration {amount(row.peak_abs_aK_m_per_s2, 'm/s2')}{level}"


def _gain(context: ReportContext, reference: SummaryRow, row: SummaryRow) -> str:
    before, after = context.value(reference.case, "a_w"), context.value(row.case, "a_w")
    less = f" ({change(before, after)})" if before and after is not None else ""
    if iso2631_1978.EDITION not in context.config.editions:
        return less
    return f"{less}; within reduced comfort, if nothing else is said, {times(context, reference, row)}"


def change(before: float, after: float) -> str:
    """A change in percent, in words."""
    share = after / before - 1.0
    return f"{percent(abs(share))} {'less' if share <= 0.0 else 'more'}"


def times(context: ReportContext, reference: SummaryRow, controlled: SummaryRow) -> str:
    """Time within reduced comfort of a controlled ride beside that at constant damping.

    Where both are over that boundary from the start, the next one that either keeps to at all is taken, and said.
    """
    for measure, until in ((COMFORT_TIME, ""), *BEYOND_COMFORT.items()):
        before, after = (context.value(row.case, measure) for row in (reference, controlled))
        if before or after:
            return f"{_before_and_after(before, after)}{f' {until}' if until else ''}"
    return _before_and_after(*(context.value(row.case, COMFORT_TIME) for row in (reference, controlled)))


def _before_and_after(before: float | None, after: float | None) -> str:
    if before is None or after is None:
        return DASH
    if before == after:
        return f"{minutes(after)} either way"
    told = before > 0.0 and 0.0 < after < iso2631_1978.LONGEST_MIN
    factor = f" ({number(after / before, 2)} times)" if told else ""
    return f"{minutes(after)} instead of {minutes(before)}{factor}"


def _all(context: ReportContext) -> list[SummaryRow]:
    return [row for road in context.roads for row in context.cases(road)]


def _accelerations(context: ReportContext) -> Sheet:
    header = ("road", "dampers", "peak |a_K|", "r.m.s.", "a_w", "MTVV", "VDV", "crest factor", "likely to be felt as")
    rows = tuple(
        (
            row.road,
            policy_in_words(row),
            amount(row.peak_abs_aK_m_per_s2, "m/s2"),
            amount(row.rms_aK_m_per_s2, "m/s2"),
            *(amount(context.value(row.case, name), unit) for name, unit in _WEIGHTED),
            _weighted_values(context, row),
        )
        for row in _all(context)
    )
    return Sheet("Acceleration at K (a_w, MTVV, VDV and crest factor weighted by Wk, ISO 2631-1:1997)", header, rows)


_WEIGHTED = (("a_w", "m/s2"), ("MTVV", "m/s2"), ("VDV", "m/s^1.75"), ("crest_factor", "-"))


def _weighted_values(context: ReportContext, row: SummaryRow) -> str:
    a_w = context.value(row.case, "a_w")
    return DASH if a_w is None else " to ".join(reaction.text for reaction in iso2631_1997.reactions(a_w))


def _exposures(context: ReportContext) -> Iterator[Sheet]:
    if iso2631_1978.EDITION not in context.config.editions:
        return
    rows = tuple(
        (
            row.road,
            policy_in_words(row),
            *(minutes(context.value(row.case, f"exposure_time_{boundary}")) for boundary in iso2631_1978.FACTORS),
            _status(context, row.case),
        )
        for row in _all(context)
    )
    names = (boundary.replace("_", " ") for boundary in iso2631_1978.FACTORS)
    yield Sheet(
        f"Exposure times ({iso2631_1978.EDITION}, {iso2631_1978.TRUST})",
        ("road", "dampers", *names, "how (reduced comfort)"),
        rows,
    )


def _status(context: ReportContext, case: str) -> str:
    row = context.measures.get((case, COMFORT_TIME))
    return "" if row is None else row.status.removeprefix(f"{iso2631_1978.TRUST}; ")


def _suspension(context: ReportContext) -> Sheet:
    header = ("road", "dampers", "deflection", "wheel load, r.m.s.", "jerk, r.m.s.", "dissipated")
    rows = tuple(
        (
            row.road,
            policy_in_words(row),
            f"{number(1000.0 * row.peak_deflection_m)} mm",
            amount(row.rms_wheel_load_N, "N"),
            amount(row.rms_jerk_m_per_s3, "m/s3"),
            amount(row.dissipated_J, "J"),
        )
        for row in _all(context)
    )
    return Sheet("What comfort costs: travel and wheel load", header, rows)


def _daily(context: ReportContext) -> Iterator[Sheet]:
    if directive.EDITION not in context.config.editions:
        return
    header = ("road", "dampers", "A(8)", "VDV of the day", "action value after", "limit value after")
    rows = tuple(
        (
            row.road,
            policy_in_words(row),
            amount(context.value(row.case, "A(8)"), "m/s2"),
            amount(context.value(row.case, "VDV_day"), "m/s^1.75"),
            *(amount(context.value(row.case, f"time_to_{name}_value"), "h") for name in ("action", "limit")),
        )
        for row in _all(context)
    )
    yield Sheet(
        f"{directive.EDITION}, {number(context.config.daily_exposure_h)} h a day, vertical direction only", header, rows
    )


def _worth(context: ReportContext) -> Sheet:
    pairs = [(row, other) for row in _all(context) if (other := context.without(row)) is not None]
    rows = tuple(
        (
            row.road,
            policy_in_words(row),
            *(amount(each.peak_abs_aK_m_per_s2, "m/s2") for each in (other, row)),
            *(amount(context.value(each.case, "a_w"), "m/s2") for each in (other, row)),
            *(minutes(context.value(each.case, COMFORT_TIME)) for each in (other, row)),
        )
        for row, other in pairs
    )
    header = ("road", "dampers", "peak without", "peak with", "a_w without", "a_w with", "time without", "time with")
    return Sheet("With and without the missing effect (time: reduced comfort)", header, rows)


def _beyond(context: ReportContext) -> Iterator[str]:
    for ride in context.settled:
        found = iso2631_1997.evaluate(ride.weighted, ride.rate).beyond
        if found and iso2631_1997.EDITION in context.config.editions:
            yield f"{ride.row.case}: {'; '.join(found)}"
