"""Band-limited random motion: lines of equal density with random phases."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from pzd.rig.fourier import FourierSum
from pzd.rig.waveform import Course, Waveform


class Random(Waveform):
    """Random motion inside a band."""

    usual_cycles: ClassVar[int] = 2

    kind: Literal["random"] = "random"
    """Random motion inside a band."""
    low_Hz: float = Field(default=0.5, gt=0.0)
    """Lowest frequency."""
    high_Hz: float = Field(default=10.0, gt=0.0)
    """Highest frequency."""
    rms_m: float = Field(gt=0.0)
    """R.m.s. of the displacement."""
    slope: float = Field(default=2.0, ge=0.0)
    """The density of the displacement falls as f^-slope: 0 white, 2 white in speed."""
    period_s: float = Field(default=10.0, gt=0.0)
    """After which the motion repeats."""

    @model_validator(mode="after")
    def _has_lines(self) -> Random:
        if int(self.high_Hz * self.period_s) < np.ceil(self.low_Hz * self.period_s):
            raise ValueError("no multiple of 1 / period_s lies between low_Hz and high_Hz")
        return self

    def own_name(self) -> str:
        """`random-0.5-10Hz-0.005m`."""
        return f"random-{self.low_Hz:g}-{self.high_Hz:g}Hz-{self.rms_m:g}m"

    def cycle(self, folder: Path) -> float:
        """The period."""
        return self.period_s

    @property
    def settling(self) -> float:
        """Two turns at the lowest frequency, or a second."""
        return max(2.0 / self.low_Hz, 1.0)

    def course(self, draw: np.random.Generator, folder: Path) -> Course:
        """Lines with random phases, scaled to the r.m.s. asked for."""
        first, last = int(np.ceil(self.low_Hz * self.period_s)), int(self.high_Hz * self.period_s)
        line = np.arange(first, last + 1)
        amplitude = (line / first) ** (-0.5 * self.slope)
        amplitude *= self.rms_m / np.sqrt(0.5 * np.sum(amplitude**2))
        coefficients = np.zeros(last + 1, dtype=np.complex128)
        coefficients[first:] = amplitude * np.exp(2j * np.pi * draw.uniform(0.0, 1.0, line.size))
        return FourierSum(self.period_s, coefficients)


WAVEFORM = Random
