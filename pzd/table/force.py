"""Force over temperature, voltage and velocity, from the damper at steady slip."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pzd.artefacts import ForceRow
from pzd.damper.compose import steady_force
from pzd.damper.model import Damper
from pzd.record import Array
from pzd.table.config import TableConfig
from pzd.table.reach import ReachedSpeed

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
    config: TableConfig,
    damper: Damper,
    temperature: float | None,
    voltage: float | None,
    velocity: Array,
    limit: float,
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
