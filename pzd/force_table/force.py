"""The table of force over temperature, voltage and velocity at steady slip: its nodes, its rows and its notes.

The operating envelope comes from the records; the nodes are refined until straight lines between them follow the law;
each row is marked as inside or outside the envelope; the notes list what the table cannot hold.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np
from numpy.typing import NDArray

from pzd.artefacts import ForceRow
from pzd.damper.compose import static_force, steady_force
from pzd.damper.confounders import known
from pzd.damper.effect import NODE_VOLTAGES
from pzd.damper.model import Damper
from pzd.force_table.config import TableConfig
from pzd.quantities import Control
from pzd.record import Array, Record

# --- Operating envelope: the tested speeds at each voltage and temperature of the damper ---

QUANTILE = 0.999
"""The tested speed is this quantile of a condition's speeds: a spike does not count."""
SAME_TESTS = 0.95
"""Conditions whose tested speed is at least this share of the largest were driven by the same tests."""
_ROUNDING = 1e-9
"""Share by which a value may lie beyond the envelope: rounding of times and voltages."""


@dataclass(frozen=True, eq=False)
class ReachedSpeeds:
    """Largest tested speed over temperature and voltage, NaN where nothing was tested."""

    temperatures: Array
    """(t,) of the conditions [degC]; a single 0 where none was recorded."""
    voltages: Array
    """(m,) of the conditions [V]; a single 0 where there is no control signal."""
    speeds: Array
    """(t, m) largest speed [m/s]."""

    def speed_at(self, temperature: float | None, voltage: float | None) -> float:
        """Return the tested speed [m/s] at a temperature and voltage; 0 beyond those of the rig."""
        T, U = temperature or 0.0, voltage or 0.0
        for value, given, nodes in ((T, temperature, self.temperatures), (U, voltage, self.voltages)):
            margin = _ROUNDING * max(abs(nodes[0]), abs(nodes[-1]))
            if given is not None and not nodes[0] - margin <= value <= nodes[-1] + margin:
                return 0.0
        return float(np.interp(T, self.temperatures, [self._at_voltage(row, U) for row in self.speeds]))

    def _at_voltage(self, row: Array, voltage: float) -> float:
        """Interpolate along one temperature, or along the largest speeds of all where nothing was tested there."""
        tested = np.isfinite(row)
        if not tested.any():
            row = np.nanmax(self.speeds, axis=0)
            tested = np.isfinite(row)
        return float(np.interp(voltage, self.voltages[tested], row[tested]))


def reached_speeds(
    records: Sequence[Record], temperatures: Sequence[float | None], voltages: Sequence[float | None]
) -> ReachedSpeeds:
    """Find the largest speed of the samples nearest to each temperature and voltage.

    Parameters
    ----------
    records : of one setting
    temperatures, voltages : of the damper's conditions, rising; a single None where there is none

    Returns
    -------
    the envelope; conditions within 5 % of the fastest one count as equally fast
    """
    T, U = (np.array([value or 0.0 for value in values]) for values in (temperatures, voltages))
    speeds = np.full((T.size, U.size), np.nan)
    cells = [_cells(record, T, U) for record in records]
    for i, j in np.ndindex(speeds.shape):
        mine = [np.abs(r.velocity[cell == i * U.size + j]) for r, cell in zip(records, cells, strict=True)]
        speeds[i, j] = max((float(np.quantile(v, QUANTILE)) for v in mine if v.size), default=np.nan)
    if np.isfinite(speeds).any():
        speeds[speeds >= SAME_TESTS * np.nanmax(speeds)] = np.nanmax(speeds)
    return ReachedSpeeds(T, U, speeds)


def _cells(record: Record, temperatures: Array, voltages: Array) -> NDArray[np.int64]:
    """Return the (n,) index of the nearest condition of each sample."""
    i = np.zeros(record.time.size, dtype=np.int64) + _nearest(temperatures, record.temperature)
    return i * voltages.size + _nearest(voltages, record.voltage)


def _nearest(nodes: Array, values: Array | None) -> NDArray[np.int64]:
    """Return the (n,) indices of the nearest nodes, (1,) where there is no choice."""
    if values is None or nodes.size == 1:
        return np.zeros(1, dtype=np.int64)
    return np.asarray(np.searchsorted((nodes[1:] + nodes[:-1]) / 2.0, values))


# --- Nodes and rows ---

HALVINGS = 5
"""An interval between two nodes is halved at most so often: a step in a law would be halved without end."""


@dataclass(frozen=True, eq=False)
class TableNodes:
    """The nodes of the table."""

    temperatures: tuple[float | None, ...]
    """[degC]"""
    voltages: tuple[float | None, ...]
    """[V]"""
    speeds: Array
    """(n,) rising from 0 [m/s]."""

    @property
    def velocities(self) -> Array:
        """(2 n,) rising velocities, with -0 and +0 in the middle [m/s]."""
        return np.concatenate([-self.speeds[::-1], self.speeds])


def voltages_of(damper: Damper) -> tuple[float | None, ...]:
    """Return the voltages at which the damper's parameters are given, rising; (None,) without a control signal."""
    nodes = {row.voltage_V for row in damper.base if row.voltage_V is not None}
    if not nodes:
        return (None,)
    for values in damper.effects.values():
        listed = values.get(NODE_VOLTAGES)
        nodes |= set(listed) if isinstance(listed, tuple) else set()
    return tuple(sorted(nodes))


def temperatures_of(damper: Damper) -> tuple[float | None, ...]:
    """Return the temperatures at which the damper's parameters are given, rising; (None,) where none was recorded."""
    nodes = {row.temperature_degC for row in damper.base if row.temperature_degC is not None}
    return tuple(sorted(nodes)) or (None,)


def grid(
    config: TableConfig, damper: Damper, temperatures: Sequence[float | None], envelope: ReachedSpeeds
) -> TableNodes:
    """Find nodes between which straight lines follow the damper's law within the tolerance.

    Parameters
    ----------
    config : the block table: tolerance, and nodes that are given
    damper : with its effects
    temperatures : of the table, rising; a single None where there is none [degC]
    envelope : speeds that the tests reached

    Returns
    -------
    temperatures, voltages and speeds of the table
    """
    voltages = voltages_of(damper)
    if config.voltages_V is not None and voltages != (None,):
        voltages = tuple(sorted(set(config.voltages_V)))
    speeds = _speeds(config, envelope)
    both = np.concatenate([-speeds[::-1], speeds])
    warm = temperatures[0]

    allowed = config.tolerance * max(float(np.max(np.abs(steady_force(damper, u, warm, both)))) for u in voltages)
    given = np.array([u for u in voltages if u is not None])

    def over_voltage(at: Array) -> Array:
        return steady_force(damper, at[:, np.newaxis], warm, both)

    def over_speed(at: Array) -> Array:
        pairs = at[:, np.newaxis, np.newaxis] * np.array([-1.0, 1.0])
        return steady_force(damper, given[:, np.newaxis] if given.size else None, warm, pairs).reshape(at.size, -1)

    if config.voltages_V is None and given.size:
        given = refined(given, over_voltage, allowed)
    return TableNodes(tuple(temperatures), tuple(map(float, given)) or (None,), refined(speeds, over_speed, allowed))


def _speeds(config: TableConfig, envelope: ReachedSpeeds) -> Array:
    """Return speeds spaced by their square root, and those of the envelope."""
    tested = np.unique(envelope.speeds[np.isfinite(envelope.speeds)])
    largest = max(config.speed_max_m_per_s, *tested) if tested.size else config.speed_max_m_per_s
    even = largest * np.linspace(0.0, 1.0, config.speed_points + 1) ** 2
    apart = [v for v in even[1:] if tested.size == 0 or np.min(np.abs(tested - v)) > 1e-3 * largest]
    return np.unique(np.concatenate([[0.0], apart, tested[tested > 0.0]]))


def refined(nodes: Array, law: Callable[[Array], Array], allowed: float) -> Array:
    """Halve intervals between nodes until the straight line across each deviates by no more than `allowed`.

    Parameters
    ----------
    nodes : (m,) rising
    law : values (k, n) of the law at k nodes
    allowed : largest error at the middle of an interval, in units of the law

    Returns
    -------
    the nodes and those added between them, rising

    Examples
    --------
    >>> refined(np.array([0.0, 1.0]), lambda x: x[:, np.newaxis] ** 2, 0.1).tolist()
    [0.0, 0.5, 1.0]
    """
    found, values = nodes, law(nodes)
    wide = np.arange(nodes.size - 1)
    for _ in range(HALVINGS):
        middles = 0.5 * (found[wide] + found[wide + 1])
        there = law(middles)
        off = np.max(np.abs(there - 0.5 * (values[wide] + values[wide + 1])), axis=1) > allowed
        if not np.any(off):
            break
        after = wide[off] + 1
        found, values = np.insert(found, after, middles[off]), np.insert(values, after, there[off], axis=0)
        first = after - 1 + np.arange(after.size)
        wide = np.sort(np.concatenate([first, first + 1]))
    return found


def force_rows(config: TableConfig, damper: Damper, nodes: TableNodes, envelope: ReachedSpeeds) -> tuple[ForceRow, ...]:
    """Return one row per node; outside the envelope clamped, empty or by the model, as the config says.

    Parameters
    ----------
    config : the block table: what stands outside of the envelope
    damper : with its effects
    nodes : of the table
    envelope : speeds that the tests reached

    Returns
    -------
    rows by temperature, voltage and velocity, rising in this order
    """
    rows: list[ForceRow] = []
    velocity = nodes.velocities
    for temperature, voltage in ((T, U) for T in nodes.temperatures for U in nodes.voltages):
        limit = envelope.speed_at(temperature, voltage)
        inside = np.abs(velocity) <= limit * (1.0 + _ROUNDING)
        asked = np.copysign(np.minimum(np.abs(velocity), limit), velocity) if config.outside == "clamp" else velocity
        values = steady_force(damper, voltage, temperature, asked)
        rows += [
            ForceRow(
                temperature_degC=temperature,
                voltage_V=voltage,
                velocity_m_per_s=float(v),
                force_N=None if config.outside == "error" and not within else float(force),
                inside=1 if within else 0,
            )
            for v, force, within in zip(velocity, values, inside, strict=True)
        ]
    return tuple(rows)


# --- Notes: what the table cannot hold, and where force falls with voltage ---

VISIBLE_IN_TABLE = 1e-9
"""An effect is in the table if it changes a force by more than this share of the largest: rounding alone is less."""
FALLS = 1e-6
"""Force falls with voltage where it does so by more than this share of the largest force: less is rounding."""


def lost(damper: Damper, temperatures: tuple[float | None, ...], velocity: Array) -> tuple[str, ...]:
    """List what the table drops: the memory of k, effects without part in steady slip, and forces at rest.

    Parameters
    ----------
    damper : with its effects
    temperatures : of the table [degC]
    velocity : (n,) of the table [m/s]
    """
    lags = [1e3 * row.C_Ns_per_m / row.k_N_per_m for row in damper.base]
    ends = " to ".join(dict.fromkeys(f"{lag:.3g}" for lag in (min(lags), max(lags))))
    notes = [f"memory of the oil spring k: the force lags by C/k = {ends} ms"]
    for name, values in damper.effects.items():
        if not _in_table(damper, name, temperatures, velocity):
            alone = damper.model_copy(update={"effects": {name: values}})
            rests = any(static_force(alone, voltage) != 0.0 for voltage in voltages_of(damper))
            why = "it acts at rest too, and is left to the static balance" if rests else "steady slip does not show it"
            notes.append(f"{name}: {known()[name].law} ({why})")
    return tuple(notes)


def _in_table(damper: Damper, name: str, temperatures: tuple[float | None, ...], velocity: Array) -> bool:
    """Return whether the table would differ without an effect."""
    without = damper.without_effects(name)
    for temperature in temperatures:
        for voltage in voltages_of(damper):
            full = steady_force(damper, voltage, temperature, velocity)
            change = np.max(np.abs(full - steady_force(without, voltage, temperature, velocity)))
            if change > VISIBLE_IN_TABLE * np.max(np.abs(full)):
                return True
    return False


def not_monotone(
    damper: Damper, temperatures: tuple[float | None, ...], velocity: Array, control: Control
) -> tuple[str, ...]:
    """List where the size of the force falls with rising voltage although it rises on the whole, or vice versa.

    Parameters
    ----------
    damper : with its effects
    temperatures : of the table [degC]
    velocity : (n,) of the table, mirrored [m/s]
    control : the control signal, for the text

    Returns
    -------
    one line per temperature, direction and pair of voltages, with the speeds and the rule
    """
    voltages = [u for u in voltages_of(damper) if u is not None]
    half = velocity.size // 2
    found: list[str] = []
    rule = f"the lowest {control.name} that gives the force is taken"  # as `table_voltage` does
    for temperature in temperatures:
        sides = {}
        for name, branch in (("rebound", velocity[half:]), ("compression", velocity[half - 1 :: -1])):
            size = np.array([np.sign(branch[-1]) * steady_force(damper, u, temperature, branch) for u in voltages])
            sides[name] = _falls(voltages, size, np.abs(branch), control.unit)
        place = "" if temperature is None else f"{temperature:g} degC, "
        if sides["rebound"] == sides["compression"]:
            found += [f"{place}{line}; {rule}" for line in sides["rebound"]]
        else:
            found += [f"{place}{name}, {line}; {rule}" for name, lines in sides.items() for line in lines]
    return tuple(found)


def _falls(voltages: list[float], size: Array, speeds: Array, unit: str) -> list[str]:
    """List the pairs of voltages between which the (m, n) size of the force goes against its trend."""
    if len(voltages) < 2:
        return []
    trend = 1.0 if float(np.sum(size[-1] - size[0])) >= 0.0 else -1.0
    verb = "falls" if trend > 0.0 else "rises"
    lines: list[str] = []
    for i, (low, high) in enumerate(pairwise(voltages)):
        change = trend * (size[i + 1] - size[i])
        falling = (change < -FALLS * float(np.max(np.abs(size)))).tolist()
        for falls, members in groupby(range(change.size), key=falling.__getitem__):
            if falls:
                run = list(members)
                start, end = _zero_of(change, speeds, run[0], -1), _zero_of(change, speeds, run[-1], 1)
                lines.append(f"{_interval(start, end, speeds)}: force {verb} from {low:g} to {high:g} {unit}")
    return lines


def _zero_of(change: Array, speeds: Array, j: int, towards: int) -> float:
    """Return the speed at which a change is zero, on the straight line from node j to the next one."""
    other = j + towards
    if not 0 <= other < speeds.size:
        return float(speeds[j])
    share = change[j] / (change[j] - change[other])
    return float(speeds[j] + min(max(share, 0.0), 1.0) * (speeds[other] - speeds[j]))


def _interval(start: float, end: float, speeds: Array) -> str:
    """Describe an interval of the speeds."""
    if start <= speeds[0] and end >= speeds[-1]:
        return "at every speed"
    if start <= speeds[0]:
        return f"below {end:.3g} m/s"
    if end >= speeds[-1]:
        return f"above {start:.3g} m/s"
    return f"from {start:.3g} to {end:.3g} m/s"
