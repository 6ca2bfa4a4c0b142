"""Units of rig files: what a file or the config says, into SI and degC.

pint knows the units; a quantity whose unit is not said is an error elsewhere, never a guess.
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
"""How loggers spell units that pint does not know, or takes for others: a rig's `lbs` are pounds of force."""


class UnitError(ValueError):
    """A unit that is unknown or measures something else, with what to write instead."""


def to_canonical(values: Array, unit: str, quantity: Quantity) -> Array:
    """Values in the quantity's own unit.

    Parameters
    ----------
    values : (n,) in `unit`
    unit : as pint spells it (`mm`, `kN`, `degF`, `m/s2`), or a size with a unit (`980.665 N`:
        what one recorded unit, say a volt of the logger, stands for)
    quantity : what the values measure

    Returns
    -------
    (n,) in `quantity.unit`

    Raises
    ------
    UnitError : when the unit is unknown, or measures something else
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
    """The number of a text like `100 V` or `22 degC`, in the quantity's own unit.

    Raises
    ------
    UnitError : when there is no number, no unit, or a unit of something else
    """
    parts = _NUMBER_AND_UNIT.fullmatch(text)
    if parts is None:
        raise UnitError(f"{quantity.name}: a number with its unit is needed, like '1.5 {quantity.unit}'")
    return float(to_canonical(np.array([float(parts[1])]), parts[2], quantity)[0])


def in_header(header: str, quantity: Quantity) -> str | None:
    """The unit that a header names: in brackets at its end, or as the canonical columns do (`force_kN`)."""
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
    """Exponents as pint reads them, m/s2 as m/s^2; and what loggers call a unit that pint knows by another name."""
    return re.sub(r"([A-Za-z])(\d)", r"\1^\2", _LOGGERS.get(unit, unit))


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())
