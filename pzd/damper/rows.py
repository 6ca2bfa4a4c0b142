"""The parameter row at a voltage: linear between the nodes of a damper."""

from __future__ import annotations

import numpy as np

from pzd.compiled import compiled
from pzd.damper.kernels import Row, interpolate, row_of
from pzd.record import Array


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
