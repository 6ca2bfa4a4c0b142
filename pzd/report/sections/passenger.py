"""What the passenger feels: the rides, the controlled one beside the others, with and without the missing effect."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from pzd.artefacts import SummaryRow, WheelRow
from pzd.comfort import directive, iso2631_1978, iso2631_1997
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
    by_turns,
    galleries,
    listed,
    minutes,
    number,
    percent,
    spelled,
)
from pzd.report.columns import Cell, Column, Table
from pzd.report.context import ReportContext
from pzd.report.ride_comfort import REALISTIC
from pzd.simulate.config import Sensors, SimulateConfig
from pzd.simulate.policies import policies
from pzd.simulate.vehicle.car import modes

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

COMFORT_TIME = "exposure_time_reduced_comfort"
_SAME = 0.0005
"""A change of a smaller share is none."""
_WEIGHTED = (("a_w", "m/s2"), ("MTVV", "m/s2"), ("VDV", "m/s^1.75"), ("crest_factor", "-"))
"""Weighted measures of a ride, with their units."""


def render(context: ReportContext, pictures: Pictures) -> Section:
    """Return the section on the rides."""
    blocks: list[Block] = [Paragraph(_ride(context)), *_meanings(context, _all(context))]
    blocks += _compared(context)
    blocks += by_turns(pictures["passenger"])
    blocks += _trade_off_blocks(context, pictures)
    blocks += [_accelerations(context), _suspension(context), _wheels(context), _modes(context)]
    blocks += [*_exposures(context), *_daily(context)]
    blocks += _worth(context)
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
        masses = listed([number(mass) for mass in car.unsprung_masses])
        tyres = listed([number(k / 1000.0) for k in car.tyre_stiffnesses])
        wheels = f", wheels of {masses} kg on tyres of {tyres} kN/m"
    return (
        f"A half-car ({car.name}: {amount(car.mass, 'kg', 4)}, springs {springs} kN/m, wheelbase "
        f"{amount(car.wheelbase, 'm')}{wheels}) at {amount(config.vehicle_speed_km_per_h, 'km/h')}, judged at point K, "
        f"{amount(abs(car.comfort_point), 'm')} {'behind' if car.comfort_point > 0.0 else 'ahead of'} the centre of "
        f"gravity. {' '.join(_windows(context))}"
    )


def _windows(context: ReportContext) -> Iterator[str]:
    """Yield in which part of a ride its numbers are taken."""
    spans = {ride.row.road: ride.ridden for ride in context.rated.rides if ride.of_event}
    if any(not ride.of_event for ride in context.rated.rides):
        other = " over the other roads" if spans else ""
        yield f"The first {amount(context.simulate.settle_s, 's')} of each ride{other} are left out."
    for road, span in spans.items():
        yield (
            f"The numbers on {road} are taken from {amount(span.from_s, 's')}, when axle 1 meets it, to "
            f"{amount(span.to_s, 's')}, when the motion of every ride over it has died away or falls no further."
        )


def _all(context: ReportContext) -> list[SummaryRow]:
    return [row for road in context.rated.roads for row in context.rated.over(road)]


# --- What the names of policies and fidelities stand for, and what the controllers measure and set ---


def _meanings(context: ReportContext, rows: Sequence[SummaryRow]) -> tuple[Notes, ...]:
    """Return what the names of the policies and fidelities of some rides stand for."""
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
    """Yield what the controllers measure, where that is not all."""
    sensors, noise = config.sensors, config.sensors.noise
    if sensors == Sensors():
        return
    period = sensors.period_s or config.control_period_s
    words = [f"a sample every {amount(1000.0 * period, 'ms')}, {amount(1000.0 * sensors.delay_s, 'ms')} late"]
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
    words += [f"with noise of {listed(noisy)} r.m.s."] if noisy else []
    yield f"sensors, at table and dynamic: {' '.join(words)}"


def _supply(context: ReportContext) -> Iterator[str]:
    """Yield what limits the voltage that the controllers ask for, where it is not set at once."""
    supply, unit = context.simulate.supply, context.control.unit
    limits = []
    if supply.step is not None:
        limits.append(f"sets values {amount(supply.step, unit)} apart")
    if supply.slew_per_s is not None:
        limits.append(f"changes by {amount(supply.slew_per_s, f'{unit}/s')} at most")
    if supply.power_W is not None and supply.capacitance_F is not None:
        limits.append(f"charges {amount(1e6 * supply.capacitance_F, 'uF')} with {amount(supply.power_W, 'W')}")
    if limits:
        yield f"supply of an axle, at table and dynamic: {listed(limits)}"


# --- The controlled policy beside every other at the same fidelity ---


def _compared(context: ReportContext) -> Iterator[Block]:
    pairs = [
        (one.controlled, other)
        for road in context.rated.roads
        for one in context.rated.comparisons(road)
        for other in one.others
    ]
    if not pairs:
        return
    policy = pairs[0][0].policy
    yield Paragraph(
        f"The policy {policy} is compared with the others on the same road and at the same fidelity. What the "
        "best of the others hold constant was searched for on each road and at each fidelity, for the least a_w."
    )

    def changed(name: str, head: str, value: Callable[[SummaryRow], float]) -> Column:
        return Column(name, head, value=lambda pair: change(value(pair[1]), value(pair[0])))

    yield Table(
        f"The policy {policy} compared with the others at the same fidelity (a_w: ISO 2631-1:1997)",
        (
            Column("road", "road", value=lambda pair: pair[0].road),
            Column("fidelity", "fidelity", value=lambda pair: pair[0].fidelity),
            Column("beside", "compared with", value=lambda pair: context.rated.policy_label(pair[1])),
            Column("a_w", f"a_w {policy}", "m/s2", lambda pair: context.rated.a_w(pair[0])),
            Column("a_w_other", "a_w of the other", "m/s2", lambda pair: context.rated.a_w(pair[1])),
            changed("a_w_change", "change of a_w", context.rated.a_w),
            changed("load_change", "of wheel load", lambda row: row.rms_wheel_load_N),
            changed("travel_change", "of travel", lambda row: row.peak_deflection_m),
        ),
        pairs,
    ).block()


def change(before: float, after: float) -> str:
    """Return a change in percent, in words."""
    if before == 0.0:
        return DASH
    share = after / before - 1.0
    if abs(share) < _SAME:
        return "the same"
    return f"{percent(abs(share))} {'less' if share <= 0.0 else 'more'}"


# --- Which policy to choose: all of them beside each other, road by road ---


def _trade_off_blocks(context: ReportContext, pictures: Pictures) -> Iterator[Block]:
    """Yield words, pictures and a table; nothing where fewer than two policies control."""
    shown = {road: rows for road in context.rated.roads if (rows := context.rated.trade_off(road))}
    if not shown:
        return
    yield Paragraph(
        "All policies beside each other: to the left the road feels less of the car, below the passenger feels less of "
        "the road. Square: the policy that the rest of this page is about; triangles: others that control; circles: "
        "what is held. The dotted line joins those that none beats in both:"
    )
    fronts = {road: listed([spelled(row.policy) for row in context.rated.pareto_front(shown[road])]) for road in shown}
    yield Notes(tuple(f"{road}, {rows[0].fidelity}: {fronts[road]}" for road, rows in shown.items()))
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
    yield _all_policies(context, tuple(shown))


def _best_found(context: ReportContext, road: str, rows: tuple[SummaryRow, ...]) -> str:
    """Return who found the best ride over a road, and how far the policy of this page goes towards it."""
    by_name = {row.policy: row for row in rows}
    fixed, best = by_name.get("best_fixed_voltage"), by_name.get("best_found")
    if best is None:
        return ""
    found = next(row for row in context.rides.found if row.case == best.case)
    by = f"a schedule, after {found.evaluations} rides" if found.found_by == "search" else spelled(found.found_by)
    best_ride = f"{road}: a_w {amount(context.rated.a_w(best), 'm/s2')}, by {by}"
    mine = next((row for row in rows if context.simulate.is_controlled(row.policy)), None)
    if fixed is None or mine is None or context.rated.a_w(best) >= context.rated.a_w(fixed):
        return best_ride
    way = (context.rated.a_w(fixed) - context.rated.a_w(mine)) / (context.rated.a_w(fixed) - context.rated.a_w(best))
    if way <= 0.0:
        return f"{best_ride}; {spelled(mine.policy)} is no better than the best fixed voltage"
    return f"{best_ride}; {spelled(mine.policy)} goes {percent(way)} of the way to it from the best fixed voltage"


def _all_policies(context: ReportContext, roads: tuple[str, ...]) -> TextTable:
    ridden = {row.fidelity for road in roads for row in context.rated.over(road)}
    fidelities = [name for name in reversed(REALISTIC) if name in ridden]
    found: dict[tuple[str, str], dict[str, SummaryRow]] = {}
    for road in roads:
        for row in context.rated.over(road):
            found.setdefault((road, row.policy), {})[row.fidelity] = row

    def at(fidelity: str, name: str, unit: str, value: Callable[[SummaryRow], float]) -> Column:
        def cell(item: tuple[Any, dict[str, SummaryRow]]) -> Cell:
            return value(item[1][fidelity]) if fidelity in item[1] else None

        return Column(f"{name}_{fidelity}", f"{name}, {fidelity}", unit, cell)

    return Table(
        "Comfort and r.m.s. wheel load of every policy, by fidelity",
        (
            Column("road", "road", value=lambda item: item[0][0]),
            Column("policy", "policy", value=lambda item: spelled(item[0][1])),
            *(at(fidelity, "a_w", "m/s2", context.rated.a_w) for fidelity in fidelities),
            *(at(fidelity, "load", "N", lambda row: row.rms_wheel_load_N) for fidelity in fidelities),
        ),
        list(found.items()),
        fold=0,
    ).block()


# --- Tables of all rides ---


def _by_ride(context: ReportContext, of: Callable[[Any], SummaryRow] = lambda row: row) -> tuple[Column, Column]:
    """Return the columns that tell rides apart: the road, and what drove the dampers."""
    return (
        Column("road", "road", value=lambda row: of(row).road),
        Column("dampers", "dampers", value=lambda row: context.rated.label(of(row))),
    )


def _of_rides(context: ReportContext, title: str, *columns: Column) -> TextTable:
    """Return a table of all rides."""
    return Table(title, (*_by_ride(context), *columns), _all(context)).block()


def _measure(
    context: ReportContext, measure: str, head: str, unit: str, words: Callable[[Any], str] | None = None
) -> Column:
    """Return the column of a comfort measure."""
    return Column(measure, head, unit, lambda row: context.rated.value(row.case, measure), words=words)


def _accelerations(context: ReportContext) -> TextTable:
    def reaction(row: SummaryRow) -> str | None:
        a_w = context.rated.value(row.case, "a_w")
        return None if a_w is None else " to ".join(reaction.text for reaction in iso2631_1997.reactions(a_w))

    return _of_rides(
        context,
        "Acceleration at K (a_w, MTVV, VDV and crest factor weighted by Wk, ISO 2631-1:1997)",
        Column("peak_abs_aK_m_per_s2", "peak |a_K|", "m/s2"),
        Column("rms_aK_m_per_s2", "r.m.s.", "m/s2"),
        *(_measure(context, name, name.replace("_", " ") if unit == "-" else name, unit) for name, unit in _WEIGHTED),
        Column("reaction", "likely to be felt as", value=reaction),
    )


def _suspension(context: ReportContext) -> TextTable:
    return _of_rides(
        context,
        "What comfort costs: travel and wheel load",
        Column("peak_deflection_m", "deflection", "mm", factor=1000.0),
        Column("rms_wheel_load_N", "wheel load, r.m.s.", "N"),
        Column("rms_jerk_m_per_s3", "jerk, r.m.s.", "m/s3"),
        Column("dissipated_J", "dissipated", "J"),
    )


def _wheels(context: ReportContext) -> TextTable:
    """Return the contact forces, axles side by side; the load at rest stands in the caption."""
    by_case: dict[str, list[WheelRow]] = {}
    for wheel in context.rides.wheels:
        by_case.setdefault(wheel.case, []).append(wheel)
    rows = [(row, by_case[row.case]) for row in _all(context) if row.case in by_case]
    axles = rows[0][1] if rows else []
    mass = context.simulate.car.car().wheels_have_mass
    without = "off the road" if mass else "pulling"
    made = "the force of the tyre" if mass else "the static load less the force of spring and damper"
    share = "share of the time at 0" if mass else "share of the time at 0 or below"
    at_rest = listed([amount(wheel.static_load_N, "N") for wheel in axles])
    at = f" (at rest {at_rest}; {without}: {share})" if axles else ""

    def of_axle(place: int, name: str) -> Callable[[tuple[SummaryRow, list[WheelRow]]], Cell]:
        return lambda pair: float(getattr(pair[1][place], name))

    return Table(
        f"Force between wheel and road: {made}{at}",
        (
            *_by_ride(context, lambda pair: pair[0]),
            *(
                Column(f"min_{n}_N", f"least force, axle {wheel.axle}", "N", of_axle(n, "min_contact_force_N"))
                for n, wheel in enumerate(axles)
            ),
            *(
                tables.share(f"pulling_{n}", f"{without}, axle {wheel.axle}", of_axle(n, "pulling"))
                for n, wheel in enumerate(axles)
            ),
        ),
        rows,
    ).block()


def _modes(context: ReportContext) -> TextTable:
    """Return the modes of the car on dampers of the constant c."""
    c = context.simulate.constant_damping_Ns_per_m
    return Table(
        f"Modes of the car, with c = {amount(c, 'N s/m')} at each axle and the wheels on the road",
        (
            Column("name", "motion"),
            Column("frequency_Hz", "undamped frequency", "Hz"),
            Column("damping_ratio", "damping ratio"),
        ),
        modes(context.simulate.car.car(), c),
    ).block()


def _exposures(context: ReportContext) -> Iterator[TextTable]:
    if iso2631_1978.EDITION not in context.config.editions:
        return

    def status(row: SummaryRow) -> str:
        found = context.rated.measures.get((row.case, COMFORT_TIME))
        return "" if found is None else found.status.removeprefix(f"{iso2631_1978.TRUST}; ")

    yield _of_rides(
        context,
        f"Exposure times ({iso2631_1978.EDITION}, {iso2631_1978.TRUST})",
        *(
            _measure(context, f"exposure_time_{boundary}", boundary.replace("_", " "), "min", minutes)
            for boundary in iso2631_1978.FACTORS
        ),
        Column("status", "how (reduced comfort)", value=status),
    )


def _daily(context: ReportContext) -> Iterator[TextTable]:
    if directive.EDITION not in context.config.editions:
        return
    yield _of_rides(
        context,
        f"{directive.EDITION}, {number(context.config.daily_exposure_h)} h a day, vertical direction only",
        _measure(context, "A(8)", "A(8)", "m/s2"),
        _measure(context, "VDV_day", "VDV of the day", "m/s^1.75"),
        _measure(context, "time_to_action_value", "action value after", "h"),
        _measure(context, "time_to_limit_value", "limit value after", "h"),
    )


def _worth(context: ReportContext) -> Iterator[Block]:
    """Yield the rides with and without the missing effect; nothing where no effect was adopted."""
    pairs = [(other, row) for row in _all(context) if (other := context.rated.on_baseline(row)) is not None]
    if not pairs:
        return

    def both(name: str, unit: str, value: Callable[[SummaryRow], Cell], **more: Any) -> tuple[Column, Column]:
        return (
            Column(f"{name}_without", f"{name} without", unit, lambda pair: value(pair[0]), **more),
            Column(f"{name}_with", f"{name} with", unit, lambda pair: value(pair[1]), **more),
        )

    yield Paragraph("The same rides on the damper before anything was added to it: what the missing effect is worth.")
    yield Table(
        "With and without the missing effect (time: reduced comfort)",
        (
            *_by_ride(context, lambda pair: pair[1]),
            *both("peak", "m/s2", lambda row: row.peak_abs_aK_m_per_s2),
            *both("a_w", "m/s2", lambda row: context.rated.value(row.case, "a_w")),
            *both("time", "min", lambda row: context.rated.value(row.case, COMFORT_TIME), words=minutes),
        ),
        pairs,
    ).block()


def _beyond(context: ReportContext) -> Iterator[str]:
    for ride in context.rated.rides:
        found = ride.evaluation.beyond
        if found and iso2631_1997.EDITION in context.config.editions:
            yield f"{ride.row.case}: {'; '.join(found)}"
