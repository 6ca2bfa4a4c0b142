"""Force over temperature, voltage and velocity, from the damper at steady slip."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np
from numpy.typing import NDArray

from pzd.artefacts import ForceRow
from pzd.damper.compose import static_force, steady_force
from pzd.damper.confounders import known
from pzd.damper.model import Damper
from pzd.force_table.config import TableConfig
from pzd.quantities import Control
from pzd.record import Array, Record

# ----------------------------------------------------------------------------------------------------
# The speeds that the rig reached, at each voltage and temperature of the damper.


REACHED = 0.999
"""The rig reached a speed that this share of a condition's samples stays below: a spike is no reach."""
SAME = 0.95
"""Conditions whose reach is within this share of the largest were driven by the same tests."""


@dataclass(frozen=True, eq=False)
class ReachedSpeed:
    """Speed reached over temperature and voltage, NaN where nothing was tested."""

    temperatures: Array
    """(t,) of the conditions [degC]; a single 0 where none was recorded."""
    voltages: Array
    """(m,) of the conditions [V]; a single 0 where there is no control signal."""
    speeds: Array
    """(t, m) largest speed [m/s]."""

    def at(self, temperature: float | None, voltage: float | None) -> float:
        """Speed reached at a temperature and voltage [m/s]; 0 beyond the voltages and temperatures of the rig."""
        T, U = temperature or 0.0, voltage or 0.0
        if temperature is not None and not self._spans(self.temperatures, T):
            return 0.0
        if voltage is not None and not self._spans(self.voltages, U):
            return 0.0
        by_temperature = [self._at_voltage(row, U) for row in self.speeds]
        return float(np.interp(T, self.temperatures, by_temperature))

    def _at_voltage(self, row: Array, voltage: float) -> float:
        """Along one temperature; what was not tested there is bridged, or taken from the other temperatures."""
        known = np.isfinite(row)
        if not known.any():
            row = np.nanmax(self.speeds, axis=0)
            known = np.isfinite(row)
        return float(np.interp(voltage, self.voltages[known], row[known]))

    @staticmethod
    def _spans(nodes: Array, value: float) -> bool:
        margin = 1e-9 * max(abs(nodes[0]), abs(nodes[-1]))
        return bool(nodes[0] - margin <= value <= nodes[-1] + margin)


def reached(
    records: Sequence[Record], temperatures: Sequence[float | None], voltages: Sequence[float | None]
) -> ReachedSpeed:
    """The largest speed of the samples nearest to each temperature and voltage.

    Parameters
    ----------
    records : of one setting
    temperatures, voltages : of the damper's conditions, rising; a single None where there is none

    Returns
    -------
    the reach; conditions within 5 % of the fastest one count as equally fast
    """
    T, U = _numbers(temperatures), _numbers(voltages)
    speeds = np.full((T.size, U.size), np.nan)
    cells = [_cells(record, T, U) for record in records]
    for i, j in np.ndindex(speeds.shape):
        mine = [np.abs(r.velocity[cell == i * U.size + j]) for r, cell in zip(records, cells, strict=True)]
        fastest = [float(np.quantile(v, REACHED)) for v in mine if v.size]
        if fastest:
            speeds[i, j] = max(fastest)
    if np.isfinite(speeds).any():
        speeds[speeds >= SAME * np.nanmax(speeds)] = np.nanmax(speeds)
    return ReachedSpeed(T, U, speeds)


def _numbers(values: Sequence[float | None]) -> Array:
    return np.array([0.0 if value is None else value for value in values])


def _cells(record: Record, temperatures: Array, voltages: Array) -> NDArray[np.int64]:
    i = np.zeros(record.time.size, dtype=np.int64) + _nearest(temperatures, record.temperature)
    return i * voltages.size + _nearest(voltages, record.voltage)


def _nearest(nodes: Array, values: Array | None) -> NDArray[np.int64]:
    if values is None or nodes.size == 1:
        return np.zeros(1, dtype=np.int64)
    halfway: NDArray[np.int64] = np.searchsorted((nodes[1:] + nodes[:-1]) / 2.0, values)
    return halfway


# ----------------------------------------------------------------------------------------------------


HALVINGS = 5
"""Most often that an interval between two nodes is halved."""


@dataclass(frozen=True, eq=False)
class TableNodes:
    """The nodes of the table."""

    temperatures: tuple[float | None, ...]
    voltages: tuple[float | None, ...]
    speeds: Array
    """(n,) rising from 0 [m/s]."""

    @property
    def velocities(self) -> Array:
        """(2 n,) rising velocities, with -0 and +0 in the middle [m/s]."""
        return np.concatenate([-self.speeds[::-1], self.speeds])


def forces(damper: Damper, temperature: float | None, voltage: float | None, velocity: Array) -> Array:
    """(n,) force at steady slip [N], at mid-stroke."""
    out: Array = np.broadcast_to(steady_force(damper, voltage, temperature, velocity), velocity.shape)
    return out


def voltages_of(damper: Damper) -> tuple[float | None, ...]:
    """The voltages at which the damper's parameters are given, rising; (None,) without a control signal."""
    nodes = {row.voltage_V for row in damper.base if row.voltage_V is not None}
    if not nodes:
        return (None,)
    for values in damper.effects.values():
        listed = values.get("at_voltage_V")
        nodes |= set(listed) if isinstance(listed, tuple) else set()
    return tuple(sorted(nodes))


def temperatures_of(damper: Damper) -> tuple[float | None, ...]:
    """The temperatures at which the damper's parameters are given, rising; (None,) where none was recorded."""
    nodes = {row.temperature_degC for row in damper.base if row.temperature_degC is not None}
    return tuple(sorted(nodes)) or (None,)


def grid(config: TableConfig, damper: Damper, temperatures: Sequence[float | None], reach: ReachedSpeed) -> TableNodes:
    """Nodes between which straight lines keep to the damper's law within the tolerance."""
    voltages = voltages_of(damper)
    if config.voltages_V is not None and voltages != (None,):
        voltages = tuple(sorted(set(config.voltages_V)))
    speeds = _speeds(config, reach)
    both = np.concatenate([-speeds[::-1], speeds])
    warm = temperatures[0]

    allowed = config.tolerance * max(float(np.max(np.abs(forces(damper, warm, u, both)))) for u in voltages)
    known = np.array([u for u in voltages if u is not None])

    def over_voltage(at: Array) -> Array:
        return steady_force(damper, at[:, np.newaxis], warm, both)

    def over_speed(at: Array) -> Array:
        pairs = at[:, np.newaxis, np.newaxis] * np.array([-1.0, 1.0])
        return steady_force(damper, known[:, np.newaxis] if known.size else None, warm, pairs).reshape(at.size, -1)

    if config.voltages_V is None and known.size:
        known = refined(known, over_voltage, allowed)
    return TableNodes(tuple(temperatures), tuple(map(float, known)) or (None,), refined(speeds, over_speed, allowed))


def _speeds(config: TableConfig, reach: ReachedSpeed) -> Array:
    """Speeds spaced by their square root, and those that the rig reached."""
    fastest = np.unique(reach.speeds[np.isfinite(reach.speeds)])
    largest = max(config.speed_max_m_per_s, *fastest) if fastest.size else config.speed_max_m_per_s
    even = largest * np.linspace(0.0, 1.0, config.speed_points + 1) ** 2
    apart = [v for v in even[1:] if fastest.size == 0 or np.min(np.abs(fastest - v)) > 1e-3 * largest]
    return np.unique(np.concatenate([[0.0], apart, fastest[fastest > 0.0]]))


def refined(nodes: Array, law: Callable[[Array], Array], allowed: float) -> Array:
    """The nodes, with intervals halved until the straight line between two is off by no more than `allowed`.

    Parameters
    ----------
    nodes : (m,) rising
    law : values (k, n) of the law at k nodes
    allowed : largest error at the middle of an interval, in units of the law

    Returns
    -------
    the nodes and those added between them, rising
    """
    found, values = nodes, law(nodes)
    wide = np.arange(nodes.size - 1)
    for _ in range(HALVINGS):
        middles = 0.5 * (found[wide] + found[wide + 1])
        there = law(middles)
        off = np.max(np.abs(there - 0.5 * (values[wide] + values[wide + 1])), axis=1) > allowed
        if not np.any(off):
            break
        behind = wide[off] + 1
        found, values = np.insert(found, behind, middles[off]), np.insert(values, behind, there[off], axis=0)
        first = behind - 1 + np.arange(behind.size)
        wide = np.sort(np.concatenate([first, first + 1]))
    return found


def force_rows(config: TableConfig, damper: Damper, nodes: TableNodes, reach: ReachedSpeed) -> tuple[ForceRow, ...]:
    """One row a node; beyond the rig's reach held, empty or the law itself, as the config says."""
    rows: list[ForceRow] = []
    for temperature in nodes.temperatures:
        for voltage in nodes.voltages:
            rows += _column(config, damper, temperature, voltage, nodes.velocities, reach.at(temperature, voltage))
    return tuple(rows)


def _column(
    config: TableConfig, damper: Damper, temperature: float | None, voltage: float | None, velocity: Array, limit: float
) -> list[ForceRow]:
    inside = np.abs(velocity) <= limit * (1.0 + 1e-9)
    asked = np.copysign(np.minimum(np.abs(velocity), limit), velocity) if config.outside == "clamp" else velocity
    values = forces(damper, temperature, voltage, asked)
    return [
        ForceRow(
            temperature_degC=temperature,
            voltage_V=voltage,
            velocity_m_per_s=float(v),
            force_N=None if config.outside == "error" and not within else float(force),
            inside=1 if within else 0,
        )
        for v, force, within in zip(velocity, values, inside, strict=True)
    ]


# ----------------------------------------------------------------------------------------------------
# What a table of force over voltage and velocity cannot carry, and where force falls with voltage.


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
            lines.append(f"{_notes_speeds(start, end, speeds)}: force {verb} from {low:g} to {high:g} {unit}")
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


def _notes_speeds(start: float, end: float, speeds: Array) -> str:
    if start <= speeds[0] and end >= speeds[-1]:
        return "at every speed"
    if start <= speeds[0]:
        return f"below {end:.3g} m/s"
    if end >= speeds[-1]:
        return f"above {start:.3g} m/s"
    return f"from {start:.3g} to {end:.3g} m/s"
