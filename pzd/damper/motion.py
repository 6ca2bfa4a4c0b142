"""What the damper is put through: the sampled motion, voltage and temperature."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from pzd.record import Array, Record, Rows

STEP = 0.1
"""A voltage that moves by more from one sample to the next [share of its range in the record] has stepped."""
PARTS_OF_STEP = 8
"""Parts into which a sampling interval is cut in which the voltage steps: T0, C and k, linear between tested voltages,
are not linear over a step that passes one. What that misses of the force falls with the square of the parts."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Sampled kinematics and conditions; every array is (n,), None where not recorded."""

    time: Array
    displacement: Array
    velocity: Array
    acceleration: Array
    voltage: Array | None = None
    temperature: Array | None = None

    @classmethod
    def of(cls, record: Record) -> Self:
        """The motion of a rig record."""
        return cls(
            record.time,
            record.displacement,
            record.velocity,
            record.acceleration,
            record.voltage,
            record.temperature,
        )

    def about(self, zero: float) -> Self:
        """The same motion, its displacement counted from another zero [m]."""
        return self if zero == 0.0 else replace(self, displacement=self.displacement - zero)

    def finer(self, parts: NDArray[np.int64]) -> tuple[Self, Rows]:
        """The same motion on a finer grid: by cubic splines, voltage and temperature linear between the samples.

        Parameters
        ----------
        parts : (n - 1,) into how many parts each sampling interval is cut, 1 or more

        Returns
        -------
        the motion, and (n,) which of its samples are those of this one
        """
        from scipy.interpolate import CubicSpline

        samples = np.arange(self.time.size)
        places: Rows = np.concatenate([[0], np.cumsum(parts)])
        if places[-1] == samples[-1]:
            return self, samples
        fine = np.interp(np.arange(places[-1] + 1), places, samples)
        smooth = (self.displacement, self.velocity, self.acceleration)
        displacement, velocity, acceleration = (CubicSpline(samples, channel)(fine) for channel in smooth)
        held = (None if c is None else np.interp(fine, samples, c) for c in (self.voltage, self.temperature))
        time = np.interp(fine, samples, self.time)
        return type(self)(time, displacement, velocity, acceleration, *held), places


def steps_of_voltage(voltage: Array | None, samples: int) -> NDArray[np.bool_]:
    """(n - 1,) whether a voltage (n,) steps from one of so many samples to the next; a steady one, or none, nowhere."""
    if voltage is None or np.ptp(voltage) == 0.0:
        return np.zeros(samples - 1, dtype=np.bool_)
    return np.asarray(np.abs(np.diff(voltage)) > STEP * np.ptp(voltage))


def parts_of_steps(voltage: Array | None, samples: int) -> NDArray[np.int64]:
    """(n - 1,) into how many parts the intervals between so many samples are cut for the steps of the voltage (n,)."""
    return np.where(steps_of_voltage(voltage, samples), PARTS_OF_STEP, 1)
