"""Inputs of a damper: sampled motion, voltage and temperature."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from pzd.record import Array, Record, Rows
from pzd.signals.splines import even_cubic

VOLTAGE_STEP = 0.1
"""Change of the voltage between two samples that counts as a step, as a share of its range in the record."""
PARTS_OF_STEP = 8
"""Parts into which a sampling interval is cut in which the voltage steps. T0, C and k are linear between tested
voltages, but not over a step that passes one; the error of the force falls with the square of the parts."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Sampled kinematics and conditions, (n,) each; None where not recorded."""

    time: Array
    """[s]"""
    displacement: Array
    """[m]"""
    velocity: Array
    """[m/s]"""
    acceleration: Array
    """[m/s2]"""
    voltage: Array | None = None
    """[V]"""
    temperature: Array | None = None
    """[degC]"""

    @classmethod
    def of(cls, record: Record) -> Self:
        """Return the motion of a rig record."""
        return cls(
            record.time, record.displacement, record.velocity, record.acceleration, record.voltage, record.temperature
        )

    def centred_on(self, zero: float) -> Self:
        """Return the same motion with its displacement counted from another zero [m]."""
        return self if zero == 0.0 else replace(self, displacement=self.displacement - zero)

    def finer(self, parts: NDArray[np.int64]) -> tuple[Self, Rows]:
        """Interpolate the motion on a finer grid: cubic splines, voltage and temperature linear between the samples.

        Parameters
        ----------
        parts : (n - 1,) into how many parts each sampling interval is cut, 1 or more

        Returns
        -------
        the motion, and (n,) indices of the samples of this one in it
        """
        samples = np.arange(self.time.size)
        places: Rows = np.concatenate([[0], np.cumsum(parts)])
        if places[-1] == samples[-1]:
            return self, samples
        fine = np.interp(np.arange(places[-1] + 1), places, samples)
        smooth = (self.displacement, self.velocity, self.acceleration)
        displacement, velocity, acceleration = (even_cubic(channel)(fine) for channel in smooth)
        conditions = (None if c is None else np.interp(fine, samples, c) for c in (self.voltage, self.temperature))
        time = np.interp(fine, samples, self.time)
        return type(self)(time, displacement, velocity, acceleration, *conditions), places


def steps_of_voltage(voltage: Array | None, samples: int) -> NDArray[np.bool_]:
    """Return where a voltage (n,) steps: (n - 1,), one for each interval between so many samples."""
    if voltage is None or np.ptp(voltage) == 0.0:
        return np.zeros(samples - 1, dtype=np.bool_)
    return np.asarray(np.abs(np.diff(voltage)) > VOLTAGE_STEP * np.ptp(voltage))


def parts_of_steps(voltage: Array | None, samples: int) -> NDArray[np.int64]:
    """Return the (n - 1,) numbers of parts into which sampling intervals are cut for the steps of a voltage (n,)."""
    return np.where(steps_of_voltage(voltage, samples), PARTS_OF_STEP, 1)
