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
from pzd.simulate.config import Sensors, SimulateConfig
from pzd.simulate.policies import policies
from pzd.simulate.study.plan import REALISTIC
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
_WEIGHTED = (("MTVV", "m/s2"), ("VDV", "m/s^1.75"), ("crest_factor", "-"))
"""Weighted measures of a ride beside a_w, with their units."""


def render(context: ReportContext, pictures: Pictures) -> Section:
    """Return the section on the rides."""
    blocks: list[Block] = [Paragraph(_ride(context)), *_meanings(context, _all(context))]
    blocks += by_turns(pictures["passenger"])
    blocks += _trade_off_blocks(context, pictures)
    blocks += _rides(context)
    blocks += [_modes(context)]
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
    names = [
        f"{spelled(name)}: {as_it_is.get(name, policy.meaning)}" for name, policy in policies().items() if name in used
    ]
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


# --- Changes in words ---


SAME = "the same"
"""What `change` says where nothing changed."""


def change(before: float, after: float) -> str:
    """Return a change in percent, in words."""
    if before == 0.0:
        return DASH
    share = after / before - 1.0
    if abs(share) < _SAME:
        return SAME
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


# --- The rides: a table a road and fidelity, the policies side by side ---


def _rides(context: ReportContext) -> Iterator[Block]:
    """Yield the rides road by road, those at the most realistic fidelity open and the others folded."""
    shown = [
        (road, fidelity, tuple(row for row in context.rated.over(road) if row.fidelity == fidelity))
        for road in context.rated.roads
        for fidelity in REALISTIC
    ]
    rows_at = {(road, fidelity): rows for road, fidelity, rows in shown if rows}
    if not rows_at:
        return
    yield Paragraph(_how_rated(context))
    opened = {road: min(REALISTIC.index(each) for of, each in rows_at if of == road) for road, _ in rows_at}
    for (road, fidelity), rows in rows_at.items():
        title = f"{context.rated.road_label(road)}, {fidelity}"
        fold = None if REALISTIC[opened[road]] == fidelity else 0
        columns = (Column("policy", "policy", value=context.rated.policy_label), *_measures(context, rows))
        yield Table(title, columns, rows, fold).across()


def _how_rated(context: ReportContext) -> str:
    """Return by what the rides are rated, and what of a table needs a word."""
    texts = []
    if iso2631_1997.EDITION in context.config.editions:
        texts.append(f"a_w, MTVV, VDV and crest factor are weighted by Wk ({iso2631_1997.EDITION}).")
    if iso2631_1978.EDITION in context.config.editions:
        texts.append(
            f"Exposure times: {iso2631_1978.EDITION}, {iso2631_1978.TRUST}; comfort.csv says what governs them."
        )
    if directive.EDITION in context.config.editions:
        hours = number(context.config.daily_exposure_h)
        texts.append(f"A(8) and what follows: {directive.EDITION}, {hours} h a day, vertical direction only.")
    if any(context.rated.on_baseline(row) for row in _all(context)):
        texts.append("Without the missing effect: the same rides on the damper before diagnose.")
    if context.rides.wheels:
        mass = context.simulate.car.car().wheels_have_mass
        made = "of the tyre" if mass else "the static load less the force of spring and damper"
        first = context.rides.wheels[0].case
        at_rest = [amount(wheel.static_load_N, "N") for wheel in context.rides.wheels if wheel.case == first]
        texts.append(f"Force between wheel and road: {made}, at rest {listed(at_rest)}.")
    searched = "What the best fixed voltage and the best constant c hold was searched for on each road and fidelity."
    return " ".join([*texts, *([searched] if any(row.policy.startswith("best_") for row in _all(context)) else [])])


def _measures(context: ReportContext, rows: Sequence[SummaryRow]) -> Iterator[Column]:
    """Yield the measures of rides at one fidelity over one road, a line each; those that no ride has stay away."""
    editions = context.config.editions
    if iso2631_1997.EDITION in editions:
        yield from _weighted(context, rows)
    yield Column("peak_abs_aK_m_per_s2", "peak |a_K|", "m/s2")
    yield Column("rms_aK_m_per_s2", "r.m.s. a_K", "m/s2")
    yield Column("rms_wheel_load_N", "wheel load, r.m.s.", "N")
    yield from _changed(context, rows, "wheel load", lambda row: row.rms_wheel_load_N)
    yield Column("peak_deflection_m", "travel", "mm", factor=1000.0)
    yield from _changed(context, rows, "travel", lambda row: row.peak_deflection_m)
    yield Column("rms_jerk_m_per_s3", "jerk, r.m.s.", "m/s3")
    yield Column("dissipated_J", "dissipated", "J")
    yield from _of_wheels(context)
    if iso2631_1978.EDITION in editions:
        for boundary in iso2631_1978.FACTORS:
            yield _measure(context, f"exposure_time_{boundary}", f"{boundary.replace('_', ' ')} after", "min", minutes)
        yield _without(context, COMFORT_TIME, "reduced comfort after", "min", minutes)
    if directive.EDITION in editions:
        yield _measure(context, "A(8)", "A(8)", "m/s2")
        yield _measure(context, "VDV_day", "VDV of the day", "m/s^1.75")
        yield _measure(context, "time_to_action_value", "action value after", "h")
        yield _measure(context, "time_to_limit_value", "limit value after", "h")


def _weighted(context: ReportContext, rows: Sequence[SummaryRow]) -> Iterator[Column]:
    yield _measure(context, "a_w", "a_w", "m/s2")
    yield from _changed(context, rows, "a_w", context.rated.a_w)
    yield _without(context, "a_w", "a_w", "m/s2")
    yield Column("reaction", "likely to be felt as", value=lambda row: _reaction(context.rated.a_w(row)))
    for name, unit in _WEIGHTED:
        yield _measure(context, name, name.replace("_", " ") if unit == "-" else name, unit)


def _measure(
    context: ReportContext, measure: str, head: str, unit: str, words: Callable[[Any], str] | None = None
) -> Column:
    """Return a comfort measure of the rides."""
    return Column(measure, head, unit, lambda row: context.rated.value(row.case, measure), words=words)


def _without(
    context: ReportContext, measure: str, head: str, unit: str, words: Callable[[Any], str] | None = None
) -> Column:
    """Return a comfort measure of the same rides on the damper before diagnose; left out where there are none."""

    def value(row: SummaryRow) -> Cell:
        other = context.rated.on_baseline(row)
        return None if other is None else context.rated.value(other.case, measure)

    return Column(f"{measure}_without", f"without the missing effect: {head}", unit, value, optional=True, words=words)


def _changed(
    context: ReportContext, rows: Sequence[SummaryRow], head: str, of: Callable[[SummaryRow], float]
) -> Iterator[Column]:
    """Yield the change of a measure beside the strongest of the policies that do not control, where one was ridden."""
    reference = context.rated.held(rows)
    if reference is not None and len(rows) > 1:
        name = context.rated.policy_name(reference)

        def value(row: SummaryRow) -> Cell:
            return None if row is reference else change(of(reference), of(row))

        yield Column(f"{head}_change", f"{head} beside {name}", value=value)


def _reaction(a_w: float) -> str:
    return " to ".join(reaction.text for reaction in iso2631_1997.reactions(a_w))


def _of_wheels(context: ReportContext) -> Iterator[Column]:
    """Yield the least force between wheel and road of each axle, and how long none is left."""
    by_case: dict[str, dict[int, WheelRow]] = {}
    for wheel in context.rides.wheels:
        by_case.setdefault(wheel.case, {})[wheel.axle] = wheel
    mass = context.simulate.car.car().wheels_have_mass
    without = "off the road (at 0)" if mass else "pulling on the road (at 0 or below)"

    def of_axle(axle: int, name: str) -> Callable[[SummaryRow], Cell]:
        def cell(row: SummaryRow) -> Cell:
            wheel = by_case.get(row.case, {}).get(axle)
            return None if wheel is None else float(getattr(wheel, name))

        return cell

    for axle in sorted({wheel.axle for wheel in context.rides.wheels}):
        yield Column(
            f"min_{axle}_N", f"least force on the road, axle {axle}", "N", of_axle(axle, "min_contact_force_N")
        )
        yield tables.share(f"pulling_{axle}", f"{without}, axle {axle}", of_axle(axle, "pulling"))


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


def _beyond(context: ReportContext) -> Iterator[str]:
    for ride in context.rated.rides:
        found = ride.evaluation.beyond
        if found and iso2631_1997.EDITION in context.config.editions:
            yield f"{ride.row.case}: {'; '.join(found)}"
