"""What the damper is put through: the sampled motion, voltage and temperature."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

from pzd.record import Array, Record


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
