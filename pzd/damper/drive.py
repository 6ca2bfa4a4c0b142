"""The voltage as the valve feels it: the lag of the valve and its supply, then the play of the stack."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pzd.compiled import compiled
from pzd.damper.effects import piezo_hysteresis, valve_lag

Array = NDArray[np.float64]

lagged = compiled(valve_lag.law)
with_play = compiled(piezo_hysteresis.law)


def effective_voltage(voltage: Array, steps: Array, tau: float, r: float) -> Array:
    """Voltage as the valve feels it, at rest with the first sample.

    Parameters
    ----------
    voltage : (n,) control signal, linear between samples [V]
    steps : (n - 1,) or (1,) sampling intervals [s]
    tau : time constant of the lag [s]
    r : half-width of the play [V]

    Returns
    -------
    (n,) effective voltage [V]
    """
    effective = np.empty_like(voltage)
    _follow_voltage(voltage, steps, tau, r, effective)
    return effective


@compiled
def _follow_voltage(voltage: Array, steps: Array, tau: float, r: float, effective: Array) -> None:
    late = voltage[0]
    effective[0] = late
    for i in range(1, voltage.size):
        late = lagged(late, voltage[i - 1], voltage[i], steps[min(i - 1, steps.size - 1)], tau)
        effective[i] = with_play(effective[i - 1], late, r)
