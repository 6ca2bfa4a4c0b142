"""The deflection of a suspension on a road of ISO 8608, which is what a damper sees of it.

Equation: X(f) = Xi(f) r^2 / (1 - r^2 + 2 i zeta r), r = f / f_body
Source: a body on one spring and one damper over a moving base, deflection = body - road up to sign;
the road itself by `pzd.rig.roads`. Below f_body the body follows the road, above it stands still.
"""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from pzd.record import Array
from pzd.rig.fourier import FourierSum
from pzd.rig.roads import classes, profile
from pzd.rig.waveform import Course, Waveform

_FINE = 64  # points a turn of the highest line in the search for the peak


class RoadMotion(Waveform):
    """A road under a simple suspension."""

    usual_cycles: ClassVar[int] = 2

    kind: Literal["road"] = "road"
    """The deflection of a suspension on an ISO 8608 road."""
    road_class: str = "C"
    """Class A (very good) to H (very poor) of ISO 8608."""
    vehicle_speed_km_per_h: float = Field(default=72.0, gt=0.0)
    """Speed of the vehicle."""
    low_Hz: float = Field(default=0.5, gt=0.0)
    """Lowest frequency."""
    high_Hz: float = Field(default=15.0, gt=0.0)
    """Highest frequency."""
    body_frequency_Hz: float | None = Field(default=1.4, gt=0.0)
    """Natural frequency of the body on its springs; null lets the damper follow the road's height itself."""
    body_damping: float = Field(default=0.3, gt=0.0)
    """Damping ratio of the body."""
    peak_m: float | None = Field(default=None, gt=0.0)
    """Scales the motion to this largest displacement, to suit the stroke of the stand; by default not scaled."""
    period_s: float = Field(default=10.0, gt=0.0)
    """After which the road repeats."""

    @field_validator("road_class")
    @classmethod
    def _known(cls, name: str) -> str:
        if name not in classes():
            raise ValueError(f"a road class is one of {', '.join(classes())} (got {name})")
        return name

    @model_validator(mode="after")
    def _has_lines(self) -> RoadMotion:
        if int(self.high_Hz * self.period_s) < np.ceil(self.low_Hz * self.period_s):
            raise ValueError("no multiple of 1 / period_s lies between low_Hz and high_Hz")
        return self

    def own_name(self) -> str:
        """`road-C-72km_per_h`."""
        return f"road-{self.road_class}-{self.vehicle_speed_km_per_h:g}km_per_h"

    def cycle(self, folder: Path) -> float:
        """The period."""
        return self.period_s

    @property
    def settling(self) -> float:
        """Two turns at the lowest frequency, or a second."""
        return max(2.0 / self.low_Hz, 1.0)

    def course(self, draw: np.random.Generator, folder: Path) -> Course:
        """The deflection on a road drawn from its class."""
        speed = self.vehicle_speed_km_per_h / 3.6
        band = (self.low_Hz / speed, self.high_Hz / speed)
        road = profile(classes()[self.road_class], speed * self.period_s, draw, band)
        passed = self._passed(np.arange(road.coefficients.size) / self.period_s)
        motion = FourierSum(self.period_s, road.coefficients * passed)
        return motion if self.peak_m is None else _scaled(motion, self.peak_m)

    def _passed(self, frequency: Array) -> Array:
        """Deflection over height of the road, complex."""
        if self.body_frequency_Hz is None:
            return np.ones(frequency.size)
        r = frequency / self.body_frequency_Hz
        return np.asarray(r**2 / (1.0 - r**2 + 2j * self.body_damping * r))


def _scaled(motion: FourierSum, peak: float) -> FourierSum:
    points = _FINE * motion.coefficients.size
    x, _, _ = motion(motion.period * np.arange(points) / points)
    return FourierSum(motion.period, motion.coefficients * (peak / np.abs(x).max()))


WAVEFORM = RoadMotion
