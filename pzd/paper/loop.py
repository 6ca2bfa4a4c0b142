"""The settled loop of a damper in a sinusoidal test, exact and free of noise: its peak and its force at rest."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pzd.damper.compose import respond
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.record import Array
from pzd.report.reference import Expected

SAMPLES = 2000
"""In a cycle, unless asked for otherwise; a multiple of 4."""
_CYCLES = 2
"""The second is settled: an oil spring forgets its start with C / k, some 20 ms, a small part of one cycle."""


@dataclass(frozen=True, eq=False)
class Loop:
    """One closed cycle: the last sample is the first of the next one; every array is (n,)."""

    displacement: Array
    velocity: Array
    force: Array
    time: Array

    @property
    def peak(self) -> float:
        """Largest |F| [N]."""
        return float(np.max(np.abs(self.force)))

    @property
    def at_zero(self) -> float:
        """Mean |F| of both branches at v = 0 [N], where the cycle is one of `loop_of`."""
        quarter = self.force.size // 4
        return float(0.5 * (abs(self.force[quarter]) + abs(self.force[3 * quarter])))


def loop_of(
    damper: Damper,
    frequency: float,
    amplitude: float,
    voltage: float | None = None,
    temperature: float | None = None,
    samples: int = SAMPLES,
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

    Returns
    -------
    the loop, of samples + 1 points, the time counted from its first
    """
    rate = 2.0 * math.pi * frequency
    time = np.arange(_CYCLES * samples + 1) / (samples * frequency)
    phase = rate * time
    constant = [None if value is None else np.full(time.size, value) for value in (voltage, temperature)]
    x, v = amplitude * np.sin(phase), amplitude * rate * np.cos(phase)
    force = respond(damper, Motion(time, x, v, -rate * rate * x, *constant))
    last = slice((_CYCLES - 1) * samples, None)
    return Loop(x[last], v[last], force[last], time[: samples + 1])


def loop_in(damper: Damper, row: Expected) -> Loop:
    """The settled loop of a damper in the test of a published row.

    Raises
    ------
    ValueError : when the row is no test of the damper
    """
    if row.frequency_Hz is None or row.amplitude_m is None:
        raise ValueError(f"{row.id} is no test of the damper")
    return loop_of(damper, row.frequency_Hz, row.amplitude_m, row.voltage_V, row.temperature_degC)
