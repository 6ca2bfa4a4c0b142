"""The speeds that the rig reached, at each voltage and temperature of the damper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pzd.record import Array, Record

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
