"""Force a click: what one position of a clicker more makes of the force at the trade's speeds, the gas apart.

The position of a clicker is a number: the control signal where its name or unit says click, as in
`control: {name: rebound, unit: clicks}`, or a number in the name of the setting, as in "R 3 C 12".
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Hashable, Iterator, Sequence
from itertools import pairwise

from pzd.artefacts import ClickRow, KneeForceRow
from pzd.quantities import Control
from pzd.record import SAME_TEMPERATURE

_NUMBER = re.compile(r"\d+(?:\.\d+)?")


def clicks(forces: Sequence[KneeForceRow], control: Control) -> tuple[ClickRow, ...]:
    """The force a click between neighbouring positions of every clicker, all other things equal.

    Parameters
    ----------
    forces : of every condition at the trade's speeds
    control : the control signal
    """
    clicked = "click" in f"{control.name} {control.unit}".lower()
    return tuple(row for place, rows in _clickers(forces, clicked=clicked).items() for row in _of_one(place, rows))


Place = tuple[str | None, float | None]
"""Setting with # for the clicker, and voltage where that is not the clicker itself."""


def _clickers(forces: Sequence[KneeForceRow], *, clicked: bool) -> dict[Place, list[tuple[float, KneeForceRow]]]:
    """The rows that differ by one clicker alone, each with its position."""
    found: dict[Place, list[tuple[float, KneeForceRow]]] = defaultdict(list)
    for row in forces:
        if clicked and row.voltage_V is not None:
            found[row.setting, None].append((row.voltage_V, row))
        for number in _NUMBER.finditer(row.setting or ""):
            text = f"{(row.setting or '')[: number.start()]}#{(row.setting or '')[number.end() :]}"
            found[text, row.voltage_V].append((float(number.group()), row))
    return found


def _of_one(place: Place, rows: Sequence[tuple[float, KneeForceRow]]) -> Iterator[ClickRow]:
    """The rows of one clicker: by temperature and speed, from one position to the next."""
    groups: dict[Hashable, list[tuple[float, KneeForceRow]]] = defaultdict(list)
    first: float | None = None
    for position, row in sorted(rows, key=lambda each: (each[1].temperature_degC or 0.0, each[0])):
        degrees = row.temperature_degC
        if first is None or degrees is None or degrees - first > SAME_TEMPERATURE:
            first = degrees
        groups[first, row.velocity_m_per_s].append((position, row))
    for same in groups.values():
        for (low, before), (high, after) in pairwise(sorted(same, key=lambda each: each[0])):
            if high > low:
                rebound = [row.rebound_force_N - row.gas_force_N for row in (before, after)]
                compression = [row.gas_force_N - row.compression_force_N for row in (before, after)]
                yield ClickRow(
                    setting=place[0],
                    voltage_V=place[1],
                    temperature_degC=before.temperature_degC,
                    from_click=low,
                    to_click=high,
                    velocity_m_per_s=before.velocity_m_per_s,
                    rebound_N_per_click=(rebound[1] - rebound[0]) / (high - low),
                    compression_N_per_click=(compression[1] - compression[0]) / (high - low),
                )
