"""Rows of parameters: from arrays to the tuples that kernels take, and linear between two of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pzd.compiled import compiled
from pzd.damper.flow import Row

Array = NDArray[np.float64]


@compiled
def _mix(a: float, b: float, share: float) -> float:
    return a if a == b else a + (b - a) * share  # equal infinities stand


@compiled
def interpolate(p: Row, q: Row, t: float) -> Row:
    """The parameter row at a share t of the way from p to q."""
    return (
        _mix(p[0], q[0], t),
        _mix(p[1], q[1], t),
        _mix(p[2], q[2], t),
        _mix(p[3], q[3], t),
        _mix(p[4], q[4], t),
        _mix(p[5], q[5], t),
        _mix(p[6], q[6], t),
        _mix(p[7], q[7], t),
        _mix(p[8], q[8], t),
        _mix(p[9], q[9], t),
    )


@compiled
def row_of(a: Array) -> Row:
    """A (10,) array as a parameter row."""
    return (a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8], a[9])


@compiled
def row_at(voltages: Array, rows: Array, voltage: float) -> Row:
    """The parameter row at a effective voltage, linear between the (m,) nodes, held beyond them."""
    last = voltages.size - 1
    if last == 0 or voltage <= voltages[0]:
        return row_of(rows[0])
    if voltage >= voltages[last]:
        return row_of(rows[last])
    i = np.searchsorted(voltages, voltage, side="right") - 1
    share = (voltage - voltages[i]) / (voltages[i + 1] - voltages[i])
    return interpolate(row_of(rows[i]), row_of(rows[i + 1]), share)
