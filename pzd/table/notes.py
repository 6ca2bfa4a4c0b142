"""What a table of force over voltage and velocity cannot carry, and where force falls with voltage."""

from __future__ import annotations

from itertools import groupby, pairwise

import numpy as np

from pzd.damper.competing_forms import known
from pzd.damper.compose import static_force
from pzd.damper.model import Damper
from pzd.quantities import Control
from pzd.record import Array
from pzd.table.force import forces, voltages_of

CARRIED = 1e-9
"""An effect is carried if it moves the table by more than this share of the largest force."""
FALLS = 1e-6
"""Force falls with voltage where it does so by more than this share of the largest force."""


def lost(damper: Damper, temperatures: tuple[float | None, ...], velocity: Array) -> tuple[str, ...]:
    """What the table drops: the oil spring's memory, what steady slip does not show, and forces that act at rest too.

    Parameters
    ----------
    damper : with its effects
    temperatures : of the table [degC]
    velocity : (n,) of the table [m/s]
    """
    lags = [1e3 * row.C_Ns_per_m / row.k_N_per_m for row in damper.base]
    ends = " to ".join(dict.fromkeys(f"{lag:.3g}" for lag in (min(lags), max(lags))))
    memory = f"memory of the oil spring k: the force lags by C/k = {ends} ms"
    return (
        memory,
        *(_words(damper, name) for name in damper.effects if not _carried(damper, name, temperatures, velocity)),
    )


def _words(damper: Damper, name: str) -> str:
    effect = known()[name]
    alone = damper.model_copy(update={"effects": {name: damper.effects[name]}})
    rests = any(static_force(alone, voltage) != 0.0 for voltage in voltages_of(damper))
    why = "it acts at rest too, and is left to the static balance" if rests else "steady slip does not show it"
    return f"{name}: {effect.law} ({why})"


def _carried(damper: Damper, name: str, temperatures: tuple[float | None, ...], velocity: Array) -> bool:
    """Whether the table would differ without the effect."""
    rest = {other: values for other, values in damper.effects.items() if other != name}
    without = damper.model_copy(update={"effects": rest})
    for temperature in temperatures:
        for voltage in voltages_of(damper):
            full = forces(damper, temperature, voltage, velocity)
            change = np.max(np.abs(full - forces(without, temperature, voltage, velocity)))
            if change > CARRIED * np.max(np.abs(full)):
                return True
    return False


def not_monotone(
    damper: Damper, temperatures: tuple[float | None, ...], velocity: Array, control: Control
) -> tuple[str, ...]:
    """Where the size of the force falls with rising voltage although on the whole it rises, or the other way round.

    Parameters
    ----------
    damper : with its effects
    temperatures : of the table [degC]
    velocity : (n,) of the table, mirrored [m/s]
    control : the control signal, for the words

    Returns
    -------
    one line a temperature, direction and pair of voltages, with the speeds and the rule
    """
    voltages = [u for u in voltages_of(damper) if u is not None]
    half = velocity.size // 2
    found: list[str] = []
    rule = f"the lowest {control.name} that gives the force is taken"  # as `table_voltage` does
    for temperature in temperatures:
        sides = {}
        for name, branch in (("rebound", velocity[half:]), ("compression", velocity[half - 1 :: -1])):
            size = np.array([np.sign(branch[-1]) * forces(damper, temperature, u, branch) for u in voltages])
            sides[name] = _lines(voltages, size, np.abs(branch), control.unit)
        place = "" if temperature is None else f"{temperature:g} degC, "
        if sides["rebound"] == sides["compression"]:
            found += [f"{place}{line}; {rule}" for line in sides["rebound"]]
        else:
            found += [f"{place}{name}, {line}; {rule}" for name, lines in sides.items() for line in lines]
    return tuple(found)


def _lines(voltages: list[float], size: Array, speeds: Array, unit: str) -> list[str]:
    if len(voltages) < 2:
        return []
    trend = 1.0 if float(np.sum(size[-1] - size[0])) >= 0.0 else -1.0
    lines: list[str] = []
    for i, (low, high) in enumerate(pairwise(voltages)):
        change = trend * (size[i + 1] - size[i])
        for start, end in _falling(change, speeds, FALLS * float(np.max(np.abs(size)))):
            verb = "falls" if trend > 0.0 else "rises"
            lines.append(f"{_speeds(start, end, speeds)}: force {verb} from {low:g} to {high:g} {unit}")
    return lines


def _falling(change: Array, speeds: Array, least: float) -> list[tuple[float, float]]:
    """Intervals of speed where the change is negative, their ends by a straight line between nodes."""
    intervals: list[tuple[float, float]] = []
    for negative, members in groupby(range(change.size), key=lambda j: bool(change[j] < -least)):
        run = list(members)
        if negative:
            intervals.append((_crossing(change, speeds, run[0], -1), _crossing(change, speeds, run[-1], 1)))
    return intervals


def _crossing(change: Array, speeds: Array, j: int, towards: int) -> float:
    other = j + towards
    if not 0 <= other < speeds.size:
        return float(speeds[j])
    share = change[j] / (change[j] - change[other])
    return float(speeds[j] + min(max(share, 0.0), 1.0) * (speeds[other] - speeds[j]))


def _speeds(start: float, end: float, speeds: Array) -> str:
    if start <= speeds[0] and end >= speeds[-1]:
        return "at every speed"
    if start <= speeds[0]:
        return f"below {end:.3g} m/s"
    if end >= speeds[-1]:
        return f"above {start:.3g} m/s"
    return f"from {start:.3g} to {end:.3g} m/s"
