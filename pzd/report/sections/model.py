"""Where the simple model fails: measured against simulated, and where the gap lies."""

from __future__ import annotations

from pzd.artefacts import Gap
from pzd.report.blocks import Block, Paragraph, Section, TextTable
from pzd.report.context import ReportContext
from pzd.report.sections.pictures import Pictures, galleries
from pzd.report.wording import number, percent


def render(context: ReportContext, pictures: Pictures) -> Section:
    """The second section."""
    element = (
        "The knee law has dry friction T0, and bleed, knee and blow-off of each direction"
        if context.fitted_law
        else "The simple model is the Bingham element of the paper: dry friction T0 and viscous damping C"
    )
    text = f"{element} in series with the oil spring k. {_gap(context.diagnosed.diagnosis.gap)}"
    blocks: list[Block] = [Paragraph(text), *galleries(pictures["model"])]
    where = context.diagnosed.diagnosis.where
    if where:
        rows = tuple((region.region, percent(region.share_of_gap)) for region in where)
        blocks.append(TextTable("Where the gap lies", ("region", "share of the gap"), rows))
    return Section("model", f"Where the {context.model} fails", tuple(blocks))


def _gap(gap: Gap | None) -> str:
    if gap is None:
        return "How far it misses the measured force could not be measured."
    return (
        f"On data that no fit has seen it leaves W_s = {number(gap.before)}, where noise alone would "
        f"leave {number(gap.noise_floor)}. W_s is a share of the mean square of the force; in r.m.s. the model misses "
        f"{percent(gap.before**0.5)} of the force, and noise alone would be {percent(gap.noise_floor**0.5)}."
    )
