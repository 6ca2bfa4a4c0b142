"""Which effect parameter stands in which column of the rows that the kernels take: read from the effect files."""

from __future__ import annotations

from pzd.damper.competing_forms import known
from pzd.damper.effect import Effect, Place

Column = tuple[str, str]
"""Effect and parameter; a letter that two effects use is two columns."""


def acting(place: Place) -> tuple[Effect, ...]:
    """The effects and competing forms of a place in the order in which they act."""
    return tuple(sorted((e for e in known().values() if e.place == place), key=lambda e: (e.order, e.name)))


def _columns(*places: Place) -> tuple[Column, ...]:
    return tuple((e.name, p.name) for place in places for e in acting(place) for p in e.parameters)


DRIVE = _columns("drive")
"""Columns of a row of the drive."""
STROKE_AND_FLOW = _columns("stroke", "flow")
"""Columns of a row of the element, behind T0, C and k."""
PARALLEL = _columns("parallel", "branch")
"""Columns of a row of the forces beside the element, those without memory first."""
NEUTRAL = {(e.name, p.name): p.neutral for e in known().values() for p in e.parameters}
"""The value of every column where a damper lacks the effect."""
