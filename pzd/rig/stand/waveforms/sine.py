"""A sine, as on most damper test stands: x = A sin(2 pi f t)."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field

from pzd.rig.stand.waveforms import Course, Waveform, two_cycles
from pzd.signals.harmonics import FourierSum


class Sine(Waveform):
    """A harmonic motion."""

    kind: Literal["sine"] = "sine"
    """A harmonic motion."""
    frequency_Hz: float = Field(gt=0.0)
    """Frequency."""
    amplitude_m: float = Field(gt=0.0)
    """Amplitude, half the stroke."""

    def own_name(self) -> str:
        """Return the name made of its parameters: `sine-2Hz-0.03m`."""
        return f"sine-{self.frequency_Hz:g}Hz-{self.amplitude_m:g}m"

    def cycle(self, folder: Path) -> float:
        """Return 1 / f."""
        return 1.0 / self.frequency_Hz

    @property
    def settling_time(self) -> float:
        """Two cycles, or a second."""
        return two_cycles(self.frequency_Hz)

    def course(self, draw: np.random.Generator, folder: Path) -> Course:
        """Return the sine."""
        return FourierSum(1.0 / self.frequency_Hz, np.array([0.0, -1j * self.amplitude_m]))


WAVEFORM = Sine
