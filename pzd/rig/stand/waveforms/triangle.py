"""A triangle: constant speed both ways, its corners rounded as a servo-hydraulic actuator rounds them.

Equation: x = (8 A / pi^2) sum (-1)^((h-1)/2) g(h f) sin(2 pi h f t) / h^2 over odd h,
          g = exp(-(ln 2 / 2) (h f / f_b)^2)
Source: Fourier series of the triangle; g is the Gaussian low-pass, -3 dB at f_b, which rounds
the corners without ringing, so that the speed stays 4 A f between them.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field

from pzd.rig.stand.waveforms import Course, Periodic
from pzd.signals.harmonics import FourierSum

_SMALLEST = 1e-10
"""Harmonics whose speed is below this share of the constant speed are left out."""


class Triangle(Periodic):
    """A motion of constant speed, band-limited."""

    kind: Literal["triangle"] = "triangle"
    """Constant speed both ways."""
    amplitude_m: float = Field(gt=0.0)
    """Amplitude of the triangle before its corners are rounded: the speed is 4 A f."""
    bandwidth_Hz: float = Field(default=30.0, gt=0.0)
    """Bandwidth of the actuator (-3 dB), which rounds the corners."""

    def course(self, draw: np.random.Generator, folder: Path) -> Course:
        """Return the sum of the harmonics that the actuator passes."""
        highest = self.bandwidth_Hz * math.sqrt(2.0 * math.log(1.0 / _SMALLEST) / math.log(2.0))
        harmonic = np.arange(1, max(int(highest / self.frequency_Hz), 1) + 1, 2)
        passed = np.exp(-0.5 * math.log(2.0) * (harmonic * self.frequency_Hz / self.bandwidth_Hz) ** 2)
        sign = 1.0 - 2.0 * (harmonic // 2 % 2)
        coefficients = np.zeros(harmonic[-1] + 1, dtype=np.complex128)
        coefficients[harmonic] = -1j * 8.0 * self.amplitude_m / math.pi**2 * sign * passed / harmonic**2
        return FourierSum(1.0 / self.frequency_Hz, coefficients)


WAVEFORM = Triangle
