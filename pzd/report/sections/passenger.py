"""What the passenger feels: the controlled ride beside the others, with and without the missing effect."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from pzd.artefacts import SummaryRow, WheelRow
from pzd.comfort import directive, iso2631_1978, iso2631_1997
from pzd.report.blocks import (
    DASH,
    Block,
    Notes,
    Paragraph,
    Pictures,
    Section,
    TextTable,
    amount,
    by_turns,
    galleries,
    listed,
    minutes,
    number,
    percent,
    spelled,
)
from pzd.report.context import ReportContext
from pzd.report.ride_comfort import REALISTIC, Comparison
from pzd.simulate.config import Sensors, SimulateConfig
from pzd.simulate.policies import policies
from pzd.simulate.vehicle.car import HalfCar, modes

# ----------------------------------------------------------------------------------------------------
# What the names of policies and fidelities stand for, and what the controllers see and set.


_FIDELITIES = {
    "ideal": "the demanded force is there at once",
    "table": "the voltage comes from the table of force, and the force from the voltage",
    "dynamic": "as table, with the lag of the valve and the damper's own dynamics",
}
_UNCONTROLLED_FIDELITIES = {
    "ideal": "the demanded force is there at once",
    "table": "the force is that of the table at the speed of the damper",
    "dynamic": "as table, with the damper's own dynamics",
}
"""The same of a damper without a control signal."""


def meanings(context: ReportContext, rows: Sequence[SummaryRow]) -> tuple[Notes, ...]:
    """What the names of the policies and fidelities of some rides stand for."""
    used = {row.policy for row in rows}
    as_it_is = {} if context.controlled else {"passive": "the damper as it is"}
    names = [f"{name}: {as_it_is.get(name, policy.meaning)}" for name, policy in policies().items() if name in used]
    exact = {row.fidelity for row in rows}
    fidelities = _FIDELITIES if context.controlled else _UNCONTROLLED_FIDELITIES
    names += [f"{name}: {text}" for name, text in fidelities.items() if name in exact]
    if context.controlled and exact - {"ideal"}:
        names += [*_sensors(context.simulate), *_supply(context)]
    return (Notes(tuple(names)),) if names else ()


def _sensors(config: SimulateConfig) -> Iterator[str]:
    """What the controllers see, where that is not all."""
    sensors, noise = config.sensors, config.sensors.noise
    if sensors == Sensors():
        return
    period = sensors.period_s or config.control_period_s
    told = [f"a sample every {amount(1000.0 * period, 'ms')}, {amount(1000.0 * sensors.delay_s, 'ms')} late"]
    deviations = (
        ("deflection", 1000.0 * noise.deflection_m, "mm"),
        ("its rate", noise.deflection_rate_m_per_s, "m/s"),
        ("height", 1000.0 * noise.heave_m, "mm"),
        ("pitch", 1000.0 * noise.pitch_rad, "mrad"),
        ("vertical speed", noise.heave_rate_m_per_s, "m/s"),
        ("pitch rate", 1000.0 * noise.pitch_rate_rad_per_s, "mrad/s"),
        ("acceleration", noise.acceleration_m_per_s2, "m/s2"),
    )
    noisy = [f"{name} {amount(size, unit)}" for name, size, unit in deviations if size > 0.0]
    told += [f"with noise of {listed(noisy)} r.m.s."] if noisy else []
    yield f"sensors, at table and dynamic: {' '.join(told)}"


def _supply(context: ReportContext) -> Iterator[str]:
    """What becomes of the voltage that the controllers ask for, where it is not set at once."""
    supply, unit = context.simulate.supply, context.control.unit
    told = []
    if supply.step is not None:
        told.append(f"sets values {amount(supply.step, unit)} apart")
    if supply.slew_per_s is not None:
        told.append(f"changes by {amount(supply.slew_per_s, f'{unit}/s')} at most")
    if supply.power_W is not None and supply.capacitance_F is not None:
        told.append(f"charges {amount(1e6 * supply.capacitance_F, 'uF')} with {amount(supply.power_W, 'W')}")
    if told:
        yield f"supply of an axle, at table and dynamic: {listed(told)}"


# ----------------------------------------------------------------------------------------------------
# Which policy to choose: all of them beside each other, road by road.


def trade_off_blocks(context: ReportContext, pictures: Pictures) -> Iterator[Block]:
    """Words, pictures and a table; nothing where fewer than two policies control."""
    shown = {road: rows for road in context.rated.roads if (rows := context.rated.trade_off(road))}
    if not shown:
        return
    yield Paragraph(
        "All policies beside each other: to the left the road feels less of the car, below the passenger feels less of "
        "the road. Square: the policy that the rest of this page is about; triangles: others that control; circles: "
        "what is held. The dotted line joins those that none beats in both:"
    )
    yield Notes(tuple(f"{road}, {rows[0].fidelity}: {_names(context, rows)}" for road, rows in shown.items()))
    found = tuple(text for road, rows in shown.items() if (text := _best_found(context, road, rows)))
    if found:
        own = context.simulate.best_found
        yield Paragraph(
            f"Star: the best that was found, with a wheel load at most {number(own.most_load)} times that at the best "
            f"fixed voltage. A search tried up to {own.evaluations} schedules of voltage on each road; there may be "
            "better ones."
        )
        yield Notes(found)
    yield from galleries(pictures["policies"])
    yield _table(context, tuple(shown))


def _names(context: ReportContext, rows: tuple[SummaryRow, ...]) -> str:
    return listed([spelled(row.policy) for row in context.rated.pareto_front(rows)])


def _best_found(context: ReportContext, road: str, rows: tuple[SummaryRow, ...]) -> str:
    """Who found the best ride over a road, and how far the policy of this page goes towards it; empty without one."""
    by_name = {row.policy: row for row in rows}
    fixed, best = by_name.get("best_fixed_voltage"), by_name.get("best_found")
    if best is None:
        return ""
    found = next(row for row in context.rides.found if row.case == best.case)
    by = f"a schedule, after {found.evaluations} rides" if found.found_by == "search" else spelled(found.found_by)
    told = f"{road}: a_w {amount(context.rated.a_w(best), 'm/s2')}, by {by}"
    mine = next((row for row in rows if context.simulate.is_controlled(row.policy)), None)
    if fixed is None or mine is None or context.rated.a_w(best) >= context.rated.a_w(fixed):
        return told
    way = (context.rated.a_w(fixed) - context.rated.a_w(mine)) / (context.rated.a_w(fixed) - context.rated.a_w(best))
    if way <= 0.0:
        return f"{told}; {spelled(mine.policy)} is no better than the best fixed voltage"
    return f"{told}; {spelled(mine.policy)} goes {percent(way)} of the way to it from the best fixed voltage"


def _table(context: ReportContext, roads: tuple[str, ...]) -> TextTable:
    ridden = {row.fidelity for road in roads for row in context.rated.over(road)}
    fidelities = [name for name in reversed(REALISTIC) if name in ridden]
    header = ("road", "policy", *(f"a_w, {name}" for name in fidelities), *(f"load, {name}" for name in fidelities))
    rows = tuple(_row(context, road, policy, fidelities) for road in roads for policy in _policies(context, road))
    return TextTable("Comfort and r.m.s. wheel load of every policy, by fidelity", header, rows, folded=True)


def _policies(context: ReportContext, road: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(row.policy for row in context.rated.over(road)))


def _row(context: ReportContext, road: str, policy: str, fidelities: list[str]) -> tuple[str, ...]:
    found = {row.fidelity: row for row in context.rated.over(road) if row.policy == policy}
    ridden = [found.get(name) for name in fidelities]
    return (
        road,
        spelled(policy),
        *(amount(None if row is None else context.rated.a_w(row), "m/s2") for row in ridden),
        *(amount(None if row is None else row.rms_wheel_load_N, "N") for row in ridden),
    )


# ----------------------------------------------------------------------------------------------------


COMFORT_TIME = "exposure_time_reduced_comfort"


_SAME = 0.0005
"""A change of a smaller share is none."""


def render(context: ReportContext, pictures: Pictures) -> Section:
    """The fifth section."""
    blocks: list[Block] = [Paragraph(_ride(context)), *meanings(context, _all(context))]
    blocks += _compared(context)
    blocks += by_turns(pictures["passenger"])
    blocks += trade_off_blocks(context, pictures)
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
    spans = {ride.row.road: ride.ridden for ride in context.rated.rides if ride.of_event}
    if any(not ride.of_event for ride in context.rated.rides):
        other = " over the other roads" if spans else ""
        yield f"The first {amount(context.simulate.settle_s, 's')} of each ride{other} are left out."
    for road, span in spans.items():
        yield (
            f"The numbers on {road} are taken from {amount(span.from_s, 's')}, when axle 1 meets it, to "
            f"{amount(span.to_s, 's')}, when the motion of every ride over it has died away or falls no further."
        )


def _compared(context: ReportContext) -> Iterator[Block]:
    """The controlled policy beside every other at the same fidelity."""
    found = [one for road in context.rated.roads for one in context.rated.comparisons(road)]
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
        context.rated.policy_label(other),
        amount(context.rated.a_w(mine), "m/s2"),
        amount(context.rated.a_w(other), "m/s2"),
        change(context.rated.a_w(other), context.rated.a_w(mine)),
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
    return [row for road in context.rated.roads for row in context.rated.over(road)]


def _accelerations(context: ReportContext) -> TextTable:
    header = ("road", "dampers", "peak |a_K|", "r.m.s.", "a_w", "MTVV", "VDV", "crest factor", "likely to be felt as")
    rows = tuple(
        (
            row.road,
            context.rated.label(row),
            amount(row.peak_abs_aK_m_per_s2, "m/s2"),
            amount(row.rms_aK_m_per_s2, "m/s2"),
            *(amount(context.rated.value(row.case, name), unit) for name, unit in _WEIGHTED),
            _weighted_values(context, row),
        )
        for row in _all(context)
    )
    return TextTable(
        "Acceleration at K (a_w, MTVV, VDV and crest factor weighted by Wk, ISO 2631-1:1997)", header, rows
    )


_WEIGHTED = (("a_w", "m/s2"), ("MTVV", "m/s2"), ("VDV", "m/s^1.75"), ("crest_factor", "-"))


def _weighted_values(context: ReportContext, row: SummaryRow) -> str:
    a_w = context.rated.value(row.case, "a_w")
    return DASH if a_w is None else " to ".join(reaction.text for reaction in iso2631_1997.reactions(a_w))


def _exposures(context: ReportContext) -> Iterator[TextTable]:
    if iso2631_1978.EDITION not in context.config.editions:
        return
    rows = tuple(
        (
            row.road,
            context.rated.label(row),
            *(minutes(context.rated.value(row.case, f"exposure_time_{boundary}")) for boundary in iso2631_1978.FACTORS),
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
    row = context.rated.measures.get((case, COMFORT_TIME))
    return "" if row is None else row.status.removeprefix(f"{iso2631_1978.TRUST}; ")


def _suspension(context: ReportContext) -> TextTable:
    header = ("road", "dampers", "deflection", "wheel load, r.m.s.", "jerk, r.m.s.", "dissipated")
    rows = tuple(
        (
            row.road,
            context.rated.label(row),
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
            context.rated.label(row),
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
            context.rated.label(row),
            amount(context.rated.value(row.case, "A(8)"), "m/s2"),
            amount(context.rated.value(row.case, "VDV_day"), "m/s^1.75"),
            *(amount(context.rated.value(row.case, f"time_to_{name}_value"), "h") for name in ("action", "limit")),
        )
        for row in _all(context)
    )
    yield TextTable(
        f"{directive.EDITION}, {number(context.config.daily_exposure_h)} h a day, vertical direction only", header, rows
    )


def _worth(context: ReportContext) -> TextTable:
    pairs = [(row, other) for row in _all(context) if (other := context.rated.on_baseline(row)) is not None]
    rows = tuple(
        (
            row.road,
            context.rated.label(row),
            *(amount(each.peak_abs_aK_m_per_s2, "m/s2") for each in (other, row)),
            *(amount(context.rated.value(each.case, "a_w"), "m/s2") for each in (other, row)),
            *(minutes(context.rated.value(each.case, COMFORT_TIME)) for each in (other, row)),
        )
        for row, other in pairs
    )
    header = ("road", "dampers", "peak without", "peak with", "a_w without", "a_w with", "time without", "time with")
    return TextTable("With and without the missing effect (time: reduced comfort)", header, rows)


def _beyond(context: ReportContext) -> Iterator[str]:
    for ride in context.rated.rides:
        found = ride.evaluation.beyond
        if found and iso2631_1997.EDITION in context.config.editions:
            yield f"{ride.row.case}: {'; '.join(found)}"
