"""Columns of the parameter rows: which parameter of which effect stands where, read from the effect files."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.damper.confounders import known, module_of
from pzd.damper.effect import NODE_VOLTAGES, Effect, Place, functions
from pzd.damper.model import Damper
from pzd.record import Array

Column = tuple[str, str]
"""Effect and parameter; a letter that two effects use is two columns."""


def acting(place: Place) -> tuple[Effect, ...]:
    """Return the known effects of a place in the order in which they act, confounders and fitted laws among them."""
    return tuple(sorted((e for e in known().values() if e.place == place), key=lambda e: (e.order, e.name)))


def _columns(*places: Place) -> tuple[Column, ...]:
    """Return the columns of all effects of some places."""
    return tuple((e.name, p.name) for place in places for e in acting(place) for p in e.parameters)


def _columns_with(law: str, place: Place) -> tuple[Column, ...]:
    """Return the columns of the effects of a place that hold a law."""
    holding = (e for e in acting(place) if law in functions(e, module_of(e)))
    return tuple((e.name, p.name) for e in holding for p in e.parameters)


DRIVE = _columns("drive")
"""Columns of a row of the drive."""
STROKE_AND_FLOW = _columns("stroke", "flow")
"""Columns of a row of the element, after T0, C and k."""
BESIDE = _columns("parallel", "branch")
"""Columns of the forces parallel to the element, those without memory first."""
PARALLEL = (*BESIDE, *_columns_with("direction_factor", "flow"))
"""Columns of a row of these forces: at its end what scales a branch by the direction, as it does T0 and C."""
NEUTRAL = {(e.name, p.name): p.neutral for e in known().values() for p in e.parameters}
"""Value of every column where a damper lacks the effect."""


def value_of(damper: Damper, effect: str, parameter: str) -> float:
    """Return a parameter that is one number: the damper's, or the neutral one where it lacks the effect.

    Raises
    ------
    ValueError : when the damper has one value per voltage
    """
    value = damper.effects.get(effect, {}).get(parameter, NEUTRAL[effect, parameter])
    if isinstance(value, tuple):
        raise ValueError(f"{effect}.{parameter} must be one number, not a list by voltage")  # noqa: TRY004  # a wrong value of a config
    return value


def columns_of(damper: Damper, columns: Sequence[Column], effective: Array | None) -> Array:
    """Return the (n, m) or (1, m) values of m columns at (n,) effective voltages [V]."""
    if not columns:
        return np.empty((1, 0))
    found = [column(damper, *one, effective) for one in columns]
    if all(values.size == 1 for values in found):
        return np.concatenate(found)[np.newaxis]
    return np.stack(np.broadcast_arrays(*found), axis=-1)


def column(damper: Damper, effect: str, parameter: str, effective: Array | None) -> Array:
    """Return one parameter, (1,), or (n,) at (n,) effective voltages [V] where it has one value per voltage.

    Raises
    ------
    ValueError : when it has one value per voltage and no voltage is given
    """
    given = damper.effects.get(effect, {})
    value = given.get(parameter, NEUTRAL[effect, parameter])
    if not isinstance(value, tuple):
        return np.array([value])
    if effective is None:
        raise ValueError(f"{effect}.{parameter} depends on the voltage, and none is given")
    return np.asarray(np.interp(effective, np.atleast_1d(given[NODE_VOLTAGES]), np.array(value)))
