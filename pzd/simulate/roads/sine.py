"""A sine under the wheels, as in section 5 of the paper: given by the frequency that the car feels."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import Field
from typing_extensions import override

from pzd.simulate.road.profile import Profile
from pzd.simulate.roads import Road, Way


class Sine(Road):
    """A harmonic road, xi = A sin(2 pi f t) under axle 1."""

    kind: Literal["sine"] = "sine"
    """A harmonic road."""
    frequency_Hz: float = Field(gt=0.0)
    """Frequency of excitation that the car feels at its speed."""
    amplitude_m: float = Field(default=0.02, gt=0.0)
    """Amplitude of the road's height."""

    @override
    def own_name(self) -> str:
        return f"sine-{self.frequency_Hz:g}Hz"

    @override
    def profile(self, way: Way) -> Profile:
        return Profile(amplitude=self.amplitude_m, wavenumber=2.0 * math.pi * self.frequency_Hz / way.vehicle_speed)


ROAD = Sine
