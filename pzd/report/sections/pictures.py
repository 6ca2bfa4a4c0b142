"""Pictures as blocks: those of one kind stay together, three to a row."""

from __future__ import annotations

from collections.abc import Mapping

from pzd.report.blocks import Gallery, Picture

Pictures = Mapping[str, tuple[tuple[Picture, ...], ...]]
"""By place on the page, then by kind."""

_ROW = 3


def galleries(kinds: tuple[tuple[Picture, ...], ...]) -> tuple[Gallery, ...]:
    """Rows of pictures; a kind goes into the row before it where it fits in whole."""
    rows: list[tuple[Picture, ...]] = []
    for pictures in kinds:
        if rows and len(rows[-1]) + len(pictures) <= _ROW:
            rows[-1] += pictures
        elif pictures:
            rows.append(pictures)
    return tuple(Gallery(row) for row in rows)
