"""Which policy to choose: all of them beside each other, road by road."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.artefacts import SummaryRow
from pzd.report.blocks import Block, Notes, Paragraph, TextTable
from pzd.report.context import REALISTIC, ReportContext
from pzd.report.sections.pictures import Pictures, galleries
from pzd.report.trade_off import name_of, of_road, unbeaten
from pzd.report.wording import amount, listed, number, percent


def blocks(context: ReportContext, pictures: Pictures) -> Iterator[Block]:
    """Words, pictures and a table; nothing where fewer than two policies control."""
    shown = {road: rows for road in context.roads if (rows := of_road(context, road))}
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
    return listed([name_of(row.policy) for row in unbeaten(context, rows)])


def _best_found(context: ReportContext, road: str, rows: tuple[SummaryRow, ...]) -> str:
    """Who found the best ride over a road, and how far the policy of this page goes towards it; empty without one."""
    by_name = {row.policy: row for row in rows}
    fixed, best = by_name.get("best_fixed_voltage"), by_name.get("best_found")
    if best is None:
        return ""
    found = next(row for row in context.rides.found if row.case == best.case)
    by = f"a schedule, after {found.evaluations} rides" if found.found_by == "search" else name_of(found.found_by)
    told = f"{road}: a_w {amount(context.a_w(best), 'm/s2')}, by {by}"
    mine = next((row for row in rows if context.simulate.is_controlled(row.policy)), None)
    if fixed is None or mine is None or context.a_w(best) >= context.a_w(fixed):
        return told
    way = (context.a_w(fixed) - context.a_w(mine)) / (context.a_w(fixed) - context.a_w(best))
    if way <= 0.0:
        return f"{told}; {name_of(mine.policy)} is no better than the best fixed voltage"
    return f"{told}; {name_of(mine.policy)} goes {percent(way)} of the way to it from the best fixed voltage"


def _table(context: ReportContext, roads: tuple[str, ...]) -> TextTable:
    ridden = {row.fidelity for road in roads for row in context.cases(road)}
    fidelities = [name for name in reversed(REALISTIC) if name in ridden]
    header = ("road", "policy", *(f"a_w, {name}" for name in fidelities), *(f"load, {name}" for name in fidelities))
    rows = tuple(_row(context, road, policy, fidelities) for road in roads for policy in _policies(context, road))
    return TextTable("Comfort and r.m.s. wheel load of every policy, by fidelity", header, rows, folded=True)


def _policies(context: ReportContext, road: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(row.policy for row in context.cases(road)))


def _row(context: ReportContext, road: str, policy: str, fidelities: list[str]) -> tuple[str, ...]:
    found = {row.fidelity: row for row in context.cases(road) if row.policy == policy}
    ridden = [found.get(name) for name in fidelities]
    return (
        road,
        name_of(policy),
        *(amount(None if row is None else context.a_w(row), "m/s2") for row in ridden),
        *(amount(None if row is None else row.rms_wheel_load_N, "N") for row in ridden),
    )
