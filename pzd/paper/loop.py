"""The settled loop of a damper in a sinusoidal test, exact and free of noise: its peak and its force at rest."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pzd.damper.compose import respond
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.paper.published import Published
from pzd.record import Array

_SAMPLES = 2000
"""In a cycle, unless asked for otherwise; a multiple of 4."""
_CYCLES = 2  # the second is settled


@dataclass(frozen=True, eq=False)
class Loop:
    """One settled cycle; every array is (n,)."""

    displacement: Array
    velocity: Array
    force: Array

    @property
    def peak(self) -> float:
        """Largest |F| [N]."""
        return float(np.max(np.abs(self.force)))

    @property
    def at_zero(self) -> float:
        """Mean |F| of both branches at v = 0 [N]."""
        quarter = self.force.size // 4
        return float(0.5 * (abs(self.force[quarter]) + abs(self.force[3 * quarter])))


def loop_of(
    damper: Damper,
    frequency: float,
    amplitude: float,
    voltage: float | None,
    temperature: float | None,
    samples: int = _SAMPLES,
) -> Loop:
    """The settled loop of a damper under x = A sin(2 pi f t).

    Parameters
    ----------
    damper : the damper
    frequency : f [Hz]
    amplitude : A [m]
    voltage : constant [V]; None where the damper has none
    temperature : constant [degC]; None where the damper has none
    samples : in a cycle, a multiple of 4
    """
    rate = 2.0 * math.pi * frequency
    time = np.arange(_CYCLES * samples + 1) / (samples * frequency)
    phase = rate * time
    constant = [None if value is None else np.full(time.size, value) for value in (voltage, temperature)]
    x, v, a = amplitude * np.sin(phase), amplitude * rate * np.cos(phase), -amplitude * rate**2 * np.sin(phase)
    force = respond(damper, Motion(time, x, v, a, *constant))
    last = slice((_CYCLES - 1) * samples, -1)
    return Loop(x[last], v[last], force[last])


def loop_in(damper: Damper, row: Published) -> Loop:
    """The settled loop of a damper in the test of a published row.

    Raises
    ------
    ValueError : when the row is no test of the damper
    """
    if row.frequency_Hz is None or row.amplitude_m is None:
        raise ValueError(f"{row.id} is no test of the damper")
    return loop_of(damper, row.frequency_Hz, row.amplitude_m, row.voltage_V, row.temperature_C)
