"""Which policy to choose: all of them beside each other, road by road."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.artefacts import SummaryRow
from pzd.report.blocks import Block, Notes, Paragraph, TextTable
from pzd.report.context import REALISTIC, ReportContext
from pzd.report.sections.pictures import Pictures, galleries
from pzd.report.trade_off import name_of, of_road, unbeaten
from pzd.report.wording import amount, listed


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
    yield from galleries(pictures["policies"])
    yield _table(context, tuple(shown))


def _names(context: ReportContext, rows: tuple[SummaryRow, ...]) -> str:
    return listed([name_of(row.policy) for row in unbeaten(context, rows)])


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
