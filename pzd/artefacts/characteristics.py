"""What the tests of the rig show without any model: force over speed, gas force, friction, response, warm-up."""

from __future__ import annotations

from collections.abc import Sequence
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


class WarmUpRow(Frozen):
    """One cycle of a test that was run for long, or whose temperature changed: its force at the peak speed."""

    record: str
    setting: str | None
    voltage_V: float | None
    """Of the condition, as in `parameters.csv`."""
    cycle: int = Field(ge=1)
    """Running number within the test; a record of several tests begins anew with each."""
    time_s: float
    """Middle of the cycle, in the time as recorded."""
    temperature_degC: float | None
    """Mean over the cycle."""
    velocity_m_per_s: float = Field(gt=0.0)
    """Peak speed, the mean of both directions."""
    rebound_force_N: float
    compression_force_N: float


class AsItStandsRow(Frozen):
    """The extremes of a record that is none of the tests above, such as a knock, a transient or a road, as recorded."""

    record: str
    setting: str | None
    voltage_V: float | None
    """Of the condition, as in `parameters.csv`; None where the control signal moves within the record."""
    temperature_degC: float | None
    rebound_force_N: float
    """The largest force; in rebound forces are positive."""
    compression_force_N: float
    """The smallest force."""
    rebound_velocity_m_per_s: float = Field(ge=0.0)
    """The largest velocity."""
    compression_velocity_m_per_s: float = Field(le=0.0)
    """The smallest velocity."""
    stroke_m: float = Field(gt=0.0)
    """From end to end."""
    duration_s: float = Field(gt=0.0)


@dataclass(frozen=True)
class Course:
    """From where to where a warm-up goes: means of its first cycles and of its last."""

    first: WarmUpRow
    """Of the test, with the means of the first cycles in it."""
    last: WarmUpRow
    cycles: int


AVERAGED = 3
"""Cycles at either end of a warm-up over which its course is averaged."""


def courses(rows: Sequence[WarmUpRow]) -> tuple[Course, ...]:
    """The course of every test of a warm-up.

    Parameters
    ----------
    rows : cycle by cycle, test by test
    """
    tests: list[list[WarmUpRow]] = []
    for row in rows:
        if not tests or row.cycle <= tests[-1][-1].cycle or row.record != tests[-1][-1].record:
            tests.append([])
        tests[-1].append(row)
    return tuple(Course(_mean(mine[:AVERAGED]), _mean(mine[-AVERAGED:]), len(mine)) for mine in tests)


def _mean(rows: Sequence[WarmUpRow]) -> WarmUpRow:
    names = ("time_s", "temperature_degC", "velocity_m_per_s", "rebound_force_N", "compression_force_N")
    values = {name: [getattr(row, name) for row in rows] for name in names}
    known = {name: sum(all_of) / len(all_of) for name, all_of in values.items() if None not in all_of}
    return rows[0].model_copy(update=known)


@dataclass(frozen=True)
class Characteristics:
    """Force over speed, gas force, friction, response, warm-up as the tests of the rig show them, without any model."""

    peak_velocity: tuple[PeakVelocityRow, ...] = ()
    continuous_velocity: tuple[ContinuousVelocityRow, ...] = ()
    gas_and_friction: tuple[GasAndFrictionRow, ...] = ()
    steps: tuple[StepRow, ...] = ()
    warm_up: tuple[WarmUpRow, ...] = ()
    as_it_stands: tuple[AsItStandsRow, ...] = ()

    def write(self, folder: Path, control: Control) -> None:
        """Write pvp.csv, cvp.csv, gas_and_friction.csv, steps.csv, warm_up.csv and as_it_stands.csv."""
        write_rows(folder / "pvp.csv", PeakVelocityRow, self.peak_velocity, control)
        write_rows(folder / "cvp.csv", ContinuousVelocityRow, self.continuous_velocity, control)
        write_rows(folder / "gas_and_friction.csv", GasAndFrictionRow, self.gas_and_friction, control)
        write_rows(folder / "steps.csv", StepRow, self.steps, control)
        write_rows(folder / "warm_up.csv", WarmUpRow, self.warm_up, control)
        write_rows(folder / "as_it_stands.csv", AsItStandsRow, self.as_it_stands, control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again; a run of an earlier version has none of them."""
        if not (folder / "pvp.csv").is_file():
            return cls()
        # An earlier version wrote the others alone.
        warm_up, as_it_stands = folder / "warm_up.csv", folder / "as_it_stands.csv"
        return cls(
            read_rows(folder / "pvp.csv", PeakVelocityRow, control),
            read_rows(folder / "cvp.csv", ContinuousVelocityRow, control),
            read_rows(folder / "gas_and_friction.csv", GasAndFrictionRow, control),
            read_rows(folder / "steps.csv", StepRow, control),
            read_rows(warm_up, WarmUpRow, control) if warm_up.is_file() else (),
            read_rows(as_it_stands, AsItStandsRow, control) if as_it_stands.is_file() else (),
        )
