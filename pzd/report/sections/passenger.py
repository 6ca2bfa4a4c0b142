"""What the passenger feels: the controlled ride beside the others, with and without the missing effect."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.artefacts import SummaryRow, WheelRow
from pzd.comfort import directive, iso2631_1978, iso2631_1997
from pzd.report.blocks import Block, Notes, Paragraph, Section, TextTable
from pzd.report.context import Comparison, ReportContext
from pzd.report.sections import trade_off
from pzd.report.sections.meanings import meanings
from pzd.report.sections.pictures import Pictures, by_turns
from pzd.report.wording import DASH, amount, listed, minutes, number, percent
from pzd.simulate.car import HalfCar
from pzd.simulate.modes import modes

COMFORT_TIME = "exposure_time_reduced_comfort"


_SAME = 0.0005
"""A change of a smaller share is none."""


def render(context: ReportContext, pictures: Pictures) -> Section:
    """The fifth section."""
    blocks: list[Block] = [Paragraph(_ride(context)), *meanings(context, _all(context))]
    blocks += _compared(context)
    blocks += by_turns(pictures["passenger"])
    blocks += trade_off.blocks(context, pictures)
    blocks += [_accelerations(context), _suspension(context), _wheels(context), _modes(context)]
    blocks += [*_exposures(context), *_daily(context)]
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


def _ride(context: ReportContext) -> str:
    config = context.simulate
    car = config.car.car()
    springs = " and ".join(number(k / 1000.0) for k in car.stiffnesses)
    wheels = ""
    if car.wheels_have_mass:
        masses, tyres = (listed([number(v) for v in pair]) for pair in (car.unsprung_masses, _tyres(car)))
        wheels = f", wheels of {masses} kg on tyres of {tyres} kN/m"
    return (
        f"A half-car ({car.name}: {amount(car.mass, 'kg', 4)}, springs {springs} kN/m, wheelbase "
        f"{amount(car.wheelbase, 'm')}{wheels}) at {amount(config.vehicle_speed_km_per_h, 'km/h')}, judged at point K, "
        f"{amount(abs(car.comfort_point), 'm')} {'behind' if car.comfort_point > 0.0 else 'ahead of'} the centre of "
        f"gravity. {' '.join(_windows(context))}"
    )


def _tyres(car: HalfCar) -> tuple[float, float]:
    """Stiffness of the tyres of each axle [kN/m]."""
    return car.tyre_stiffnesses[0] / 1000.0, car.tyre_stiffnesses[1] / 1000.0


def _windows(context: ReportContext) -> Iterator[str]:
    """In which part of a ride its numbers are taken."""
    spans = {ride.row.road: ride.ridden for ride in context.rated if ride.of_event}
    if any(not ride.of_event for ride in context.rated):
        other = " over the other roads" if spans else ""
        yield f"The first {amount(context.simulate.settle_s, 's')} of each ride{other} are left out."
    for road, span in spans.items():
        yield (
            f"The numbers on {road} are taken from {amount(span.from_s, 's')}, when axle 1 meets it, to "
            f"{amount(span.to_s, 's')}, when the motion of every ride over it has died away or falls no further."
        )


def _compared(context: ReportContext) -> Iterator[Block]:
    """The controlled policy beside every other at the same fidelity."""
    found = [one for road in context.roads for one in context.comparisons(road)]
    if not found:
        return
    policy = found[0].controlled.policy
    yield Paragraph(
        f"The policy {policy} is set beside the others on the same road and at the same fidelity. What the best of "
        "the others hold was searched for on each road and at each fidelity, so that a_w is least."
    )
    header = ("road", "fidelity", "beside", f"a_w {policy}", "a_w of the other", "a_w", "wheel load", "travel")
    rows = tuple(_comparison_row(context, one, other) for one in found for other in one.others)
    yield TextTable(f"{policy} beside the others at the same fidelity (a_w: ISO 2631-1:1997)", header, rows)


def _comparison_row(context: ReportContext, one: Comparison, other: SummaryRow) -> tuple[str, ...]:
    mine = one.controlled
    return (
        mine.road,
        mine.fidelity,
        context.policy(other),
        amount(context.a_w(mine), "m/s2"),
        amount(context.a_w(other), "m/s2"),
        change(context.a_w(other), context.a_w(mine)),
        change(other.rms_wheel_load_N, mine.rms_wheel_load_N),
        change(other.peak_deflection_m, mine.peak_deflection_m),
    )


def change(before: float, after: float) -> str:
    """A change in percent, in words."""
    if before == 0.0:
        return DASH
    share = after / before - 1.0
    if abs(share) < _SAME:
        return "the same"
    return f"{percent(abs(share))} {'less' if share <= 0.0 else 'more'}"


def _all(context: ReportContext) -> list[SummaryRow]:
    return [row for road in context.roads for row in context.cases(road)]


def _accelerations(context: ReportContext) -> TextTable:
    header = ("road", "dampers", "peak |a_K|", "r.m.s.", "a_w", "MTVV", "VDV", "crest factor", "likely to be felt as")
    rows = tuple(
        (
            row.road,
            context.dampers(row),
            amount(row.peak_abs_aK_m_per_s2, "m/s2"),
            amount(row.rms_aK_m_per_s2, "m/s2"),
            *(amount(context.value(row.case, name), unit) for name, unit in _WEIGHTED),
            _weighted_values(context, row),
        )
        for row in _all(context)
    )
    return TextTable(
        "Acceleration at K (a_w, MTVV, VDV and crest factor weighted by Wk, ISO 2631-1:1997)", header, rows
    )


_WEIGHTED = (("a_w", "m/s2"), ("MTVV", "m/s2"), ("VDV", "m/s^1.75"), ("crest_factor", "-"))


def _weighted_values(context: ReportContext, row: SummaryRow) -> str:
    a_w = context.value(row.case, "a_w")
    return DASH if a_w is None else " to ".join(reaction.text for reaction in iso2631_1997.reactions(a_w))


def _exposures(context: ReportContext) -> Iterator[TextTable]:
    if iso2631_1978.EDITION not in context.config.editions:
        return
    rows = tuple(
        (
            row.road,
            context.dampers(row),
            *(minutes(context.value(row.case, f"exposure_time_{boundary}")) for boundary in iso2631_1978.FACTORS),
            _status(context, row.case),
        )
        for row in _all(context)
    )
    names = (boundary.replace("_", " ") for boundary in iso2631_1978.FACTORS)
    yield TextTable(
        f"Exposure times ({iso2631_1978.EDITION}, {iso2631_1978.TRUST})",
        ("road", "dampers", *names, "how (reduced comfort)"),
        rows,
    )


def _status(context: ReportContext, case: str) -> str:
    row = context.measures.get((case, COMFORT_TIME))
    return "" if row is None else row.status.removeprefix(f"{iso2631_1978.TRUST}; ")


def _suspension(context: ReportContext) -> TextTable:
    header = ("road", "dampers", "deflection", "wheel load, r.m.s.", "jerk, r.m.s.", "dissipated")
    rows = tuple(
        (
            row.road,
            context.dampers(row),
            f"{number(1000.0 * row.peak_deflection_m)} mm",
            amount(row.rms_wheel_load_N, "N"),
            amount(row.rms_jerk_m_per_s3, "m/s3"),
            amount(row.dissipated_J, "J"),
        )
        for row in _all(context)
    )
    return TextTable("What comfort costs: travel and wheel load", header, rows)


def _wheels(context: ReportContext) -> TextTable:
    """The axles side by side; what is at rest stands in the caption."""
    by_case: dict[str, list[WheelRow]] = {}
    for wheel in context.rides.wheels:
        by_case.setdefault(wheel.case, []).append(wheel)
    shown = [(row, by_case[row.case]) for row in _all(context) if row.case in by_case]
    axles = [wheel.axle for wheel in shown[0][1]] if shown else []
    at_rest = [amount(wheel.static_load_N, "N") for wheel in shown[0][1]] if shown else []
    mass = context.simulate.car.car().wheels_have_mass
    without = "off the road" if mass else "pulling"
    header = ("road", "dampers", *(f"least force, axle {n}" for n in axles), *(f"{without}, axle {n}" for n in axles))
    rows = tuple(
        (
            row.road,
            context.dampers(row),
            *(amount(wheel.min_contact_force_N, "N") for wheel in wheels),
            *(percent(wheel.pulling) for wheel in wheels),
        )
        for row, wheels in shown
    )
    made = "the force of the tyre" if mass else "the static load less the force of spring and damper"
    caption = f"Force between wheel and road: {made}"
    share = "share of the time at 0" if mass else "share of the time at 0 or below"
    at = f" (at rest {listed(at_rest)}; {without}: {share})" if at_rest else ""
    return TextTable(f"{caption}{at}", header, rows)


def _modes(context: ReportContext) -> TextTable:
    """How the car swings by itself, on dampers of the constant c."""
    simulate = context.simulate
    rows = tuple(
        (mode.name, amount(mode.frequency_Hz, "Hz"), number(mode.damping_ratio))
        for mode in modes(simulate.car.car(), simulate.constant_damping_Ns_per_m)
    )
    c = amount(simulate.constant_damping_Ns_per_m, "N s/m")
    header = ("motion", "undamped frequency", "damping ratio")
    return TextTable(
        f"How the car swings by itself, with c = {c} at each axle and the wheels on the road", header, rows
    )


def _daily(context: ReportContext) -> Iterator[TextTable]:
    if directive.EDITION not in context.config.editions:
        return
    header = ("road", "dampers", "A(8)", "VDV of the day", "action value after", "limit value after")
    rows = tuple(
        (
            row.road,
            context.dampers(row),
            amount(context.value(row.case, "A(8)"), "m/s2"),
            amount(context.value(row.case, "VDV_day"), "m/s^1.75"),
            *(amount(context.value(row.case, f"time_to_{name}_value"), "h") for name in ("action", "limit")),
        )
        for row in _all(context)
    )
    yield TextTable(
        f"{directive.EDITION}, {number(context.config.daily_exposure_h)} h a day, vertical direction only", header, rows
    )


def _worth(context: ReportContext) -> TextTable:
    pairs = [(row, other) for row in _all(context) if (other := context.without(row)) is not None]
    rows = tuple(
        (
            row.road,
            context.dampers(row),
            *(amount(each.peak_abs_aK_m_per_s2, "m/s2") for each in (other, row)),
            *(amount(context.value(each.case, "a_w"), "m/s2") for each in (other, row)),
            *(minutes(context.value(each.case, COMFORT_TIME)) for each in (other, row)),
        )
        for row, other in pairs
    )
    header = ("road", "dampers", "peak without", "peak with", "a_w without", "a_w with", "time without", "time with")
    return TextTable("With and without the missing effect (time: reduced comfort)", header, rows)


def _beyond(context: ReportContext) -> Iterator[str]:
    for ride in context.rated:
        found = ride.evaluation.beyond
        if found and iso2631_1997.EDITION in context.config.editions:
            yield f"{ride.row.case}: {'; '.join(found)}"
