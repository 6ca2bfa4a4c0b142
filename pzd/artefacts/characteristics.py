"""What the tests of the rig show without any model: force over speed, gas force, friction, response to a step."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Self

from pydantic import Field

from pzd.quantities import Control
from pzd.schema.csvfile import read_rows, write_rows
from pzd.schema.model import Frozen

Kind = Literal["sine", "constant velocity", "other swing"]
Method = Literal["slow test", "extrapolated to rest", "at the lowest speed"]


class PeakVelocityRow(Frozen):
    """One point of the peak-velocity plot (PVP) for each direction: force at the peak speed of one test.

    Rebound is extension: its speed and force are positive, those of compression negative. A force is as recorded,
    with the gas force in it.
    """

    record: str
    setting: str | None
    voltage_V: float | None
    """Of the condition, as in `parameters.csv`."""
    temperature_degC: float | None
    kind: Kind
    """What the motion is, whatever the waveform was called; `other swing`: one smooth stroke each way."""
    frequency_Hz: float | None
    """Of a motion that repeats."""
    amplitude_m: float = Field(gt=0.0)
    middle_m: float
    """Middle of the stroke, in the displacement as recorded."""
    rebound_velocity_m_per_s: float | None = Field(gt=0.0)
    rebound_force_N: float | None
    compression_velocity_m_per_s: float | None = Field(lt=0.0)
    compression_force_N: float | None

    @property
    def speed(self) -> float:
        """Magnitude of the peak speed, the mean of both directions where both are there [m/s]."""
        both = [abs(v) for v in (self.rebound_velocity_m_per_s, self.compression_velocity_m_per_s) if v is not None]
        return sum(both) / max(len(both), 1)


class ContinuousVelocityRow(Frozen):
    """One point of the continuous-velocity plot (CVP): the average settled cycle of one test, rebound first."""

    record: str
    setting: str | None
    voltage_V: float | None
    """Of the condition, as in `parameters.csv`."""
    temperature_degC: float | None
    frequency_Hz: float = Field(gt=0.0)
    amplitude_m: float = Field(gt=0.0)
    displacement_m: float
    velocity_m_per_s: float
    force_N: float


class GasAndFrictionRow(Frozen):
    """Static force of one condition at mid-stroke: what the gas pushes with, and what friction holds either way."""

    setting: str | None
    voltage_V: float | None
    temperature_degC: float | None
    gas_force_N: float
    """Mean of rebound and compression."""
    friction_N: float
    """Half of their difference."""
    velocity_m_per_s: float = Field(gt=0.0)
    """Of the slowest test, from which they are read."""
    middle_m: float
    """Middle of the stroke, in the displacement as recorded."""
    method: Method
    """`at the lowest speed`: there is only one speed, and its viscous force counts as friction."""


class StepRow(Frozen):
    """How quickly the force followed one step of the control signal."""

    record: str
    setting: str | None
    temperature_degC: float | None
    time_s: float
    """When the control signal passed the middle of its step."""
    from_voltage_V: float
    to_voltage_V: float
    velocity_m_per_s: float | None
    """At which the rod moved; None where that was not constant."""
    from_force_N: float | None
    to_force_N: float | None
    to_63_percent_s: float | None
    to_90_percent_s: float | None
    status: str
    """`ok`, or why there are no times."""


@dataclass(frozen=True)
class Characteristics:
    """Force over speed, gas force, friction and response as the tests of the rig show them, without any model."""

    peak_velocity: tuple[PeakVelocityRow, ...] = ()
    continuous_velocity: tuple[ContinuousVelocityRow, ...] = ()
    gas_and_friction: tuple[GasAndFrictionRow, ...] = ()
    steps: tuple[StepRow, ...] = ()

    def write(self, folder: Path, control: Control) -> None:
        """Write pvp.csv, cvp.csv, gas_and_friction.csv and steps.csv."""
        write_rows(folder / "pvp.csv", PeakVelocityRow, self.peak_velocity, control)
        write_rows(folder / "cvp.csv", ContinuousVelocityRow, self.continuous_velocity, control)
        write_rows(folder / "gas_and_friction.csv", GasAndFrictionRow, self.gas_and_friction, control)
        write_rows(folder / "steps.csv", StepRow, self.steps, control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again; a run of an earlier version has none of them."""
        if not (folder / "pvp.csv").is_file():
            return cls()
        return cls(
            read_rows(folder / "pvp.csv", PeakVelocityRow, control),
            read_rows(folder / "cvp.csv", ContinuousVelocityRow, control),
            read_rows(folder / "gas_and_friction.csv", GasAndFrictionRow, control),
            read_rows(folder / "steps.csv", StepRow, control),
        )
