"""Where the simple model fails: measured against simulated, and where the gap lies."""

from __future__ import annotations

from pzd.report.blocks import Block, Paragraph, Picture, Section, Sheet
from pzd.report.sections.pictures import gallery
from pzd.report.story import Story
from pzd.report.wording import number, percent


def tell(story: Story, pictures: dict[str, tuple[Picture, ...]]) -> Section:
    """The second section."""
    gap = story.diagnosed.diagnosis.gap
    text = (
        "The simple model is the Bingham element of the paper: dry friction T0 and viscous damping C in series with "
        f"the oil spring k. On data that no fit has seen it leaves W_s = {number(gap.before)} (share of the mean square of the force), "
        f"where noise alone would leave {number(gap.noise_floor)}: an r.m.s. miss of {percent(gap.before**0.5)} of the force, "
        f"{percent(max(gap.before - gap.noise_floor, 0.0) ** 0.5)} of it beyond the noise."
    )
    blocks: list[Block] = [Paragraph(text), *gallery(pictures["model"])]
    where = story.diagnosed.diagnosis.where
    if where:
        rows = tuple((region.region, percent(region.share_of_gap)) for region in where)
        blocks.append(Sheet("Where the gap lies", ("region", "share of the gap"), rows))
    return Section("model", "Where the simple model fails", tuple(blocks))
