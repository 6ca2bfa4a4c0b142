"""How far to trust it, what was expected, and how it was made."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.artefacts import ENERGY_LIMIT, ParameterRow, ReferenceRow
from pzd.comfort import directive, iso2631_1978, iso2631_1997
from pzd.damper.confounders import known
from pzd.damper.effect import Effect
from pzd.report import tables
from pzd.report.blocks import Block, Notes, Paragraph, Section, amount, number, percent
from pzd.report.columns import Column, Quantity, Table
from pzd.report.context import ReportContext
from pzd.schema.errors import counted

_MUCH = 0.01
"""From this share of a ride on, leaving the table or the road is worth a sentence."""

# --- Expected numbers beside those of the run ---


def render_expected(context: ReportContext) -> tuple[Section, ...]:
    """Return the section of the expected numbers; none where the config names no such list."""
    reference = context.expected
    if reference is None:
        return ()
    met = sum(row.computed is not None for row in reference)
    text = f"Expected numbers in {context.config.reference}: {len(reference)}, of which the run computes {met}."
    sheet = Table(
        "Expected and computed",
        (
            Column("id", "number"),
            Column("expected", "expected", value=_expected, digits=4),
            Column("computed", "computed", value=lambda row: Quantity(row.computed, row.unit), digits=4),
            Column("ratio", "ratio", digits=4),
            Column("note", "note"),
        ),
        reference,
        tables.FOLD,
    )
    return (Section("expected", "What was expected", (Paragraph(text), sheet.block())),)


def _expected(row: ReferenceRow) -> str | Quantity:
    """Return the expected number; a range stands as text."""
    return f"{row.expected} {row.unit}" if isinstance(row.expected, str) else Quantity(row.expected, row.unit)


# --- Marks, energy balance, boundaries, and what lies outside of the table ---


def render(context: ReportContext) -> Section:
    """Return the section on marks and caveats."""
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
    if ridden:
        columns = (
            Column("case", "ride"),
            Column("energy_error", "energy error / energy that flows", digits=2),
            tables.share("outside_table", "time outside of the rig's range"),
        )
        blocks.append(Table("Energy balance and table", columns, context.rides.summary, fold=0).block())
    return Section("trust", "How far to trust it", tuple(blocks))


def _beyond_stroke(context: ReportContext) -> Iterator[str]:
    """Say which rides go farther than any test did, and which adopted effects depend on that."""
    tested, ratio = context.table.notes.reached_stroke_m, max(context.simulate.car.car().motion_ratios)
    with_damper = [row for row in context.rides.summary if row.fidelity != "ideal"]
    beyond = [row for row in with_damper if tested is not None and ratio * row.peak_deflection_m > tested]
    if tested is None or not beyond:
        return
    worst = max(beyond, key=lambda row: row.peak_deflection_m)
    of_stroke = [name for name in context.diagnosed.damper.effects if _goes_with_displacement(known()[name])]
    does = f"; there no test shows what {' and '.join(of_stroke)} does" if of_stroke else ""
    yield (
        f"{len(beyond)} rides go farther than any test did ({number(tested)} m from the middle of the stroke), "
        f"{worst.case} to {number(ratio * worst.peak_deflection_m)} m{does}"
    )


def _goes_with_displacement(effect: Effect) -> bool:
    """Whether a force beside the element goes with the displacement: some parameter has a length, and none a time."""
    lengths = {"m", "N/m", "N/m2", "N/m3"}
    return effect.place == "parallel" and any(parameter.unit in lengths for parameter in effect.parameters)


def _cares(context: ReportContext) -> Iterator[str]:
    weak = [
        row
        for row in context.damper.final_parameters
        if isinstance(row, ParameterRow) and row.status.startswith("weak")
    ]
    if weak:
        total = len(context.damper.final_parameters)
        yield f"{len(weak)} of {total} conditions hold a parameter that the data determine weakly"
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
    yield from _beyond_stroke(context)
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


# --- How it was made: the stages, the methods, the sources ---

_RIDE = "simulate: the half-car of the paper, equations (5) to (12), with an energy balance (5-simulate)"
_STAGES = (
    "rig: records in SI units, checked, never corrected unasked (1-rig)",
    "identify: T0, C and k of every condition by the global optimum of the paper's criterion (4) (2-identify)",
    "diagnose: where the gap lies and which effect of the library closes it, judged on held-out data (3-diagnose)",
)
_SOURCES = {
    iso2631_1997.EDITION: "weighting Wk by its exact frequency response over the whole ride from rest, so that neither "
    "sampling nor the start bends it; measures and conditions verified against independent sources",
    iso2631_1978.EDITION: "boundaries a_z interpolated log-log; a tone at its own frequency, a periodic ride harmonic "
    f"by harmonic, any other by third-octave bands, the shortest time counting; {iso2631_1978.TRUST}",
    directive.EDITION: "A(8) and the daily dose from the vertical direction alone; values verified",
}
_LINE = "One straight line of stages; each writes the files that the next one reads, in the folders beside this page's:"
_SIGNS = (
    "Extension (rebound) is positive for displacement, velocity and force; force times velocity above zero "
    "dissipates. The same input and seed give the same bytes; versions and times stand in each manifest.json."
)


def render_provenance(context: ReportContext) -> Section:
    """Return the section on stages and sources."""
    axes = (
        "temperature, control signal and velocity, and its inverse"
        if context.controlled
        else "temperature and velocity"
    )
    stages = (
        *_STAGES,
        f"table: force over {axes} (4-table)",
        *([_RIDE] if context.ridden else []),
        f"report: this page{' and comfort.csv' if context.ridden else ''} (6-report)",
    )
    sources = tuple(f"{edition}: {_SOURCES[edition]}" for edition in context.config.editions)
    standards = (Paragraph("Standards:"), Notes(sources)) if context.ridden else ()
    return Section("made", "How it was made", (Paragraph(_LINE), Notes(stages), *standards, Paragraph(_SIGNS)))
