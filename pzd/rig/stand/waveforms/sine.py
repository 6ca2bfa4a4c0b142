"""A sine, as on most damper test stands: x = A sin(2 pi f t)."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np

from pzd.rig.stand.waveforms import Course, Periodic
from pzd.signals.harmonics import FourierSum


class Sine(Periodic):
    """A harmonic motion."""

    kind: Literal["sine"] = "sine"
    """A harmonic motion."""

    def course(self, draw: np.random.Generator, folder: Path) -> Course:
        """Return the sine."""
        return FourierSum(1.0 / self.frequency_Hz, np.array([0.0, -1j * self.amplitude_m]))


WAVEFORM = Sine
