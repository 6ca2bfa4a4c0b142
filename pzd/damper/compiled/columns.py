"""Which effect parameter stands in which column of the rows that the kernels take: read from the effect files."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.damper.confounders import known
from pzd.damper.effect import Effect, Place
from pzd.damper.model import Damper
from pzd.record import Array

# ----------------------------------------------------------------------------------------------------


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


# ----------------------------------------------------------------------------------------------------
# The numbers of a damper's effects, one each or by the effective voltage; neutral where it lacks an effect.


def value_of(damper: Damper, effect: str, parameter: str) -> float:
    """A parameter that is one number: the damper's, or the neutral one where it lacks the effect.

    Raises
    ------
    ValueError : when the damper gives it by voltage
    """
    value = damper.effects.get(effect, {}).get(parameter, NEUTRAL[effect, parameter])
    if isinstance(value, tuple):
        raise ValueError(f"{effect}.{parameter} must be one number, not a list by voltage")  # noqa: TRY004  # a wrong value of a config
    return value


def columns_of(damper: Damper, columns: Sequence[Column], effective: Array | None) -> Array:
    """(n, m) or (1, m) values of effect parameters, by the effective voltage [V] where they are lists."""
    if not columns:
        return np.empty((1, 0))
    found = [column(damper, *one, effective) for one in columns]
    if all(values.size == 1 for values in found):
        return np.concatenate(found)[np.newaxis]
    return np.stack(np.broadcast_arrays(*found), axis=-1)


def column(damper: Damper, effect: str, parameter: str, effective: Array | None) -> Array:
    """(n,) or (1,) values of one parameter, by the effective voltage [V] where it is a list.

    Raises
    ------
    ValueError : when it is a list and no voltage is given
    """
    given = damper.effects.get(effect, {})
    value = given.get(parameter, NEUTRAL[effect, parameter])
    if not isinstance(value, tuple):
        return np.array([value])
    if effective is None:
        raise ValueError(f"{effect}.{parameter} depends on the voltage, and none is given")
    return np.asarray(np.interp(effective, np.atleast_1d(given["at_voltage_V"]), np.array(value)))
