"""The parameter row at a voltage, or along a voltage that moves: linear between the nodes of a damper."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pzd.compiled import compiled
from pzd.damper.compiled.columns import PARALLEL, columns_of
from pzd.damper.compiled.kernels import Row, interpolate, row_of
from pzd.damper.compose import drive_row_of, element_rows
from pzd.damper.material import base_voltages
from pzd.damper.model import Damper
from pzd.record import Array

# ----------------------------------------------------------------------------------------------------


@compiled
def row_at(voltages: Array, rows: Array, voltage: float) -> Row:
    """The parameter row at an effective voltage, linear between the (m,) nodes, held beyond them."""
    last = voltages.size - 1
    if last == 0 or voltage <= voltages[0]:
        return row_of(rows[0])
    if voltage >= voltages[last]:
        return row_of(rows[last])
    i = np.searchsorted(voltages, voltage, side="right") - 1
    share = (voltage - voltages[i]) / (voltages[i + 1] - voltages[i])
    return interpolate(row_of(rows[i]), row_of(rows[i + 1]), share)


def rows_along(voltages: Array, rows: Array, effective: Array) -> Array:
    """Parameter rows along an effective voltage, linear between the nodes, held beyond them.

    Parameters
    ----------
    voltages : (k,) rising nodes [V]
    rows : (k, r) rows at the nodes
    effective : (n,) effective voltage [V]

    Returns
    -------
    (n, r), or (1, r) where they are the same at every node
    """
    if np.all(rows == rows[0]):
        return rows[:1].copy()
    found = np.empty((effective.size, rows.shape[1]))
    _fill(voltages, np.ascontiguousarray(rows), effective, found)
    return found


@compiled
def _fill(voltages: Array, rows: Array, effective: Array, found: Array) -> None:
    last, i = voltages.size - 1, 0
    for n in range(effective.size):
        voltage = min(max(effective[n], voltages[0]), voltages[last])
        while i > 0 and voltage < voltages[i]:
            i -= 1
        while i < last - 1 and voltage >= voltages[i + 1]:
            i += 1
        share = (voltage - voltages[i]) / (voltages[i + 1] - voltages[i])
        for c in range(rows.shape[1]):
            a, b = rows[i, c], rows[i + 1, c]
            found[n, c] = a if a == b else a + (b - a) * share


# ----------------------------------------------------------------------------------------------------
# A damper laid out by its nodes of voltage, for compiled loops.


@dataclass(frozen=True, eq=False)
class Nodes:
    """A damper at one temperature: all of it piecewise linear in the effective voltage."""

    voltages: Array
    """(m,) rising nodes [V]; held beyond."""
    rows: Array
    """(m, r) parameter rows of the element."""
    parallel: Array
    """(m, b) rows of the parallel effects, columns as `columns.PARALLEL`."""
    drive: Array
    """(d,) row of the drive, columns as `columns.DRIVE`."""


def nodes_of(damper: Damper, temperature: float | None) -> Nodes:
    """The damper at one temperature [degC], laid out for compiled loops."""
    listed = [values["at_voltage_V"] for values in damper.effects.values() if "at_voltage_V" in values]
    voltages = np.unique(np.concatenate([base_voltages(damper), *(np.atleast_1d(v) for v in listed)]))
    shape = (voltages.size, -1)
    rows = element_rows(damper, voltages, temperature)
    parallel = columns_of(damper, PARALLEL, voltages)
    return Nodes(
        voltages,
        np.broadcast_to(rows, (voltages.size, rows.shape[1])).reshape(shape).copy(),
        np.broadcast_to(parallel, (voltages.size, parallel.shape[1])).copy(),
        drive_row_of(damper),
    )
