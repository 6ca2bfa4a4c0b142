"""The voltage as the valve feels it: supply, valve and actuator, one behind the other."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pzd.compiled import compiled
from pzd.damper.columns import DRIVE, NEUTRAL
from pzd.damper.kernels import follow_voltage
from pzd.record import Array


def drive_row(effects: Mapping[str, Mapping[str, float]]) -> Array:
    """(d,) the row of the drive of some effects, the others switched off."""
    return np.array([effects.get(name, {}).get(parameter, NEUTRAL[name, parameter]) for name, parameter in DRIVE])


def effective_voltage(voltage: Array, steps: Array, row: Array) -> Array:
    """Voltage as the valve feels it, at rest with the first sample.

    Parameters
    ----------
    voltage : (n,) control signal, linear between samples [V]
    steps : (n - 1,) or (1,) sampling intervals [s]
    row : (d,) parameters of the drive effects, see `drive_row`

    Returns
    -------
    (n,) effective voltage [V]
    """
    effective = np.empty_like(voltage)
    _follow(voltage, steps, row, np.full(len(DRIVE), voltage[0]), effective)
    return effective


@compiled
def _follow(voltage: Array, steps: Array, row: Array, state: Array, effective: Array) -> None:
    effective[0] = voltage[0]
    for i in range(1, voltage.size):
        effective[i] = follow_voltage(voltage[i - 1], voltage[i], steps[min(i - 1, steps.size - 1)], state, row)
