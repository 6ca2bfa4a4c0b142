"""The Bingham parameters of every condition, and the measures of every test."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar, Self

from pydantic import Field, model_validator

from pzd.artefacts.characteristics import Characteristics
from pzd.artefacts.knee import Knees, knee_damper
from pzd.damper.model import PHYSICAL, BaseRow, Damper, unphysical
from pzd.quantities import Control
from pzd.schema.csvfile import read_rows, write_rows
from pzd.schema.errors import DataError, at
from pzd.schema.model import Frozen


class ParameterRow(Frozen):
    """The Bingham parameters of one condition or voltage node; None where undetermined."""

    setting: str | None
    voltage_V: float | None
    temperature_degC: float | None
    T0_N: float | None = Field(ge=0.0)
    T0_N_low95: float | None
    T0_N_high95: float | None
    C_Ns_per_m: float | None = Field(gt=0.0)
    C_Ns_per_m_low95: float | None
    C_Ns_per_m_high95: float | None
    k_N_per_m: float | None = Field(gt=0.0)
    k_N_per_m_low95: float | None
    k_N_per_m_high95: float | None
    W_s: float = Field(ge=0.0)
    """Criterion (4) over the samples that the row was fitted to, less the forces of `auxiliary.csv` where there are."""
    rmse_N: float = Field(ge=0.0)
    status: str = Field(pattern=r"^(ok|(weak|undetermined): [T0Ck, ]+.*)$")
    """`ok`, or `weak: T0 ...` / `undetermined: C, k ...` with the reason."""

    @model_validator(mode="after")
    def _inside_its_interval(self) -> ParameterRow:
        """A value written by hand in another unit than its interval, or without it, is told."""
        for name in ("T0_N", "C_Ns_per_m", "k_N_per_m"):
            value, low, high = (getattr(self, f"{name}{end}") for end in ("", "_low95", "_high95"))
            if value is not None and not (low is None or low <= value) & (high is None or value <= high):
                raise ValueError(
                    f"{name} must lie between {name}_low95 and {name}_high95; change them too, or leave them empty"
                )
        return self


class AuxiliaryRow(Frozen):
    """What one condition shows beside the Bingham element, F_0 + k_g (x - zero_m): the gas charge of most dampers.

    It keeps T0, C and k unbiased and goes no further: which effect it stands for is named by diagnose.
    """

    setting: str | None
    voltage_V: float | None
    temperature_degC: float | None
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


class MeasureRow(Frozen):
    """What ties one test to an equivalent viscous damper."""

    record: str
    setting: str | None
    voltage_V: float | None
    temperature_degC: float | None
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
        write_rows(folder / "parameters.csv", ParameterRow, self.rows, control)
        write_rows(folder / "measures.csv", MeasureRow, self.measures, control)
        write_rows(folder / "auxiliary.csv", AuxiliaryRow, self.auxiliary, control)
        self.characteristics.write(folder, control)
        self.knees.write(folder, control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again."""
        rows = read_rows(folder / "parameters.csv", ParameterRow, control)
        places = [(row.setting, row.voltage_V, row.temperature_degC) for row in rows]
        twice = [_condition(row, control) for i, row in enumerate(rows) if places[i] in places[:i]]
        if twice:
            raise DataError(f"{folder / 'parameters.csv'}: two rows of one condition ({each})" for each in twice)
        if faults := _unphysical(rows, folder / "parameters.csv"):
            raise DataError(faults)
        return cls(
            rows,
            read_rows(folder / "measures.csv", MeasureRow, control),
            read_rows(folder / "auxiliary.csv", AuxiliaryRow, control),
            Characteristics.read(folder, control),
            Knees.read(folder, control),
        )

    def untrusted(self, control: Control) -> tuple[str, ...]:
        """Why the result is not to be trusted (exit 4): the rows whose T0 or C is undetermined."""
        return tuple(
            f"{_condition(row, control)}: {row.status}"
            for row in self.rows
            if row.T0_N is None or row.C_Ns_per_m is None
        )


def _unphysical(rows: tuple[ParameterRow, ...], path: Path) -> list[str]:
    """Values without an interval that no damper has, each with its line."""
    return [
        f"{at(path, line)}: {name}: {wrong} (got {value:g})"
        for line, row in enumerate(rows, start=2)
        for name in PHYSICAL
        if (value := getattr(row, name)) is not None and getattr(row, f"{name}_low95") is None
        if (wrong := unphysical(name, value)) is not None
    ]


def _condition(row: ParameterRow, control: Control) -> str:
    """Setting, control signal and temperature of a row, those that it has."""
    parts = [row.setting or "rig"]
    parts += [f"{row.voltage_V:.4g} {control.unit}"] if row.voltage_V is not None else []
    parts += [f"{row.temperature_degC:.4g} degC"] if row.temperature_degC is not None else []
    return ", ".join(parts)


def base_of(rows: tuple[ParameterRow, ...], setting: str | None) -> Damper:
    """The plain damper of one setting, from its identified parameters.

    A value that the data do not determine is taken from the nearest condition that has it
    (by voltage, then temperature); where no condition has it, from `FALLBACK`.

    Raises
    ------
    ValueError : when the setting has no row
    """
    mine = [row for row in rows if row.setting == setting]
    if not mine:
        raise ValueError(f"no identified parameters for setting {setting!r}")
    return Damper(base=tuple(_filled(row, mine) for row in mine))


def identified_damper(found: Identified, setting: str | None) -> Damper:
    """The damper of one setting that identify hands on, by the law that it was given.

    Raises
    ------
    ValueError : when the setting has no row
    """
    if found.knees.law_of(setting) == "knee":
        return knee_damper(found.knees.of(setting))
    return base_of(found.rows, setting)


FALLBACK = {"T0_N": 0.0, "C_Ns_per_m": 1.0, "k_N_per_m": 1e8}
"""Values where no condition determines a parameter: no friction, hardly any damping, a rigid spring."""


def _filled(row: ParameterRow, rows: list[ParameterRow]) -> BaseRow:
    def distance(other: ParameterRow) -> tuple[float, float]:
        return (
            abs((other.voltage_V or 0.0) - (row.voltage_V or 0.0)),
            abs((other.temperature_degC or 0.0) - (row.temperature_degC or 0.0)),
        )

    def value(name: str) -> float:
        known = [(distance(other), float(getattr(other, name))) for other in rows if getattr(other, name) is not None]
        return min(known)[1] if known else FALLBACK[name]

    return BaseRow(
        voltage_V=row.voltage_V,
        temperature_degC=row.temperature_degC,
        T0_N=value("T0_N"),
        C_Ns_per_m=value("C_Ns_per_m"),
        k_N_per_m=value("k_N_per_m"),
    )
