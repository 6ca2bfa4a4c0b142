"""Pictures as a block, where there are any."""

from __future__ import annotations

from pzd.report.blocks import Gallery, Picture


def gallery(pictures: tuple[Picture, ...]) -> tuple[Gallery, ...]:
    """One gallery of the pictures; none where there are none."""
    return (Gallery(pictures),) if pictures else ()
