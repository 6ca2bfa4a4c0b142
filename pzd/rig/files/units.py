"""Conversion of the units in rig files and configs to SI and degC, by pint.

A quantity without a unit is an error elsewhere, never a guess.
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from pzd.quantities import Quantity
from pzd.record import Array

if TYPE_CHECKING:
    import pint


_NUMBER_AND_UNIT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([^\s\d.+-].*?)\s*")
_IN_BRACKETS = re.compile(r"[\[(]\s*([^\[\]()]+?)\s*[\])]\s*$")
_LOGGERS = {"Sec": "s", "sec": "s", "Volts": "V", "Amps": "A", "lbs": "lbf", "kips": "kip", "deg_C": "degC"}
"""Spellings of loggers that pint does not know, or takes for other units: the `lbs` of a rig are pounds of force."""


class UnitError(ValueError):
    """A unit that is unknown or of another quantity, with what to write instead."""


def to_canonical(values: Array, unit: str, quantity: Quantity) -> Array:
    """Convert values to the unit of their quantity.

    Parameters
    ----------
    values : (n,) in `unit`
    unit : as pint spells it (`mm`, `kN`, `degF`, `m/s2`), or a size with a unit (`980.665 N`
        for one recorded unit, such as a volt of the logger)
    quantity : of the values

    Returns
    -------
    (n,) in `quantity.unit`

    Raises
    ------
    UnitError : when the unit is unknown, or of another quantity

    Examples
    --------
    >>> from pzd.quantities import FORCE
    >>> to_canonical(np.array([1.5]), "kN", FORCE).tolist()
    [1500.0]
    """
    if unit == quantity.unit:
        return values
    sized = _NUMBER_AND_UNIT.fullmatch(unit)
    if sized:
        return to_canonical(values * float(sized[1]), sized[2], quantity)
    import pint

    try:
        converted = _registry().Quantity(values, _spelled(unit)).to(_spelled(quantity.unit))
    except (pint.PintError, ValueError, AttributeError, TypeError) as error:
        raise UnitError(
            f"{quantity.name}: {unit!r} is no unit of it ({_one_line(error)}); write one like {quantity.unit!r}"
        ) from None
    return np.asarray(converted.magnitude, dtype=np.float64)


def constant(text: str, quantity: Quantity) -> float:
    """Read a text like `100 V` or `22 degC` in the unit of the quantity.

    Raises
    ------
    UnitError : when there is no number, no unit, or a unit of another quantity
    """
    parts = _NUMBER_AND_UNIT.fullmatch(text)
    if parts is None:
        raise UnitError(f"{quantity.name}: a number with its unit is needed, like '1.5 {quantity.unit}'")
    return float(to_canonical(np.array([float(parts[1])]), parts[2], quantity)[0])


def in_header(header: str, quantity: Quantity) -> str | None:
    """Return the unit in a header: in brackets at its end, or as in canonical columns (`force_kN`)."""
    brackets = _IN_BRACKETS.search(header)
    if brackets:
        return brackets[1]
    prefix = f"{quantity.name}_"
    if header.startswith(prefix) and len(header) > len(prefix):
        return header[len(prefix) :].replace("_per_", "/")
    return None


@lru_cache(maxsize=1)
def _registry() -> pint.UnitRegistry[float]:
    import pint

    return pint.UnitRegistry()


def _spelled(unit: str) -> str:
    """Spell a unit as pint reads it: m/s2 as m/s^2, and `Sec` as `s`."""
    return re.sub(r"([A-Za-z])(\d)", r"\1^\2", _LOGGERS.get(unit, unit))


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())
