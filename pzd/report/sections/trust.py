"""How far to trust it: marks, energy balance, boundaries, and what lies outside of the table."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.artefacts import ENERGY_LIMIT, ParameterRow
from pzd.comfort import iso2631_1978
from pzd.report.blocks import Block, Notes, Paragraph, Section, TextTable
from pzd.report.context import ReportContext
from pzd.report.wording import amount, number, percent
from pzd.schema.wording import counted

_MUCH = 0.01


def render(context: ReportContext) -> Section:
    """The sixth section."""
    ridden = context.ridden
    marks = (*context.identified.untrusted(context.control), *context.rides.untrusted(context.control))
    blocks: list[Block] = []
    if marks:
        blocks += [Paragraph("These results are not to be trusted as they stand:"), Notes(marks, "care")]
    else:
        balance = f", and the energy of every ride balances to {number(ENERGY_LIMIT)} or better" if ridden else ""
        text = f"T0 and C are determined everywhere{balance}."
        blocks.append(Notes((text,), "good"))
    cares = tuple(_cares(context))
    if cares:
        blocks += [Paragraph("To be kept in mind:"), Notes(cares, "care")]
    blocks += [_balance(context)] if ridden else []
    return Section("trust", "How far to trust it", tuple(blocks))


def _cares(context: ReportContext) -> Iterator[str]:
    weak = [row for row in context.final if isinstance(row, ParameterRow) and row.status.startswith("weak")]
    if weak:
        yield f"{len(weak)} of {len(context.final)} conditions hold a parameter that the data determine weakly"
    if context.diagnosed.diagnosis.verdict == "unexplained":
        carry = "rides carry" if context.ridden else "table carries"
        yield f"part of the measured force is repeatable and not explained; the {carry} that gap"
    if context.diagnosed.diagnosis.verdict == "ambiguous":
        change = "rides" if context.ridden else "table"
        yield f"which effect is missing is not settled; another one would change the {change}"
    beyond = [row for row in context.rides.summary if row.outside_table > _MUCH]
    if beyond:
        worst = max(beyond, key=lambda row: row.outside_table)
        does = {
            "clamp": "the force is held there",
            "error": "the table is empty there",
            "model": "the model goes on there",
        }
        yield (
            f"{len(beyond)} rides leave what the rig reached ({number(context.table.notes.reached_m_per_s)} m/s), "
            f"{worst.case} for {percent(worst.outside_table)} of its time: "
            f"{does[context.table.notes.outside]}, untested"
        )
    pulling = [row for row in context.rides.wheels if row.pulling > _MUCH]
    if pulling:
        axle = min(pulling, key=lambda row: row.min_contact_force_N)
        rides = len({row.case for row in pulling})
        if context.simulate.car.car().wheels_have_mass:
            axle = max(pulling, key=lambda row: row.pulling)
            yield (
                f"the wheels of {rides} rides leave the road, axle {axle.axle} of {axle.case} for "
                f"{percent(axle.pulling)} of its time"
            )
        else:
            yield (
                f"the wheels of {rides} rides pull on the road, which no wheel can; worst "
                f"axle {axle.axle} of {axle.case}: {amount(axle.min_contact_force_N, 'N')}, and "
                f"{percent(axle.pulling)} of its time; a real wheel would leave the road"
            )
    if context.ridden and iso2631_1978.EDITION in context.config.editions:
        yield f"the exposure times of {iso2631_1978.EDITION}, withdrawn in 1997, rest on an {iso2631_1978.TRUST}"
    findings = sum(len(entry.findings) for entry in context.rig.entries)
    if findings:
        yield f"the preflight left {counted(findings, 'finding')} on the records"
    if context.ridden:
        yield "vibration is judged in the vertical direction at point K only, without a seat"


def _balance(context: ReportContext) -> TextTable:
    rows = tuple(
        (row.case, number(row.energy_error, 2), percent(row.outside_table) if row.outside_table else "0 %")
        for row in context.rides.summary
    )
    return TextTable(
        "Energy balance and table", ("ride", "energy error / dissipated", "time outside of the rig's range"), rows, True
    )
