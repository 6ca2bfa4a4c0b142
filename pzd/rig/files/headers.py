"""Which column of a rig file holds which quantity, guessed from its header in English, German, French or Spanish."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from pzd.quantities import (
    ACCELERATION,
    CHANNELS,
    DISPLACEMENT,
    FORCE,
    PRESSURE,
    TEMPERATURE,
    TIME,
    VELOCITY,
    VOLTAGE,
    Control,
    Quantity,
)
from pzd.rig.files.layout import ALSO_READ, own_quantity
from pzd.rig.files.units import UnitError, in_header, to_canonical

_LOOKS_LIKE = {
    TIME: r"^t$|^tout$|time|clock|zeit|\btemps\b|tiempo|^second|^sek",
    DISPLACEMENT: r"^[xs]$|disp|^dist|pos|stroke|travel|lvdt|exten|weg|hub|federung|course|placement|desplaz|carrera",
    VELOCITY: r"^v$|vel|speed|geschw|vitesse",
    ACCELERATION: r"^a$|acc|beschl|acel",
    FORCE: r"^f$|^for[cç]|force|load|kraft|effort|fuerza|carga",
    TEMPERATURE: r"temp(?!s\b)|t[eé]mp[eé]r",
    PRESSURE: r"^p$|press|druck|presi",
}
"""What headers of each quantity look like, a unit in brackets taken off."""
CONTROLS = {
    Control(): r"^u$|volt|spannung|tension|tensi[oó]n",
    Control("current", "A"): r"^i$|current|strom|courant|corriente",
}
"""What the header of the control signal looks like."""
_WITH_UNIT = {
    TIME: "^t$",
    DISPLACEMENT: "^[xs]$",
    VELOCITY: "^v$",
    ACCELERATION: "^a$",
    FORCE: "^f$",
    TEMPERATURE: "^t$",
    PRESSURE: "^p$",
}
"""What names a quantity where a unit of it stands behind: `x_m`, `F_kN`, `T [degC]`."""
_CONTROLS_WITH_UNIT = {
    Control(): "^u$|ctrl|control|valve|piezo|coil",
    Control("current", "A"): "^i$|ctrl|control|valve|coil",
}
"""The same of the control signal: `U_V`, `ctrl [V]`, `Coil/A`."""
_LAST_WORD = re.compile(r"[ _/,]\s*([A-Za-zµ°%][A-Za-zµ°/²^0-9]*)$")
_DEGREES = dict.fromkeys(("C", "°C", "deg C", "grad C", "Grad C"), "degC") | dict.fromkeys(("F", "°F", "deg F"), "degF")
"""What headers call degrees, and pint does not or takes for coulombs and farads."""


def control_of(headers: Sequence[str]) -> Control:
    """The control signal that the headers show; a voltage where they show none."""
    shown = [
        control
        for control, pattern in CONTROLS.items()
        for header in headers
        if (re.search(pattern, _bare(header)) and _word(header, None, Control()) not in (FORCE, DISPLACEMENT))
        or _by_unit(header, None, control) is VOLTAGE
    ]
    return next(iter(shown), Control())


def assigned(headers: Sequence[str], units: Sequence[str] | None, control: Control) -> dict[Quantity, str]:
    """The header of every quantity that is found, each header for one quantity alone.

    A column in a unit of the quantity is taken before one in volts or without a unit.
    """
    found: dict[Quantity, tuple[int, str]] = {}
    for index, header in enumerate(headers):
        below = units[index] if units else None
        quantity = _word(header, below, control)
        if quantity is None:
            continue
        canonical = is_canonical(header, quantity, control)
        unit = unit_of(header, below, own_quantity(quantity, control))
        rank = 3 if canonical else 2 if unit is not None else 0 if _in_brackets(header, units, index) else 1
        if quantity not in found or rank > found[quantity][0]:
            found[quantity] = (rank, header)
    return {quantity: found[quantity][1] for quantity in CHANNELS if quantity in found}


def is_canonical(header: str, quantity: Quantity, control: Control) -> bool:
    """Whether a header is read without being named."""
    return header in (own_quantity(quantity, control).column, ALSO_READ.get(quantity))


def unit_of(header: str, below: str | None, quantity: Quantity) -> str | None:
    """The unit that the row of units or the header names, as pint spells it; None where it is none of the quantity."""
    last = _LAST_WORD.search(header)
    told = below.strip("[]() ") if below and below.strip("[]() ") else in_header(header, quantity) or (last and last[1])
    if not told:
        return None
    unit = _DEGREES.get(told, told) if quantity is TEMPERATURE else told
    try:
        to_canonical(np.zeros(1), unit, quantity)
    except UnitError:
        return None
    return unit


def _word(header: str, below: str | None, control: Control) -> Quantity | None:
    """The quantity that a header names; where it names two (Druckkraft, load cell voltage) the mechanical one."""
    for quantity in CHANNELS:
        if is_canonical(header, quantity, control):
            return quantity
    if (meant := _by_unit(header, below, control)) is not None:
        return meant
    bare = _bare(header)
    for quantity in (FORCE, DISPLACEMENT, VELOCITY, ACCELERATION, TIME, TEMPERATURE, PRESSURE):
        if re.search(_LOOKS_LIKE[quantity], bare):
            return quantity
    return VOLTAGE if re.search(CONTROLS[control], bare) else None


def _by_unit(header: str, below: str | None, control: Control) -> Quantity | None:
    """The quantity that a header means by the unit behind it; None where there is none."""
    word = _LAST_WORD.sub("", _bare(header))
    for quantity, pattern in {**_WITH_UNIT, VOLTAGE: _CONTROLS_WITH_UNIT[control]}.items():
        if re.search(pattern, word) and unit_of(header, below, own_quantity(quantity, control)) is not None:
            return quantity
    return None


def _in_brackets(header: str, units: Sequence[str] | None, index: int) -> bool:
    """Whether a header has a unit in brackets, whatever it is a unit of."""
    return bool(units and units[index]) or bool(re.search(r"[\[(].*[\])]", header))


def _bare(header: str) -> str:
    return re.sub(r"[\[(].*", "", header).strip().lower()
