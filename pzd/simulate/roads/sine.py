"""A sine under the wheels, as in section 5 of the paper: given by the frequency that the car feels."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Literal

from pydantic import Field

from pzd.simulate.profile import Profile
from pzd.simulate.road import Road


class Sine(Road):
    """A harmonic road, xi = A sin(2 pi f t) under axle 1."""

    kind: Literal["sine"] = "sine"
    """A harmonic road."""
    frequency_Hz: float = Field(gt=0.0)
    """Frequency of excitation that the car feels at its speed."""
    amplitude_m: float = Field(default=0.02, gt=0.0)
    """Amplitude of the road's height."""

    def own_name(self) -> str:
        """`sine-2.25Hz`."""
        return f"sine-{self.frequency_Hz:g}Hz"

    def profile(self, vehicle_speed: float, distance: float, seed: int, folder: Path) -> Profile:
        """The harmonic whose wavelength gives the frequency at this speed."""
        return Profile(amplitude=self.amplitude_m, wavenumber=2.0 * math.pi * self.frequency_Hz / vehicle_speed)


ROAD = Sine
