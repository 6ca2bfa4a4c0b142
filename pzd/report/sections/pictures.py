"""Pictures as blocks, in rows."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import zip_longest

from pzd.report.blocks import Gallery, Picture

Pictures = Mapping[str, tuple[tuple[Picture, ...], ...]]
"""By place on the page, then by kind."""

_ROW = 3


def by_turns(kinds: tuple[tuple[Picture, ...], ...]) -> tuple[Gallery, ...]:
    """Rows of one picture of each kind: the first of all, then the second of all."""
    rows = (tuple(picture for picture in row if picture is not None) for row in zip_longest(*kinds))
    return tuple(Gallery(row) for row in rows if row)


def galleries(kinds: tuple[tuple[Picture, ...], ...]) -> tuple[Gallery, ...]:
    """Rows of up to three: one kind stays together, and a kind goes into the row before it where it fits in whole."""
    rows: list[tuple[Picture, ...]] = []
    for pictures in kinds:
        if rows and len(rows[-1]) + len(pictures) <= _ROW:
            rows[-1] += pictures
        elif pictures:
            rows.append(pictures)
    return tuple(Gallery(row) for row in rows)
