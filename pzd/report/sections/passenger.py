"""What the passenger feels: controlled beside constant damping, with and without the missing effect."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.artefacts import SummaryRow
from pzd.report.blocks import Block, Notes, Paragraph, Picture, Section, Sheet
from pzd.report.comfort import directive, iso2631_1978, iso2631_1997
from pzd.report.sections.pictures import gallery
from pzd.report.story import Story, policy_in_words
from pzd.report.wording import DASH, amount, minutes, number, percent

COMFORT_TIME = "exposure_time_reduced_comfort"


def tell(story: Story, pictures: dict[str, tuple[Picture, ...]]) -> Section:
    """The fifth section."""
    blocks: list[Block] = [Paragraph(_ride(story))]
    blocks += [Paragraph(text) for road in story.roads if (text := compared(story, road))]
    blocks += gallery(pictures["passenger"])
    blocks += [_accelerations(story), *_exposures(story), _suspension(story), *_daily(story)]
    worth = _worth(story)
    if worth.rows:
        text = "The same rides on the damper before anything was added to it: what the missing effect is worth."
        blocks += [Paragraph(text), worth]
    beyond = tuple(_beyond(story))
    if beyond:
        blocks += [Paragraph("The r.m.s. alone understates these rides; read MTVV and VDV beside it:"), Notes(beyond, "care")]
    return Section("passenger", "What the passenger feels", tuple(blocks))


def _ride(story: Story) -> str:
    config = story.simulate
    car = config.car.car()
    return (
        f"A half-car ({car.name}: {number(car.mass, 4)} kg, springs {number(car.stiffnesses[0] / 1000.0)} and "
        f"{number(car.stiffnesses[1] / 1000.0)} kN/m, wheelbase {number(car.wheelbase)} m) at {number(config.vehicle_speed_km_per_h)} km/h, "
        f"judged at point K, {number(car.comfort_point)} m from the centre of gravity. Constant c is "
        f"{amount(config.constant_damping_Ns_per_m, 'N s/m', 4)} at each axle. "
        f"The first {number(config.settle_s)} s of each ride are left out."
    )


def compared(story: Story, road: str) -> str:
    """One road in one sentence: controlled against constant damping."""
    reference, controlled = story.reference(road), story.controlled(road)
    if reference is None or controlled is None:
        return ""
    text = f"{road}: the peak of the acceleration goes from {amount(reference.peak_abs_aK_m_per_s2, 'm/s2')} at constant c to {amount(controlled.peak_abs_aK_m_per_s2, 'm/s2')} ({policy_in_words(controlled)})"
    before, after = story.value(reference.case, "a_w"), story.value(controlled.case, "a_w")
    if before and after is not None:
        text += f", the weighted r.m.s. a_w from {amount(before, 'm/s2')} to {amount(after, 'm/s2')} ({change(before, after)})"
    return f"{text}{_longer(story, reference, controlled)}."


def change(before: float, after: float) -> str:
    """A change in percent, in words."""
    share = after / before - 1.0
    return f"{percent(abs(share))} {'less' if share <= 0.0 else 'more'}"


def _longer(story: Story, reference: SummaryRow, controlled: SummaryRow) -> str:
    if iso2631_1978.EDITION not in story.config.editions:
        return ""
    times = [minutes(story.value(row.case, COMFORT_TIME)) for row in (reference, controlled)]
    return f"; time within reduced comfort {times[0]} and {times[1]}"


def _all(story: Story) -> list[SummaryRow]:
    return [row for road in story.roads for row in story.cases(road)]


def _accelerations(story: Story) -> Sheet:
    header = ("road", "dampers", "peak |a_K|", "r.m.s.", "a_w", "MTVV", "VDV", "crest factor", "likely to be felt as")
    rows = tuple(
        (
            row.road,
            policy_in_words(row),
            amount(row.peak_abs_aK_m_per_s2, "m/s2"),
            amount(row.rms_aK_m_per_s2, "m/s2"),
            *(amount(story.value(row.case, name), unit) for name, unit in _WEIGHTED),
            _felt(story, row),
        )
        for row in _all(story)
    )
    return Sheet("Acceleration at K (a_w, MTVV, VDV and crest factor weighted by Wk, ISO 2631-1:1997)", header, rows)


_WEIGHTED = (("a_w", "m/s2"), ("MTVV", "m/s2"), ("VDV", "m/s^1.75"), ("crest_factor", "-"))


def _felt(story: Story, row: SummaryRow) -> str:
    a_w = story.value(row.case, "a_w")
    return DASH if a_w is None else " to ".join(reaction.text for reaction in iso2631_1997.reactions(a_w))


def _exposures(story: Story) -> Iterator[Sheet]:
    if iso2631_1978.EDITION not in story.config.editions:
        return
    rows = tuple(
        (
            row.road,
            policy_in_words(row),
            *(minutes(story.value(row.case, f"exposure_time_{boundary}")) for boundary in iso2631_1978.FACTORS),
            _status(story, row.case),
        )
        for row in _all(story)
    )
    names = (boundary.replace("_", " ") for boundary in iso2631_1978.FACTORS)
    yield Sheet(f"Exposure times ({iso2631_1978.EDITION}, {iso2631_1978.TRUST})", ("road", "dampers", *names, "how (reduced comfort)"), rows)


def _status(story: Story, case: str) -> str:
    row = story.measures.get((case, COMFORT_TIME))
    return "" if row is None else row.status.removeprefix(f"{iso2631_1978.TRUST}; ")


def _suspension(story: Story) -> Sheet:
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
        for row in _all(story)
    )
    return Sheet("What comfort costs: travel and wheel load", header, rows)


def _daily(story: Story) -> Iterator[Sheet]:
    if directive.EDITION not in story.config.editions:
        return
    header = ("road", "dampers", "A(8)", "VDV of the day", "action value after", "limit value after")
    rows = tuple(
        (
            row.road,
            policy_in_words(row),
            amount(story.value(row.case, "A(8)"), "m/s2"),
            amount(story.value(row.case, "VDV_day"), "m/s^1.75"),
            *(amount(story.value(row.case, f"time_to_{name}_value"), "h") for name in ("action", "limit")),
        )
        for row in _all(story)
    )
    yield Sheet(f"{directive.EDITION}, {number(story.config.daily_exposure_h)} h a day, vertical direction only", header, rows)


def _worth(story: Story) -> Sheet:
    pairs = [(row, other) for row in _all(story) if (other := story.without(row)) is not None]
    rows = tuple(
        (
            row.road,
            policy_in_words(row),
            *(amount(each.peak_abs_aK_m_per_s2, "m/s2") for each in (other, row)),
            *(amount(story.value(each.case, "a_w"), "m/s2") for each in (other, row)),
            *(minutes(story.value(each.case, COMFORT_TIME)) for each in (other, row)),
        )
        for row, other in pairs
    )
    header = ("road", "dampers", "peak without", "peak with", "a_w without", "a_w with", "time without", "time with")
    return Sheet("With and without the missing effect (time: reduced comfort)", header, rows)


def _beyond(story: Story) -> Iterator[str]:
    for ride in story.settled:
        found = iso2631_1997.evaluate(ride.weighted, ride.rate).beyond
        if found and iso2631_1997.EDITION in story.config.editions:
            yield f"{ride.row.case}: {'; '.join(found)}"
