"""The paper's numbers beside those of the run."""

from __future__ import annotations

from pzd.artefacts import ComfortRow, Identified, PublishedRow, Rides
from pzd.paper.computed import Made, computed
from pzd.paper.published import Published, published
from pzd.simulate.config import SimulateConfig


def published_rows(
    simulate: SimulateConfig, identified: Identified, rides: Rides, comfort: tuple[ComfortRow, ...]
) -> tuple[PublishedRow, ...]:
    """One row for every number that the paper prints, in the order of its list.

    Parameters
    ----------
    simulate : the ride that was driven
    identified : parameters and measures of the rig
    rides, comfort : what the rides gave
    """
    made = Made(identified, rides, comfort, simulate)
    return tuple(_beside(row, made) for row in published().values())


def _beside(row: Published, made: Made) -> PublishedRow:
    found = computed(row, made)
    comparable = found.value is not None and isinstance(row.value, float | int) and row.value != 0
    return PublishedRow(
        id=row.id,
        kind=row.kind,
        published=row.value,
        computed=found.value,
        unit=row.unit,
        ratio=found.value / row.number if found.value is not None and comparable else None,
        note="; ".join(text for text in (found.note, f"paper: {row.note}" if row.note else "") if text),
    )
