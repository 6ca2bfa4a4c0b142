"""Reading a table: force, range of force and voltage at any voltage and velocity."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pzd.artefacts import ForceRow, InverseRow, Table
from pzd.compiled import compiled
from pzd.force_table.config import TableConfig
from pzd.record import Array
from pzd.schema.errors import DataError

# ----------------------------------------------------------------------------------------------------
# The table as regular arrays, read by compiled code: the one place where it is interpolated.
#
# Between nodes the force is linear in the voltage and linear in the speed, as the damper's own
# parameters are linear in the voltage: it never overshoots, keeps every rise, and its inverse at a
# given speed is a line as well, so that force and inverse agree to rounding. The branches v >= +0
# and v <= -0 are two arrays: nothing is ever interpolated across v = 0.


@compiled
def bracket(nodes: Array, value: float) -> int:
    """Index i of the interval nodes[i] <= value <= nodes[i + 1], the outermost one beyond the ends."""
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
    """Force at one voltage and velocity; held beyond the outermost nodes.

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
    """Lowest voltage that gives a force at a velocity.

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
        if force == after:  # beside an empty cell
            return float(voltages[i + 1])
        before = after
    return float(np.nan)


@compiled
def table_range(speeds: Array, rebound: Array, compression: Array, velocity: float) -> tuple[float, float]:
    """Lowest and highest force that any voltage gives at a velocity.

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
    """Force between two speeds of one voltage; exact at the nodes, also beside an empty cell."""
    if share <= 0.0:
        return float(column[j])
    if share >= 1.0:
        return float(column[j + 1])
    return float(column[j] + share * (column[j + 1] - column[j]))


@compiled
def table_forces(
    voltages: Array, speeds: Array, rebound: Array, compression: Array, voltage: Array, velocity: Array, out: Array
) -> None:
    """Fill `out` (n,) with `table_force` of (n,) voltages and velocities."""
    for i in range(out.size):
        out[i] = table_force(voltages, speeds, rebound, compression, voltage[i], velocity[i])


@compiled
def table_voltages(
    voltages: Array, speeds: Array, rebound: Array, compression: Array, force: Array, velocity: Array, out: Array
) -> None:
    """Fill `out` (n,) with `table_voltage` of (n,) forces and velocities."""
    for i in range(out.size):
        out[i] = table_voltage(voltages, speeds, rebound, compression, force[i], velocity[i])


@compiled
def table_ranges(speeds: Array, rebound: Array, compression: Array, velocity: Array, low: Array, high: Array) -> None:
    """Fill `low` and `high` (n,) with `table_range` of (n,) velocities."""
    for i in range(velocity.size):
        low[i], high[i] = table_range(speeds, rebound, compression, velocity[i])


# ----------------------------------------------------------------------------------------------------


FAR = 1000.0
"""Speed to which the outermost interval is drawn out [m/s]."""


@dataclass(frozen=True, eq=False)
class Lookup:
    """The table at one temperature as regular arrays, for this class and for compiled loops.

    The arrays go into `table_force`, `table_voltage` and `table_range` of `pzd.force_table.lookup`.
    The last speed is a node drawn out to `FAR`: the last force where the table clamps, the last
    slope where it goes on with the model, no value (NaN) where it ends.
    """

    voltages: Array
    """(m,) rising [V]; a single 0 where the damper has no control signal."""
    speeds: Array
    """(n,) rising from 0 to `FAR` [m/s]."""
    rebound: Array
    """(m, n) force at +speed, first column v = +0 [N]; NaN where the table is empty."""
    compression: Array
    """(m, n) force at -speed, first column v = -0 [N]; NaN where the table is empty."""
    reach: Array
    """(m,) largest speed that the rig reached at each voltage [m/s]."""

    @classmethod
    def of(cls, table: Table, temperature: float | None = None) -> Self:
        """The table at one temperature, linear between its temperatures and held beyond them.

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
        forces = sum(weight * slices[t][2] for t, weight in weights.items())
        inside = np.all([slices[t][3] for t in weights], axis=0)
        voltages, velocity = next(iter(slices.values()))[:2]
        return cls._of_grid(voltages, velocity, np.asarray(forces), inside, table.notes.outside == "clamp")

    @classmethod
    def _of_grid(cls, voltages: Array, velocity: Array, forces: Array, inside: NDArray[np.bool_], held: bool) -> Self:
        half = velocity.size // 2
        speeds = np.append(velocity[half:], FAR)
        rebound = _drawn_out(speeds, forces[:, half:], held)
        compression = _drawn_out(speeds, forces[:, half - 1 :: -1], held)
        reach = np.max(np.where(inside, np.abs(velocity), 0.0), axis=1)
        return cls(voltages, speeds, rebound, compression, reach)

    def force(self, voltage: ArrayLike, velocity: ArrayLike) -> Array:
        """Force [N] at voltages and velocities (broadcast); NaN where the table ends."""
        U, v, out = _broadcast(voltage, velocity)
        table_forces(self.voltages, self.speeds, self.rebound, self.compression, U.ravel(), v.ravel(), out.reshape(-1))
        return out

    def range(self, velocity: ArrayLike) -> tuple[Array, Array]:
        """Lowest and highest force [N] that any voltage gives at velocities; (inf, -inf) where the table ends."""
        v, low = np.array(velocity, dtype=np.float64), np.empty(np.shape(velocity))
        high = np.empty_like(low)
        table_ranges(self.speeds, self.rebound, self.compression, v.ravel(), low.reshape(-1), high.reshape(-1))
        return low, high

    def voltage_for(self, force: ArrayLike, velocity: ArrayLike) -> Array:
        """Lowest voltage [V] that gives a force at a velocity (broadcast); NaN where none does."""
        F, v, out = _broadcast(force, velocity)
        table_voltages(
            self.voltages, self.speeds, self.rebound, self.compression, F.ravel(), v.ravel(), out.reshape(-1)
        )
        return out

    def nearest_voltage_for(self, force: ArrayLike, velocity: ArrayLike) -> Array:
        """Lowest voltage [V] whose force comes nearest to the wanted one; NaN where the table ends."""
        F, v, _ = _broadcast(force, velocity)
        low, high = self.range(v)
        found = self.voltage_for(np.clip(F, low, high), v)
        gap = np.isnan(found) & (low <= high)
        nodes = self.force(self.voltages[:, np.newaxis], v[gap])
        found[gap] = self.voltages[np.nanargmin(np.abs(nodes - F[gap]), axis=0)] if gap.any() else found[gap]
        return found

    def inside(self, voltage: ArrayLike, velocity: ArrayLike) -> NDArray[np.bool_]:
        """Whether the rig reached that speed at that voltage, linear between the voltages."""
        reached = np.interp(np.asarray(voltage, dtype=np.float64), self.voltages, self.reach)
        within: NDArray[np.bool_] = np.abs(velocity) <= reached * (1.0 + 1e-9)
        return within


def _broadcast(first: ArrayLike, second: ArrayLike) -> tuple[Array, Array, Array]:
    a, b = np.broadcast_arrays(np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64))
    return a.copy(), b.copy(), np.empty(a.shape)


def _drawn_out(speeds: Array, forces: Array, held: bool) -> Array:
    """The branch with one more node at `FAR`: held, or along the last slope (NaN stays NaN)."""
    last = forces[:, -1]
    slope = 0.0 if held or forces.shape[1] < 2 else (last - forces[:, -2]) / (speeds[-2] - speeds[-3])
    return np.ascontiguousarray(np.column_stack([forces, last + slope * (speeds[-1] - speeds[-2])]))


def _weights(temperatures: list[float], wanted: float) -> dict[float | None, float]:
    at = float(np.interp(wanted, temperatures, np.arange(len(temperatures))))
    low = min(int(at), len(temperatures) - 2)
    shares = {temperatures[low]: 1.0 - (at - low), temperatures[low + 1]: at - low}
    return {t: share for t, share in shares.items() if share > 0.0}


def _slices(rows: tuple[ForceRow, ...]) -> dict[float | None, tuple[Array, Array, Array, NDArray[np.bool_]]]:
    """Voltages, velocities, forces and inside of each temperature, checked to be one grid."""
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


# ----------------------------------------------------------------------------------------------------
# The voltage that gives a force at a speed, as rows of a regular table.


def inverse_rows(config: TableConfig, table: Table) -> tuple[InverseRow, ...]:
    """Voltage over velocity and force, read off the table of force.

    At each speed the forces are spaced evenly from the least to the largest that the damper gives there, so that
    every row has its voltage. Where several voltages give the force the lowest stands; a force within a gap of the
    table, whose ends were tested and whose middle was not, is empty or holds the voltage that comes nearest, as
    `unreachable` says. Speeds at which the table is empty are left out; so is all without a control signal.
    """
    if any(row.voltage_V is None for row in table.force):
        return ()
    rows: list[InverseRow] = []
    for temperature in dict.fromkeys(row.temperature_degC for row in table.force):
        lookup = Lookup.of(table, temperature)
        speeds = lookup.speeds[:-1]
        for velocity in (*-speeds[::-1], *speeds):
            rows += _at(config, lookup, temperature, float(velocity))
    return tuple(rows)


def _at(config: TableConfig, lookup: Lookup, temperature: float | None, velocity: float) -> Iterator[InverseRow]:
    low, high = lookup.range(velocity)
    if not low <= high:
        return
    read = lookup.voltage_for if config.unreachable == "empty" else lookup.nearest_voltage_for
    levels = np.unique(np.linspace(low, high, config.force_levels))
    for force, voltage in zip(levels, read(levels, velocity), strict=True):
        yield InverseRow(
            temperature_degC=temperature,
            velocity_m_per_s=velocity,
            force_N=float(force),
            voltage_V=None if np.isnan(voltage) else float(voltage),
        )
