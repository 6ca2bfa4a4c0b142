"""Interpolation in a force table: force, range of force and voltage at any voltage and velocity, and its inverse."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pzd.artefacts import ForceRow, InverseRow, Table
from pzd.compiled import compiled
from pzd.force_table.config import TableConfig
from pzd.record import Array
from pzd.schema.errors import DataError

# --- Interpolation in the compiled code of the ride; the one place where a table is interpolated ---
#
# Between nodes the force is linear in the voltage and linear in the speed, as the damper's own parameters are linear in
# the voltage: it never overshoots, preserves every rise, and its inverse at a given speed is a line as well, so that
# force and inverse agree to rounding. The branches v >= +0 and v <= -0 are two arrays: none is interpolated across 0.


@compiled
def bracket(nodes: Array, value: float) -> int:
    """Find the index i of the interval nodes[i] <= value <= nodes[i + 1], the outermost one beyond the ends."""
    low, high = 0, nodes.size - 1
    while high - low > 1:
        middle = (low + high) // 2
        if nodes[middle] <= value:
            low = middle
        else:
            high = middle
    return low


@compiled
def table_force(
    voltages: Array, speeds: Array, rebound: Array, compression: Array, voltage: float, velocity: float
) -> float:
    """Interpolate the force at one voltage and velocity; constant beyond the outermost nodes.

    Equation: F = sum over the cell's corners of w_U w_v F_ij, w linear      Source: bilinear interpolation

    Parameters
    ----------
    voltages : (m,) rising [V]
    speeds : (n,) rising from 0 [m/s]
    rebound : (m, n) force at +speed, its first column at v = +0 [N]
    compression : (m, n) force at -speed, its first column at v = -0 [N]
    voltage : control signal [V]
    velocity : rate of extension; the sign bit of 0 picks the side [m/s]

    Returns
    -------
    force [N], NaN where the table has no value
    """
    side = compression if math.copysign(1.0, velocity) < 0.0 else rebound
    j = bracket(speeds, abs(velocity))
    share = min((abs(velocity) - speeds[j]) / (speeds[j + 1] - speeds[j]), 1.0)
    if voltages.size == 1 or voltage <= voltages[0]:
        return _along(side[0], j, share)
    if voltage >= voltages[-1]:
        return _along(side[-1], j, share)
    i = bracket(voltages, voltage)
    weight = (voltage - voltages[i]) / (voltages[i + 1] - voltages[i])
    low, high = _along(side[i], j, share), _along(side[i + 1], j, share)
    return float(low + weight * (high - low))


@compiled
def table_voltage(
    voltages: Array, speeds: Array, rebound: Array, compression: Array, force: float, velocity: float
) -> float:
    """Find the lowest voltage that gives a force at a velocity.

    Equation: U = U_i + (F - F_i) (U_i+1 - U_i) / (F_i+1 - F_i) in the first interval that holds F
                                                                Source: inverse of the linear interpolation

    Parameters
    ----------
    voltages, speeds, rebound, compression : the table, as for `table_force`
    force : wanted force [N]
    velocity : rate of extension; the sign bit of 0 picks the side [m/s]

    Returns
    -------
    voltage [V], NaN where none gives the force
    """
    side = compression if math.copysign(1.0, velocity) < 0.0 else rebound
    j = bracket(speeds, abs(velocity))
    share = min((abs(velocity) - speeds[j]) / (speeds[j + 1] - speeds[j]), 1.0)
    before = _along(side[0], j, share)
    if force == before:
        return float(voltages[0])
    for i in range(voltages.size - 1):
        after = _along(side[i + 1], j, share)
        if min(before, after) <= force <= max(before, after):
            step = (force - before) / (after - before) if after != before else 0.0
            return float(voltages[i] + step * (voltages[i + 1] - voltages[i]))
        if force == after:  # next to an empty cell
            return float(voltages[i + 1])
        before = after
    return float(np.nan)


@compiled
def table_range(speeds: Array, rebound: Array, compression: Array, velocity: float) -> tuple[float, float]:
    """Find the lowest and highest force that any voltage gives at a velocity.

    Parameters
    ----------
    speeds, rebound, compression : the table, as for `table_force`
    velocity : rate of extension; the sign bit of 0 picks the side [m/s]

    Returns
    -------
    lowest and highest force [N], infinite the wrong way round (inf, -inf) where the table has no value
    """
    side = compression if math.copysign(1.0, velocity) < 0.0 else rebound
    j = bracket(speeds, abs(velocity))
    share = min((abs(velocity) - speeds[j]) / (speeds[j + 1] - speeds[j]), 1.0)
    low, high = np.inf, -np.inf
    for i in range(side.shape[0]):
        force = _along(side[i], j, share)
        if not math.isnan(force):
            low, high = min(low, force), max(high, force)
    return low, high


@compiled
def _along(column: Array, j: int, share: float) -> float:
    """Interpolate between two speeds of one voltage; exact at the nodes, also next to an empty cell."""
    if share <= 0.0:
        return float(column[j])
    if share >= 1.0:
        return float(column[j + 1])
    return float(column[j] + share * (column[j + 1] - column[j]))


# --- A table at one temperature ---

FAR = 1000.0
"""Speed to which the outermost interval is extended [m/s]: no suspension is faster."""


@dataclass(frozen=True, eq=False)
class Lookup:
    """A force table at one temperature as regular arrays, from which the compiled functions above interpolate.

    The last speed is a node at `FAR`, with the last force where the table clamps, along the last slope where it goes on
    with the model, and without a value (NaN) where it ends.
    """

    voltages: Array
    """(m,) rising [V]; a single 0 where the damper has no control signal."""
    speeds: Array
    """(n,) rising from 0 to `FAR` [m/s]."""
    rebound: Array
    """(m, n) force at +speed, first column v = +0 [N]; NaN where the table is empty."""
    compression: Array
    """(m, n) force at -speed, first column v = -0 [N]; NaN where the table is empty."""
    envelope: Array
    """(m,) largest tested speed at each voltage [m/s]."""

    @property
    def arrays(self) -> tuple[Array, Array, Array, Array]:
        """The first arguments of the compiled functions."""
        return self.voltages, self.speeds, self.rebound, self.compression

    @classmethod
    def of(cls, table: Table, temperature: float | None = None) -> Self:
        """Return the table at one temperature, linear between its temperatures and constant beyond them.

        Parameters
        ----------
        table : the artefact
        temperature : damper temperature [degC]; None for the lowest of the table

        Raises
        ------
        DataError : when the rows are no regular grid, as after a careless edit
        """
        slices = _slices(table.force)
        known = [t for t in slices if t is not None]
        if temperature is None or len(known) < 2:
            weights = {min(slices, key=lambda t: t if t is not None else -np.inf): 1.0}
        else:
            weights = _weights(sorted(known), temperature)
        forces = np.asarray(sum(weight * slices[t][2] for t, weight in weights.items()))
        inside = np.all([slices[t][3] for t in weights], axis=0)
        voltages, velocity = next(iter(slices.values()))[:2]
        clamped = table.notes.outside == "clamp"
        half = velocity.size // 2
        speeds = np.append(velocity[half:], FAR)
        rebound = _extended(speeds, forces[:, half:], clamped)
        compression = _extended(speeds, forces[:, half - 1 :: -1], clamped)
        envelope = np.max(np.where(inside, np.abs(velocity), 0.0), axis=1)
        return cls(voltages, speeds, rebound, compression, envelope)

    def force(self, voltage: ArrayLike, velocity: ArrayLike) -> Array:
        """Interpolate the force [N] at voltages and velocities (broadcast); NaN where the table ends."""
        U, v = _broadcast(voltage, velocity)
        return np.reshape([table_force(*self.arrays, *each) for each in zip(U.flat, v.flat, strict=True)], U.shape)

    def range(self, velocity: ArrayLike) -> tuple[Array, Array]:
        """Find the range of force [N] that the voltages give at velocities; (inf, -inf) where the table ends."""
        v = np.asarray(velocity, dtype=np.float64)
        ends = [table_range(self.speeds, self.rebound, self.compression, each) for each in v.flat]
        low, high = np.reshape(ends, (-1, 2)).T
        return low.reshape(v.shape), high.reshape(v.shape)

    def voltage_for(self, force: ArrayLike, velocity: ArrayLike) -> Array:
        """Find the lowest voltage [V] that gives a force at a velocity (broadcast); NaN where none does."""
        F, v = _broadcast(force, velocity)
        return np.reshape([table_voltage(*self.arrays, *each) for each in zip(F.flat, v.flat, strict=True)], F.shape)

    def nearest_voltage_for(self, force: ArrayLike, velocity: ArrayLike) -> Array:
        """Find the lowest voltage [V] whose force comes nearest to the wanted one; NaN where the table ends."""
        F, v = _broadcast(force, velocity)
        low, high = self.range(v)
        found = self.voltage_for(np.clip(F, low, high), v)
        gap = np.isnan(found) & (low <= high)
        nodes = self.force(self.voltages[:, np.newaxis], v[gap])
        found[gap] = self.voltages[np.nanargmin(np.abs(nodes - F[gap]), axis=0)] if gap.any() else found[gap]
        return found


def _broadcast(first: ArrayLike, second: ArrayLike) -> tuple[Array, Array]:
    """Return two arrays of numbers in one shape."""
    a, b = np.broadcast_arrays(np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64))
    return a, b


def _extended(speeds: Array, forces: Array, clamped: bool) -> Array:
    """Return a branch with one more node at `FAR`: constant, or along the last slope (NaN stays NaN)."""
    last = forces[:, -1]
    slope = 0.0 if clamped or forces.shape[1] < 2 else (last - forces[:, -2]) / (speeds[-2] - speeds[-3])
    return np.ascontiguousarray(np.column_stack([forces, last + slope * (speeds[-1] - speeds[-2])]))


def _weights(temperatures: list[float], wanted: float) -> dict[float | None, float]:
    """Return the weights of the temperatures on either side."""
    at = float(np.interp(wanted, temperatures, np.arange(len(temperatures))))
    low = min(int(at), len(temperatures) - 2)
    shares = {temperatures[low]: 1.0 - (at - low), temperatures[low + 1]: at - low}
    return {t: share for t, share in shares.items() if share > 0.0}


def _slices(rows: tuple[ForceRow, ...]) -> dict[float | None, tuple[Array, Array, Array, NDArray[np.bool_]]]:
    """Return voltages, velocities, forces and inside of each temperature, after a check that they are one grid."""
    found: dict[float | None, tuple[Array, Array, Array, NDArray[np.bool_]]] = {}
    for temperature in dict.fromkeys(row.temperature_degC for row in rows):
        mine = [row for row in rows if row.temperature_degC == temperature]
        found[temperature] = _grid(mine, "rig" if temperature is None else f"{temperature:g} degC")
    first = next(iter(found.values()), None)
    if first is None:
        raise DataError("force.csv: no data rows; run the stage again")
    for temperature, grid in found.items():
        if not (np.array_equal(grid[0], first[0]) and np.array_equal(grid[1], first[1])):
            raise DataError(f"force.csv: {temperature} degC has other voltages or velocities than the rows before it")
    return found


def _grid(rows: list[ForceRow], place: str) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """Return voltages (m,), velocities (n,), forces (m, n) and inside (m, n) of one temperature.

    Raises
    ------
    DataError : when they are no grid; with the place
    """
    voltages = np.array([0.0 if u is None else u for u in dict.fromkeys(row.voltage_V for row in rows)])
    if len(rows) % voltages.size:
        raise DataError(f"force.csv: {place}: not the same velocities at every voltage")
    shape = (voltages.size, -1)
    velocity = np.array([row.velocity_m_per_s for row in rows]).reshape(shape)
    forces = np.array([np.nan if row.force_N is None else row.force_N for row in rows]).reshape(shape)
    inside = np.array([row.inside == 1 for row in rows]).reshape(shape)
    half = velocity.shape[1] // 2
    regular = (
        np.all(velocity == velocity[0])
        and velocity.shape[1] == 2 * half >= 4
        and np.array_equal(velocity[0], -velocity[0][::-1])
        and bool(np.all(np.diff(velocity[0][half:]) > 0.0))
        and velocity[0][half] == 0.0
        and bool(np.all(np.diff(voltages) > 0.0))
    )
    if not regular:
        raise DataError(
            f"force.csv: {place}: the rows must be voltages rising, each with the same velocities "
            "rising, mirrored, with two rows -0.0 and 0.0"
        )
    return voltages, velocity[0], forces, inside


# --- The inverse table ---


def inverse_rows(config: TableConfig, table: Table) -> tuple[InverseRow, ...]:
    """Invert the table of force: voltage over velocity and force.

    At each speed the forces are spaced evenly from the least to the largest that the damper gives there, so that every
    row has its voltage. Where several voltages give the force the lowest is taken; a force within a gap of the table,
    tested at its ends and not between, gets no voltage or the one that comes nearest, as `unreachable` says. Speeds
    at which the table is empty are left out; without a control signal there are no rows.
    """
    if any(row.voltage_V is None for row in table.force):
        return ()
    rows: list[InverseRow] = []
    for temperature in dict.fromkeys(row.temperature_degC for row in table.force):
        lookup = Lookup.of(table, temperature)
        read = lookup.voltage_for if config.unreachable == "empty" else lookup.nearest_voltage_for
        speeds = lookup.speeds[:-1]
        for velocity in (*-speeds[::-1], *speeds):
            low, high = lookup.range(velocity)
            levels = np.unique(np.linspace(low, high, config.force_levels)) if low <= high else np.empty(0)
            rows += [
                InverseRow(
                    temperature_degC=temperature,
                    velocity_m_per_s=float(velocity),
                    force_N=float(force),
                    voltage_V=None if np.isnan(voltage) else float(voltage),
                )
                for force, voltage in zip(levels, read(levels, velocity), strict=True)
            ]
    return tuple(rows)
