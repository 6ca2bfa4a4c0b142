"""Band-limited random motion: spectral lines with random phases whose density falls as f^-slope."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field

from pzd.rig.stand.waveforms import Course, Lines
from pzd.signals.harmonics import FourierSum


class Random(Lines):
    """Random motion inside a band."""

    kind: Literal["random"] = "random"
    """Random motion inside a band."""
    rms_m: float = Field(gt=0.0)
    """R.m.s. of the displacement."""
    slope: float = Field(default=2.0, ge=0.0)
    """The density of the displacement falls as f^-slope: 0 white, 2 white in speed."""

    def own_name(self) -> str:
        """Return the name made of its parameters: `random-0.5-10Hz-0.005m`."""
        return f"random-{self.low_Hz:g}-{self.high_Hz:g}Hz-{self.rms_m:g}m"

    def course(self, draw: np.random.Generator, folder: Path) -> Course:
        """Return lines with random phases, scaled to the r.m.s. asked for."""
        first, last = int(np.ceil(self.low_Hz * self.period_s)), int(self.high_Hz * self.period_s)
        line = np.arange(first, last + 1)
        amplitude = (line / first) ** (-0.5 * self.slope)
        amplitude *= self.rms_m / np.sqrt(0.5 * np.sum(amplitude**2))
        coefficients = np.zeros(last + 1, dtype=np.complex128)
        coefficients[first:] = amplitude * np.exp(2j * np.pi * draw.uniform(0.0, 1.0, line.size))
        return FourierSum(self.period_s, coefficients)


WAVEFORM = Random
