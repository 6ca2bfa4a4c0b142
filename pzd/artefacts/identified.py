"""Artefact of identify: the parameters of every condition, and what the tests show without any model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from pzd.artefacts.csv_rows import ConditionRow, Estimate, Files, RecordRow, read_files, write_files
from pzd.artefacts.knee import Knees, knee_damper
from pzd.damper.model import PHYSICAL, BaseRow, Damper, unphysical
from pzd.quantities import Control
from pzd.schema.errors import DataError, at
from pzd.schema.model import Frozen

# --- Characteristics: force over speed, gas force, friction, response, warm-up, without any model ---

Kind = Literal["sine", "constant velocity", "other swing"]
Method = Literal["slow test", "extrapolated to rest", "at the lowest speed"]


class PeakVelocityRow(RecordRow):
    """One point of the peak-velocity plot (PVP) for each direction: force at the peak speed of one test.

    Rebound is extension: its speed and force are positive, those of compression negative. A force is as recorded,
    with the gas force in it.
    """

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


class ContinuousVelocityRow(RecordRow):
    """One point of the continuous-velocity plot (CVP): the average settled cycle of one test, rebound first."""

    frequency_Hz: float = Field(gt=0.0)
    amplitude_m: float = Field(gt=0.0)
    displacement_m: float
    velocity_m_per_s: float
    force_N: float


class GasAndFrictionRow(ConditionRow):
    """Static force of one condition at mid-stroke: what the gas pushes with, and what friction holds either way."""

    gas_force_N: float | None
    """Mean of rebound and compression of a slow test; None without one, as the mean of faster ones is also that of a
    damper whose rebound is unlike its compression."""
    friction_N: float | None
    """Half of their difference; None where faster tests lead to none."""
    velocity_m_per_s: float = Field(gt=0.0)
    """Of the slowest test, from which they are read."""
    middle_m: float
    """Middle of the stroke, in the displacement as recorded."""
    method: Method
    """`at the lowest speed`: there is only one speed, and its viscous force counts as friction."""


RISE_SHARES = (0.63, 0.9)
"""Shares of a change of force to which the time is given, as in data sheets."""


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


class AsItStandsRow(RecordRow):
    """The extremes of a record that is none of the tests above, such as a knock, a transient or a road, as recorded."""

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
    """Return the course of every test of a warm-up.

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
        """Write the files named in `CHARACTERISTICS`."""
        write_files(self, CHARACTERISTICS, folder, control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again; a run of an earlier version has none of them, or not the last two."""
        if not (folder / "pvp.csv").is_file():
            return cls()
        return cls(**read_files(CHARACTERISTICS, folder, control, ("warm_up", "as_it_stands")))


CHARACTERISTICS: Files = {
    "peak_velocity": ("pvp.csv", PeakVelocityRow),
    "continuous_velocity": ("cvp.csv", ContinuousVelocityRow),
    "gas_and_friction": ("gas_and_friction.csv", GasAndFrictionRow),
    "steps": ("steps.csv", StepRow),
    "warm_up": ("warm_up.csv", WarmUpRow),
    "as_it_stands": ("as_it_stands.csv", AsItStandsRow),
}


# --- Parameters of the conditions, and the damper that has them ---


class ParameterRow(ConditionRow):
    """The Bingham parameters of one condition or voltage node; None where undetermined."""

    T0_N: float | None = Field(ge=0.0)
    T0_N_low95: float | None
    """Without a value: the force up to which no test slips."""
    T0_N_high95: float | None
    C_Ns_per_m: float | None = Field(ge=0.0)
    C_Ns_per_m_low95: float | None
    """Without a value: between these two it is undetermined."""
    C_Ns_per_m_high95: float | None
    k_N_per_m: float | None = Field(gt=0.0)
    k_N_per_m_low95: float | None
    """Without a value: the stiffness from which on the tests do not tell k from a rigid damper's."""
    k_N_per_m_high95: float | None
    W_s: float = Field(ge=0.0)
    """Criterion (4) over the samples that the row was fitted to, less the forces of `auxiliary.csv` where there are."""
    rmse_N: float = Field(ge=0.0)
    status: str = Field(pattern=r"^(ok|(weak|undetermined): [T0Ck, ]+.*)$")
    """`ok`, or `weak: T0 ...` / `undetermined: C, k ...` with the reason."""

    @property
    def shows_oil_spring_alone(self) -> bool:
        """Whether no test of the condition slips, so that k is all that is known."""
        return self.T0_N is None and self.T0_N_low95 is not None

    @model_validator(mode="after")
    def _inside_its_interval(self) -> ParameterRow:
        """Refuse a value that was edited without its interval."""
        for name in PHYSICAL:
            value, low, high = Estimate.of(self, name)
            if value is not None and not (low is None or low <= value) & (high is None or value <= high):
                raise ValueError(
                    f"{name} must lie between {name}_low95 and {name}_high95; change them too, or leave them empty"
                )
        return self


class AuxiliaryRow(ConditionRow):
    """What one condition shows beside the Bingham element, F_0 + k_g (x - zero_m): the gas charge of most dampers.

    It keeps T0, C and k unbiased and goes no further: which effect it stands for is named by diagnose.
    """

    F_0_N: float
    """Force at `zero_m` beside the element."""
    F_0_N_low95: float
    F_0_N_high95: float
    k_g_N_per_m: float
    """Stiffness beside the element."""
    k_g_N_per_m_low95: float
    k_g_N_per_m_high95: float
    zero_m: float
    """Middle of the motion of the condition's tests, in the displacement as recorded."""


class MeasureRow(RecordRow):
    """What ties one test to an equivalent viscous damper."""

    frequency_Hz: float | None
    amplitude_m: float
    peak_velocity_m_per_s: float
    peak_force_N: float
    """Maximum of the cycle-averaged force."""
    force_at_zero_velocity_N: float
    """Mean absolute force of both branches at v = 0."""
    work_per_cycle_J: float
    equivalent_damping_Ns_per_m: float
    """Work per cycle over the integral of v^2 over the cycle."""
    dynamic_range: float | None
    """Peak force over that of the lowest voltage at the same speed; None without such a test."""


@dataclass(frozen=True, eq=False)
class Identified:
    """The Bingham parameters of every condition of every setting, and the measures of every test."""

    folder: ClassVar[str] = "2-identify"

    rows: tuple[ParameterRow, ...]
    measures: tuple[MeasureRow, ...]
    auxiliary: tuple[AuxiliaryRow, ...] = ()
    """Of the conditions that show forces beside the element."""
    characteristics: Characteristics = field(default_factory=Characteristics)
    """What the tests show without any model."""
    knees: Knees = field(default_factory=Knees)
    """The knee law, where the config asks for it."""

    def write(self, folder: Path, control: Control) -> None:
        """Write parameters.csv, measures.csv, auxiliary.csv, and the files of the characteristics and the knee law."""
        write_files(self, IDENTIFIED, folder, control)
        self.characteristics.write(folder, control)
        self.knees.write(folder, control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again."""
        rows = read_files(IDENTIFIED, folder, control)
        parameters: tuple[ParameterRow, ...] = rows["rows"]
        conditions = [row.condition for row in parameters]
        twice = [row.words(control, "rig") for i, row in enumerate(parameters) if conditions[i] in conditions[:i]]
        if twice:
            raise DataError(f"{folder / 'parameters.csv'}: two rows of one condition ({each})" for each in twice)
        if faults := _unphysical(parameters, folder / "parameters.csv"):
            raise DataError(faults)
        return cls(**rows, characteristics=Characteristics.read(folder, control), knees=Knees.read(folder, control))

    def untrusted(self, control: Control) -> tuple[str, ...]:
        """Return why the result is not to be trusted (exit 4)."""
        return tuple(f"{row.words(control, 'rig')}: {row.status}" for row in self.undetermined)

    @property
    def undetermined(self) -> tuple[ParameterRow, ...]:
        """The rows whose T0 or C is undetermined; where the knee law is adopted no stage uses those of Bingham's."""
        used = [row for row in self.rows if self.knees.law_of(row.setting) == "bingham"]
        return tuple(row for row in used if row.T0_N is None or row.C_Ns_per_m is None)


IDENTIFIED: Files = {
    "rows": ("parameters.csv", ParameterRow),
    "measures": ("measures.csv", MeasureRow),
    "auxiliary": ("auxiliary.csv", AuxiliaryRow),
}


def _unphysical(rows: tuple[ParameterRow, ...], path: Path) -> list[str]:
    """Return a fault for each edited value that no damper has, with its line; fitted ones have an interval."""
    return [
        f"{at(path, line)}: {name}: {wrong} (got {value:g})"
        for line, row in enumerate(rows, start=2)
        for name in PHYSICAL
        if (value := getattr(row, name)) is not None and getattr(row, f"{name}_low95") is None
        if (wrong := unphysical(name, value)) is not None
    ]


def base_of(rows: tuple[ParameterRow, ...], setting: str | None) -> Damper:
    """Return the baseline of one setting: the damper with its identified parameters and no effect.

    A value that the data do not determine is taken from the nearest condition that has it (by voltage, then
    temperature), within its own interval where it has one; where no condition has it, it is the lower end of that
    interval, which for C is mostly no damping at all, else from `FALLBACK`.

    Raises
    ------
    ValueError : when the setting has no row
    """
    mine = [row for row in rows if row.setting == setting]
    if not mine:
        raise ValueError(f"no identified parameters for setting {setting!r}")
    return Damper(base=tuple(_filled(row, mine) for row in mine))


def identified_damper(found: Identified, setting: str | None) -> Damper:
    """Return the damper of one setting by the law that identify adopted.

    Raises
    ------
    ValueError : when the setting has no row
    """
    if found.knees.law_of(setting) == "knee":
        return knee_damper(found.knees.of(setting))
    return base_of(found.rows, setting)


FALLBACK = {"T0_N": 0.0, "C_Ns_per_m": 0.0, "k_N_per_m": math.inf}
"""Values where no condition determines a parameter: no friction, no damping, a rigid oil spring."""


def _filled(row: ParameterRow, rows: list[ParameterRow]) -> BaseRow:
    def distance(other: ParameterRow) -> tuple[float, float]:
        return (
            abs((other.voltage_V or 0.0) - (row.voltage_V or 0.0)),
            abs((other.temperature_degC or 0.0) - (row.temperature_degC or 0.0)),
        )

    def value(name: str) -> float:
        known = [(distance(other), float(getattr(other, name))) for other in rows if getattr(other, name) is not None]
        if (mine := getattr(row, name)) is not None:
            return float(mine)
        low, high = getattr(row, f"{name}_low95"), getattr(row, f"{name}_high95")
        found = min(known)[1] if known else FALLBACK[name] if high is None else low or 0.0
        return max(min(found, math.inf if high is None else high), low or 0.0)

    return BaseRow(
        voltage_V=row.voltage_V, temperature_degC=row.temperature_degC, **{name: value(name) for name in FALLBACK}
    )
