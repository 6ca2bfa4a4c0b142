"""Reading a table: force, range of force and voltage at any voltage and velocity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pzd.artefacts import ForceRow, Table
from pzd.record import Array
from pzd.schema.errors import DataError

FAR = 1000.0
"""Speed to which the outermost interval is drawn out [m/s]."""


@dataclass(frozen=True, eq=False)
class Lookup:
    """The table at one temperature as regular arrays, for this class and for compiled loops.

    The arrays go into `table_force`, `table_voltage` and `table_range` of `pzd.table.kernel`.
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
        from pzd.table.kernel import table_forces

        U, v, out = _broadcast(voltage, velocity)
        table_forces(self.voltages, self.speeds, self.rebound, self.compression, U.ravel(), v.ravel(), out.reshape(-1))
        return out

    def range(self, velocity: ArrayLike) -> tuple[Array, Array]:
        """Lowest and highest force [N] that any voltage gives at velocities; (inf, -inf) where the table ends."""
        from pzd.table.kernel import table_ranges

        v, low = np.array(velocity, dtype=np.float64), np.empty(np.shape(velocity))
        high = np.empty_like(low)
        table_ranges(self.speeds, self.rebound, self.compression, v.ravel(), low.reshape(-1), high.reshape(-1))
        return low, high

    def voltage_for(self, force: ArrayLike, velocity: ArrayLike) -> Array:
        """Lowest voltage [V] that gives a force at a velocity (broadcast); NaN where none does."""
        from pzd.table.kernel import table_voltages

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
