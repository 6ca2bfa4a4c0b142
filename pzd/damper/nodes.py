"""A damper laid out by its nodes of voltage, for compiled loops."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pzd.damper.columns import PARALLEL
from pzd.damper.compose import drive_row_of, element_rows
from pzd.damper.material import base_voltages
from pzd.damper.model import Damper
from pzd.damper.values import columns_of
from pzd.record import Array


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
