"""Deflection of a suspension, and so of its damper, on a road of ISO 8608.

Equation: X(f) = Xi(f) r^2 / (1 - r^2 + 2 i zeta r), r = f / f_body
Source: a body on one spring and one damper over a moving base, deflection = body - road up to sign;
the road itself by `pzd.signals.iso8608`. Below f_body the body follows the road, above it stands still.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field

from pzd.record import Array
from pzd.rig.stand.waveforms import Course, Lines
from pzd.signals.harmonics import FourierSum
from pzd.signals.iso8608 import classes, known_class, profile

_FINE = 64  # points a turn of the highest line in the search for the peak


class RoadMotion(Lines):
    """A road under a simple suspension."""

    kind: Literal["road"] = "road"
    """The deflection of a suspension on an ISO 8608 road."""
    road_class: Annotated[str, AfterValidator(known_class)] = "C"
    """Class A (very good) to H (very poor) of ISO 8608."""
    vehicle_speed_km_per_h: float = Field(default=72.0, gt=0.0)
    """Speed of the vehicle."""
    high_Hz: float = Field(default=15.0, gt=0.0)
    """Highest frequency."""
    body_frequency_Hz: float | None = Field(default=1.4, gt=0.0)
    """Natural frequency of the body on its springs; null lets the damper follow the road's height itself."""
    body_damping: float = Field(default=0.3, gt=0.0)
    """Damping ratio of the body."""
    peak_m: float | None = Field(default=None, gt=0.0)
    """Scales the motion to this largest displacement, to suit the stroke of the stand; by default not scaled."""

    def own_name(self) -> str:
        """Return the name made of its parameters: `road-C-72km_per_h`."""
        return f"road-{self.road_class}-{self.vehicle_speed_km_per_h:g}km_per_h"

    def course(self, draw: np.random.Generator, folder: Path) -> Course:
        """Return the deflection on a road drawn from its class."""
        speed = self.vehicle_speed_km_per_h / 3.6
        band = (self.low_Hz / speed, self.high_Hz / speed)
        road = profile(classes()[self.road_class], speed * self.period_s, draw, band)
        passed = self._transfer(np.arange(road.coefficients.size) / self.period_s)
        motion = FourierSum(self.period_s, road.coefficients * passed)
        return motion if self.peak_m is None else _scaled(motion, self.peak_m)

    def _transfer(self, frequency: Array) -> Array:
        """Complex transfer function from height of the road to deflection."""
        if self.body_frequency_Hz is None:
            return np.ones(frequency.size)
        r = frequency / self.body_frequency_Hz
        return np.asarray(r**2 / (1.0 - r**2 + 2j * self.body_damping * r))


def _scaled(motion: FourierSum, peak: float) -> FourierSum:
    points = _FINE * motion.coefficients.size
    x, _, _ = motion(motion.period * np.arange(points) / points)
    return FourierSum(motion.period, motion.coefficients * (peak / np.abs(x).max()))


WAVEFORM = RoadMotion
