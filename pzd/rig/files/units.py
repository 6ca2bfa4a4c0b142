"""Conversion of the units in rig files and configs to SI and degC.

A unit is read by a grammar of its own: products, quotients and integer powers of names. pint is asked about single
names alone and evaluates nothing, for a header may hold anything. A quantity without a unit is an error elsewhere,
never a guess.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from pzd.quantities import DISPLACEMENT, FORCE, TEMPERATURE, TIME, VELOCITY, VOLTAGE, Quantity
from pzd.record import Array

if TYPE_CHECKING:
    import pint


_NUMBER_AND_UNIT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([^\s\d.+*/-].*?)\s*")
_PER_RECORDED = re.compile(r"/\s*(?:V|mV|volts?|counts?|bits?|digits?)\s*$", re.IGNORECASE)
"""What a calibration is for: one unit of the recorder, as its cells are."""
_ABOUT = re.compile(
    r"(?P<scale>.+?)\s+about\s+(?:the mean of the first (?P<first>\d{1,7})|"
    r"(?P<zero>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(?:m?V|counts?|[A-Za-z]{0,8})?)\s*"
)
"""A unit, and the reading of the recorder that means zero."""
_IN_BRACKETS = re.compile(r"[\[(\uff08\u3010]\s*([^\[\]()\uff08\uff09\u3010\u3011]+?)\s*[\])\uff09\u3011]\s*$")
SPELLINGS = {
    "pct": "%",
    "Sec": "s",
    "sec": "s",
    **dict.fromkeys(("Volts", "Volt"), "V"),
    **dict.fromkeys(("Amps", "Amp", "Amperes"), "A"),
    **dict.fromkeys(("Newtons", "Newton"), "N"),
    **dict.fromkeys(("Inches", "Inch"), "inch"),
    **dict.fromkeys(("Millimeters", "Millimeter", "Millimetres"), "mm"),
    **dict.fromkeys(("Seconds", "Second", "secs"), "s"),
    "lbs": "lbf",
    "in.": "inch",
    # Of headers in capitals throughout, as old test stands write them.
    "KN": "kN",
    "MM": "mm",
    "CM": "cm",
    **dict.fromkeys(("S", "SEC", "SECONDS"), "s"),
    "MSEC": "ms",
    **dict.fromkeys(("LBS", "Lbs", "LBF"), "lbf"),
    "KGF": "kgf",
    **dict.fromkeys(("IN", "INCH", "INCHES"), "inch"),
    "VOLTS": "V",
    "AMPS": "A",
    **dict.fromkeys(("mil", "mils"), "thou"),
    "kips": "kip",
    "deg_C": "degC",
    **dict.fromkeys(('"', "''", "\u2033", "\u201d"), "inch"),
    **dict.fromkeys(("'", "\u2032", "\u2019"), "foot"),
    **dict.fromkeys(("kp", "\u516c\u65a4\u529b"), "kgf"),
    "\u79d2": "s",
    **dict.fromkeys(("\u6beb\u79d2", "\u30df\u30ea\u79d2"), "ms"),
    **dict.fromkeys(("\u6beb\u7c73", "\u30df\u30ea"), "mm"),
    "\u5398\u7c73": "cm",
    "\u0441": "s",
    "\u043c\u0441": "ms",
    "\u043c\u043c": "mm",
    "\u043c": "m",
    "\u041d": "N",
    "\u043a\u041d": "kN",
    "\u0412": "V",
    "\u0410": "A",
    "\u043c\u0410": "mA",
    "\u7c73": "m",
    **dict.fromkeys(("\u725b", "\u725b\u987f", "\u30cb\u30e5\u30fc\u30c8\u30f3"), "N"),
    "\u5343\u725b": "kN",
    **dict.fromkeys(("\u4f0f", "\u4f0f\u7279", "\u30dc\u30eb\u30c8"), "V"),
    **dict.fromkeys(("\u5b89", "\u5b89\u57f9", "\u30a2\u30f3\u30da\u30a2"), "A"),
    **dict.fromkeys(("\u2103", "\u6444\u6c0f\u5ea6"), "degC"),
}
"""Spellings of loggers that pint does not know, or takes for other units: the `lbs` of a rig are pounds of force."""
_MEANT = {
    **dict.fromkeys(("kg", "Kg", "KG", "kgs"), ("kgf", "where kilogram-force are meant")),
    **dict.fromkeys(("lb", "LB"), ("lbf", "where pounds of force are meant")),
    **dict.fromkeys(("ips", "IPS"), ("in/s", "for inches a second")),
}
"""What is often written and no unit of the quantity as it stands: what to write for it, and what that means."""
LONGEST = 40
"""Characters of the longest unit that is read."""
MOST_FACTORS = 6
"""Factors of a unit: kg m/s2 has three."""
_SUPERSCRIPTS = str.maketrans("\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079\u207b", "0123456789-")
_FACTOR_OF_UNIT = re.compile(
    r"(?P<name>%|\u00b0?[^\W\d_](?:[^\W\d_]|_(?=[^\W\d_]))*)"
    r"(?:\^(?P<broken>[1-9]\.\d{1,2})|(?:\^|\*\*)?(?P<power>-?[1-9]))?"
)
"""A name, and the digit of its power: `m`, `s2`, `s^-2`, `s**2`; a broken power stands in m/s^1.75 of a dose alone."""
_BETWEEN_FACTORS = re.compile(r"\s*(?:(?P<over>/)|[*\u00b7\u22c5])\s*|\s+")
_FACTOR_IN_HEADER = re.compile(
    r"(?:(?<![^\W_])x|[\u00d7*/])\s?10+(?:[\^e][+-]?\d)?(?![^\W_]|\.\d)|(?<![\w.])10+\s?[x\u00d7*](?![^\W_])",
    re.IGNORECASE,
)
"""A power of ten by which the numbers of a column were multiplied, or are to be: nobody else knows which."""


class UnitError(ValueError):
    """A unit that is unknown or of another quantity, with what to write instead."""


RECORDED = ("V", "mV", "Volt", "Volts", "count", "counts", "bit", "digit", "-", "%")
"""Units of a recorder, of which one stands for so much of the quantity."""


def columns_under(head: str, header: Sequence[str], units: Sequence[str] | None, quantity: Quantity) -> list[int]:
    """Return the columns of a header: where several have it, that which the row of units tells alone is no raw signal.

    Examples
    --------
    >>> from pzd.quantities import FORCE
    >>> columns_under("Force", ["Time", "Force", "Force"], ["(s)", "(V)", "(lb)"], FORCE)
    [2]
    """
    columns = [index for index, each in enumerate(header) if each == head]
    if len(columns) < 2 or units is None or quantity.unit in RECORDED:
        return columns
    own = [column for column in columns if units[column].strip("[]() ") not in RECORDED]
    return own if len(own) == 1 else columns


def to_canonical(values: Array, unit: str, quantity: Quantity) -> Array:
    """Convert values to the unit of their quantity.

    Parameters
    ----------
    values : (n,) in `unit`
    unit : as pint spells it (`mm`, `kN`, `degF`, `m/s2`), or a size with a unit (`980.665 N` or `980.665 N/V`
        for one recorded unit, such as a volt of the logger); behind either the reading that means zero,
        `about 2.5 V` or `about the mean of the first 10`
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
    >>> to_canonical(np.array([2.5, 2.5, 3.0]), "-200 N/V about the mean of the first 2", FORCE).tolist()
    [-0.0, -0.0, -100.0]
    """
    if unit == quantity.unit:
        return values
    about = _ABOUT.fullmatch(unit)
    if about:
        first = int(about["first"]) if about["first"] else None
        if first is not None and not 0 < first <= values.size:
            raise UnitError(f"{quantity.name}: {unit!r} asks for the mean of {first} of {values.size} values")
        zero = float(np.mean(values[:first])) if first is not None else float(about["zero"])
        return to_canonical(values - zero, about["scale"], quantity)
    sized = _NUMBER_AND_UNIT.fullmatch(_PER_RECORDED.sub("", unit))
    if sized:
        size = float(sized[1])
        if not (np.isfinite(size) and size != 0.0):
            raise UnitError(f"{quantity.name}: {unit!r} is no size of a unit; write one like '2.5 {quantity.unit}'")
        with np.errstate(over="ignore"):
            values = values * size
        return to_canonical(values, sized[2], quantity)
    import pint

    try:
        with np.errstate(over="ignore"):  # what is too large is refused as that
            converted = _registry().Quantity(values, _parsed(unit)).to(_parsed(quantity.unit))
    except (pint.PintError, ValueError, AttributeError, TypeError, KeyError, ArithmeticError) as error:
        advice = meant_by(unit, quantity) or f"write one like {quantity.unit!r}"
        raise UnitError(f"{quantity.name}: {unit!r} is no unit of it ({_one_line(error)}); {advice}") from None
    return np.asarray(converted.magnitude, dtype=np.float64)


def is_unit(text: str) -> bool:
    """Whether a text is a unit of something that a rig records, and nothing else.

    Examples
    --------
    >>> [text for text in ("N", "mm", "[kN]", "Force", "x") if is_unit(text)]
    ['N', 'mm', '[kN]']
    """

    def of(quantity: Quantity) -> bool:
        try:
            to_canonical(np.zeros(1), text.strip("[]() "), quantity)
        except UnitError:
            return False
        return True

    return any(map(of, (TIME, DISPLACEMENT, FORCE, VELOCITY, VOLTAGE, TEMPERATURE)))


def meant_by(unit: str, quantity: Quantity) -> str | None:
    """Say what to write for a unit that is often written and none of a quantity; None where it may mean anything.

    Examples
    --------
    >>> from pzd.quantities import FORCE
    >>> meant_by("kg", FORCE)
    "write 'kgf' where kilogram-force are meant"
    """
    if unit not in _MEANT:
        return None
    meant, what = _MEANT[unit]
    try:
        to_canonical(np.zeros(1), meant, quantity)
    except UnitError:
        return None
    return f"write {meant!r} {what}"


def constant(text: str, quantity: Quantity) -> float:
    """Read a text like `100 V` or `22 degC` in the unit of the quantity.

    Raises
    ------
    UnitError : when there is no number, no unit, or a unit of another quantity
    """
    parts = _NUMBER_AND_UNIT.fullmatch(text)
    if parts is None:
        raise UnitError(f"{quantity.name}: a number with its unit is needed, like '1.5 {quantity.unit}'")
    value = float(to_canonical(np.array([float(parts[1])]), parts[2], quantity)[0])
    if not np.isfinite(value):
        raise UnitError(f"{quantity.name}: a finite number is needed, like '1.5 {quantity.unit}'")
    return value


def in_header(header: str, quantity: Quantity) -> str | None:
    """Return the unit in a header: in brackets at its end, or as in canonical columns (`force_kN`)."""
    brackets = _IN_BRACKETS.search(header)
    if brackets:
        return brackets[1]
    prefix = f"{quantity.name}_"
    if header.startswith(prefix) and len(header) > len(prefix):
        return header[len(prefix) :].replace("_per_", "/")
    return None


def factor_in(header: str) -> str | None:
    """Return the power of ten that a header names, as in `Load x10 [N]`; None without one."""
    found = _FACTOR_IN_HEADER.search(header)
    return found[0] if found else None


@lru_cache(maxsize=1)
def _registry() -> pint.UnitRegistry[float]:
    import pint

    return pint.UnitRegistry()


def _parsed(unit: str) -> pint.util.UnitsContainer:
    """Read a unit as powers of names, without evaluating: m/s2, kgf/cm^2, N s/m, 1/s.

    Raises
    ------
    ValueError : when it is no product or quotient of names and their powers
    """
    text = SPELLINGS.get(unit, unit).translate(_SUPERSCRIPTS).strip()
    if not text or len(text) > LONGEST:
        raise ValueError(f"a unit has at most {LONGEST} characters" if text else "it is empty")
    registry = _registry()
    powers: pint.util.UnitsContainer = registry.UnitsContainer()
    position, over, count = 0, False, 0
    if text.startswith("1/"):
        position, over = 2, True
    while True:
        factor = _FACTOR_OF_UNIT.match(text, position)
        if factor is None or count == MOST_FACTORS:
            raise ValueError("products, quotients and powers of unit names are read, as in N s/m or m/s2")
        name = registry.get_name(SPELLINGS.get(factor["name"], factor["name"]))
        power = float(factor["broken"]) if factor["broken"] else int(factor["power"] or 1)
        powers *= registry.UnitsContainer({name: -power if over else power})
        position, count = factor.end(), count + 1
        if position == len(text):
            return powers
        between = _BETWEEN_FACTORS.match(text, position)
        if between is None:
            raise ValueError("products, quotients and powers of unit names are read, as in N s/m or m/s2")
        # As in the field N/m s is taken for N/(m s) by some and N s/m by others: after a stroke a blank is no product.
        if over and not between["over"]:
            raise ValueError("what follows the stroke is unclear; write each divisor behind a stroke of its own")
        over, position = bool(between["over"]), between.end()


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())
