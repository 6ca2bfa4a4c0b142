"""Settings whose names hold a number, as `gap 0.15 mm` or `R3 C12`: what varies from one to the next, and by how much.

The number of a clicker, a gap, a shim or a gas pressure stands in the name of a setting; the rest of the name says what
it is a number of. Two settings lie on one axis where their names differ by one number alone.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

PRESSURES = frozenset({"psi", "bar", "mbar", "Pa", "hPa", "kPa", "MPa"})
"""Units of the gas pressure of a damper, as their symbols are written."""
LENGTHS = frozenset({"mm", "um", "µm", "μm", "in", "mil"})
"""Units of gaps and shims."""
_NUMBER = re.compile(r"\d+(?:\.\d+)?")
_UNIT = re.compile(r"[ _-]?([A-Za-zµμ]+)")


@dataclass(frozen=True)
class NumberedSetting:
    """One number in the name of a setting."""

    setting: str
    axis: str
    """The name with # in the place of the number: what two settings must share to differ by this number alone."""
    value: float
    unit: str
    """Of a pressure or a length, where it stands behind the number; empty where the number merely counts, as clicks."""


@dataclass(frozen=True)
class Neighbours:
    """A setting between two tested ones, which differ from it by one number alone."""

    wanted: NumberedSetting
    lower: NumberedSetting
    upper: NumberedSetting
    """The same as `lower` where the setting itself was tested."""

    @property
    def share(self) -> float:
        """Share of the way from the lower to the upper one."""
        way = self.upper.value - self.lower.value
        return (self.wanted.value - self.lower.value) / way if way > 0.0 else 0.0


def numbers_in(setting: str | None) -> tuple[NumberedSetting, ...]:
    """Every number in the name of a setting; none where it has none."""
    name = setting or ""
    found = []
    for number in _NUMBER.finditer(name):
        word = _UNIT.match(name, number.end())
        unit = word[1] if word and word[1] in PRESSURES | LENGTHS else ""
        axis = f"{name[: number.start()]}#{name[number.end() :]}"
        found.append(NumberedSetting(name, axis, float(number.group()), unit))
    return tuple(found)


def on_axis(axis: str, tested: Sequence[str | None]) -> tuple[NumberedSetting, ...]:
    """The tested settings on an axis, by rising number; `gap 0.2 mm` and `gap 0.20 mm` count once."""
    found: dict[float, NumberedSetting] = {}
    for name in sorted({name for name in tested if name is not None}):
        for one in numbers_in(name):
            if one.axis == axis:
                found.setdefault(one.value, one)
    return tuple(found[value] for value in sorted(found))


def neighbours(wanted: str, tested: Sequence[str | None]) -> Neighbours:
    """The tested settings to either side of a wanted one, on the first axis of its name that has two.

    Parameters
    ----------
    wanted : name of the wanted setting
    tested : the settings of the rig's records

    Raises
    ------
    ValueError : when no two tested ones differ from it by one number alone, or when it lies beyond them
    """
    beyond: tuple[NumberedSetting, ...] = ()
    for number in numbers_in(wanted):
        line = on_axis(number.axis, tested)
        if len(line) < 2:
            continue
        lower = [one for one in line if one.value <= number.value]
        upper = [one for one in line if one.value >= number.value]
        if lower and upper:
            return Neighbours(number, lower[-1], upper[0])
        beyond = beyond or line
    if beyond:
        raise ValueError(
            f"must lie between {beyond[0].setting} and {beyond[-1].setting}, which were tested: nothing is "
            f"extrapolated (got {wanted})"
        )
    names = ", ".join(sorted({name for name in tested if name is not None})) or "none that has a name"
    raise ValueError(
        f"no two tested settings differ from it by one number alone, as gap 0.15 mm and gap 0.25 mm do from gap "
        f"0.2 mm; tested: {names} (got {wanted})"
    )
