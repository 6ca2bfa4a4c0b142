"""What each stage hands on: read this file and you know the pipeline.

Every artefact writes itself into its stage's folder and reads itself back, checked, with
file and line of whatever is wrong. `control` renames the columns of the control signal.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar, Literal, Self

from pydantic import Field

from pzd.damper.model import BaseRow, Damper
from pzd.quantities import (
    ACCELERATION,
    DISPLACEMENT,
    FORCE,
    PRESSURE,
    TEMPERATURE,
    TIME,
    VELOCITY,
    VOLTAGE,
    Control,
)
from pzd.record import Array, Record
from pzd.schema.csvfile import read_columns, read_rows, write_columns, write_rows
from pzd.schema.jsonfile import read_json, read_json_list, write_json
from pzd.schema.model import Frozen
from pzd.schema.yamlfile import read_yaml_model, write_yaml_model

# ---------------------------------------------------------------- 1-rig


class Finding(Frozen):
    """One finding of the preflight: never corrected, always said."""

    check: str
    """Which check found it."""
    where: str
    """Place in the record, in words with units."""
    size: float
    """How much."""
    unit: str
    """Unit of the size; '-' for a share."""
    follows: str
    """What follows for the results."""


class RecordEntry(Frozen):
    """One record as records.json lists it."""

    name: str
    setting: str | None
    voltage_V: float | None
    """Median of the control signal."""
    temperature_degC: float | None
    """Median temperature."""
    rate_Hz: float
    """Sampling rate."""
    cycles: float
    """Number of cycles of the motion."""
    findings: tuple[Finding, ...] = ()
    removed: str | None = None
    """What a known fixture took out of the force, in words."""


@dataclass(frozen=True, eq=False)
class Rig:
    """The rig records in canonical columns, and what the preflight found."""

    folder: ClassVar[str] = "1-rig"

    records: tuple[Record, ...]
    entries: tuple[RecordEntry, ...]

    def write(self, folder: Path, control: Control) -> None:
        """Write records.json and one CSV a record."""
        write_json(folder / "records.json", self.entries, control)
        for record in self.records:
            write_columns(folder / f"{record.name}.csv", _channels(record), control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again."""
        entries = read_json_list(folder / "records.json", RecordEntry, control)
        return cls(tuple(_read_record(folder, entry, control) for entry in entries), entries)


def _channels(record: Record) -> Mapping[str, Array | None]:
    columns: dict[str, Array | None] = {
        TIME.column: record.time,
        DISPLACEMENT.column: record.displacement,
        VELOCITY.column: record.velocity,
        ACCELERATION.column: record.acceleration,
        FORCE.column: record.force,
        VOLTAGE.column: record.voltage,
        TEMPERATURE.column: record.temperature,
    }
    return columns if record.pressure is None else {**columns, PRESSURE.column: record.pressure}


def _read_record(folder: Path, entry: RecordEntry, control: Control) -> Record:
    optional = (VOLTAGE.column, TEMPERATURE.column, PRESSURE.column)
    header = [q.column for q in (TIME, DISPLACEMENT, VELOCITY, ACCELERATION, FORCE, VOLTAGE, TEMPERATURE, PRESSURE)]
    columns = read_columns(folder / f"{entry.name}.csv", header, control, optional)
    return Record(
        entry.name,
        entry.setting,
        *(columns[name] for name in header[:5]),
        *(columns.get(name) for name in optional),
    )


# ---------------------------------------------------------------- 2-identify


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
    """Criterion (4) over the samples that the row was fitted to."""
    rmse_N: float = Field(ge=0.0)
    status: str = Field(pattern=r"^(ok|(weak|undetermined): [T0Ck, ]+.*)$")
    """`ok`, or `weak: T0 ...` / `undetermined: C, k ...` with the reason."""


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

    def write(self, folder: Path, control: Control) -> None:
        """Write parameters.csv and measures.csv."""
        write_rows(folder / "parameters.csv", ParameterRow, self.rows, control)
        write_rows(folder / "measures.csv", MeasureRow, self.measures, control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again."""
        return cls(
            read_rows(folder / "parameters.csv", ParameterRow, control),
            read_rows(folder / "measures.csv", MeasureRow, control),
        )

    @property
    def untrusted(self) -> tuple[str, ...]:
        """Why the result is not to be trusted (exit 4): the rows whose T0 or C is undetermined."""
        return tuple(
            f"{row.setting or 'rig'}, {row.voltage_V} V, {row.temperature_degC} degC: {row.status}"
            for row in self.rows
            if row.T0_N is None or row.C_Ns_per_m is None
        )


# ---------------------------------------------------------------- 3-diagnose


class Gap(Frozen):
    """The gap between simulation and measurement on what no fit has seen."""

    criterion: Literal["W_s"] = "W_s"
    before: float
    after: float
    noise_floor: float
    standard_error: float
    held_out: tuple[str, ...]
    hold_out: Literal["records", "cycles", "segments", "mixed"]


class Value(Frozen):
    """A parameter of an adopted effect with its 95 % interval; lists beside at_voltage_V."""

    value: float | tuple[float, ...]
    low95: float | tuple[float, ...] | None
    high95: float | tuple[float, ...] | None
    unit: str
    at_voltage_V: tuple[float, ...] | None = None


class Ranked(Frozen):
    """One candidate effect in the ranking."""

    effect: str
    gap_after: float
    delta_bic: float
    parameters: dict[str, float | tuple[float, ...]]
    reason: str
    at_voltage_V: tuple[float, ...] | None = None


class Region(Frozen):
    """Where the gap lies."""

    region: str
    share_of_gap: float


class NextTest(Frozen):
    """The rig test that would separate the rivals best."""

    waveform: str
    frequency_Hz: float | None
    amplitude_m: float | None
    voltage_V: float | tuple[float, ...] | None
    separates: tuple[str, ...]
    distance_percent: float | None = None
    """Predicted r.m.s. between the rivals there, in % of peak, after refitting the wrong one."""


class Diagnosis(Frozen):
    """What is missing from the model, how sure that is, and what would settle it."""

    verdict: Literal["named", "ambiguous", "none", "unexplained"]
    reason: str
    effects: tuple[str, ...]
    confidence: float | None = Field(ge=0.0, le=1.0)
    gap: Gap
    parameters: dict[str, dict[str, Value]]
    ranking: tuple[Ranked, ...]
    rivals: tuple[str, ...]
    where: tuple[Region, ...]
    next_test: NextTest | None


@dataclass(frozen=True, eq=False)
class Diagnosed:
    """The verdict, and the damper that everything behind uses."""

    folder: ClassVar[str] = "3-diagnose"

    diagnosis: Diagnosis
    damper: Damper
    plain: Damper
    """The damper before diagnose."""

    def write(self, folder: Path, control: Control) -> None:
        """Write diagnosis.json, damper.yaml and plain.yaml."""
        write_json(folder / "diagnosis.json", self.diagnosis, control)
        write_yaml_model(folder / "damper.yaml", self.damper, control)
        write_yaml_model(folder / "plain.yaml", self.plain, control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again."""
        return cls(
            read_json(folder / "diagnosis.json", Diagnosis, control),
            read_yaml_model(folder / "damper.yaml", Damper, control),
            read_yaml_model(folder / "plain.yaml", Damper, control),
        )


# ---------------------------------------------------------------- 4-table


class ForceRow(Frozen):
    """One node of the table of force; at v = 0 two one-sided rows stand, -0 and +0."""

    temperature_degC: float | None
    voltage_V: float | None
    velocity_m_per_s: float
    force_N: float | None
    inside: Literal[0, 1]
    """1 within what the rig reached, 0 the model beyond."""


class InverseRow(Frozen):
    """The voltage that gives a force at a speed; None where none does."""

    temperature_degC: float | None
    velocity_m_per_s: float
    force_N: float
    voltage_V: float | None


class TableNotes(Frozen):
    """What the table cannot carry, and where it had to decide."""

    outside: Literal["clamp", "error", "model"]
    """What the table does beyond the rig's speeds."""
    reached_m_per_s: float
    """The largest speed that the rig reached."""
    lost: tuple[str, ...]
    """What a table of force over voltage and velocity cannot carry, in words."""
    not_monotone: tuple[str, ...]
    """Where force falls with rising voltage, and how that was resolved."""


@dataclass(frozen=True, eq=False)
class Table:
    """Force over temperature, voltage and velocity, its inverse, and its limits."""

    folder: ClassVar[str] = "4-table"

    force: tuple[ForceRow, ...]
    inverse: tuple[InverseRow, ...]
    notes: TableNotes

    def write(self, folder: Path, control: Control) -> None:
        """Write force.csv, inverse.csv and notes.json."""
        write_rows(folder / "force.csv", ForceRow, self.force, control)
        write_rows(folder / "inverse.csv", InverseRow, self.inverse, control)
        write_json(folder / "notes.json", self.notes, control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again."""
        return cls(
            read_rows(folder / "force.csv", ForceRow, control),
            read_rows(folder / "inverse.csv", InverseRow, control),
            read_json(folder / "notes.json", TableNotes, control),
        )


# ---------------------------------------------------------------- 5-simulate

RIDE_COLUMNS = ("time_s", "z_m", "phi_rad", "a_K_m_per_s2")
AXLE_COLUMNS = (
    "deflection_{}_m",
    "deflection_rate_{}_m_per_s",
    "spring_force_{}_N",
    "damper_force_{}_N",
    "demanded_force_{}_N",
    "voltage_{}_V",
)
AXLES = (1, 2)
_RIDE_HEADER = RIDE_COLUMNS + tuple(name.format(axle) for axle in AXLES for name in AXLE_COLUMNS)
_RIDE_OPTIONAL = tuple(name.format(axle) for axle in AXLES for name in AXLE_COLUMNS[-2:])


class SummaryRow(Frozen):
    """One ride in one line; peaks and r.m.s. are taken after `settle`."""

    case: str
    road: str
    policy: str
    fidelity: str
    point: str
    peak_abs_aK_m_per_s2: float
    rms_aK_m_per_s2: float
    rms_jerk_m_per_s3: float
    """R.m.s. of the jerk at K behind an 80 Hz low-pass."""
    peak_deflection_m: float
    rms_wheel_load_N: float
    """R.m.s. of the dynamic wheel load, the larger of the two axles."""
    dissipated_J: float
    energy_error: float
    outside_table: float
    """Share of the ride spent beyond what the rig reached."""


@dataclass(frozen=True, eq=False)
class Ride:
    """The history of one case; every column is (n,) under its name in `RIDE_COLUMNS` and `AXLE_COLUMNS`."""

    case: str
    columns: Mapping[str, Array]


class Response(Frozen):
    """Times to 63 and 90 % of a step at constant speed [s], of one signal."""

    signal: Literal["voltage", "force"]
    from_voltage_V: float
    to_voltage_V: float
    velocity_m_per_s: float
    to_63_percent_s: float | None
    to_90_percent_s: float | None


@dataclass(frozen=True, eq=False)
class Rides:
    """Every ride, its summary, and how quickly the damper answers a step of voltage."""

    folder: ClassVar[str] = "5-simulate"

    rides: tuple[Ride, ...]
    summary: tuple[SummaryRow, ...]
    responses: tuple[Response, ...] = field(default=())

    def write(self, folder: Path, control: Control) -> None:
        """Write one CSV a case, summary.csv and response.csv."""
        for ride in self.rides:
            columns = {name: ride.columns.get(name) for name in _RIDE_HEADER}
            write_columns(folder / f"{ride.case}.csv", columns, control)
        write_rows(folder / "summary.csv", SummaryRow, self.summary, control)
        write_rows(folder / "response.csv", Response, self.responses, control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again."""
        summary = read_rows(folder / "summary.csv", SummaryRow, control)
        rides = tuple(
            Ride(row.case, read_columns(folder / f"{row.case}.csv", _RIDE_HEADER, control, _RIDE_OPTIONAL))
            for row in summary
        )
        return cls(rides, summary, read_rows(folder / "response.csv", Response, control))

    @property
    def untrusted(self) -> tuple[str, ...]:
        """Why the result is not to be trusted (exit 4): rides whose energy balance does not close."""
        return tuple(
            f"{row.case}: energy error {row.energy_error:.1e}, above {ENERGY_LIMIT:g}"
            for row in self.summary
            if not abs(row.energy_error) <= ENERGY_LIMIT
        )


ENERGY_LIMIT = 1e-6
"""Largest error of the energy balance, as a share of the dissipated energy."""

# ---------------------------------------------------------------- 6-report


class ComfortRow(Frozen):
    """One comfort measure of one ride."""

    case: str
    point: str
    edition: str
    """The standard and its year, e.g. `ISO 2631-1:1997`."""
    measure: str
    value: float | None
    unit: str
    status: str
    """How far the number can be trusted, e.g. `verified` or `unverified transcription`."""


class PublishedRow(Frozen):
    """One published number beside ours."""

    id: str
    kind: str
    published: float | str
    computed: float | None
    unit: str
    ratio: float | None
    note: str


@dataclass(frozen=True, eq=False)
class Report:
    """The comfort numbers and the page."""

    folder: ClassVar[str] = "6-report"

    comfort: tuple[ComfortRow, ...]
    page: str
    """report.html, whole."""
    published: tuple[PublishedRow, ...] | None = None

    def write(self, folder: Path, control: Control) -> None:
        """Write comfort.csv, report.html and, where the config asks, published.csv."""
        write_rows(folder / "comfort.csv", ComfortRow, self.comfort, control)
        (folder / "report.html").write_text(self.page, encoding="utf-8")
        if self.published is not None:
            write_rows(folder / "published.csv", PublishedRow, self.published, control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again."""
        published = folder / "published.csv"
        return cls(
            read_rows(folder / "comfort.csv", ComfortRow, control),
            (folder / "report.html").read_text(encoding="utf-8"),
            read_rows(published, PublishedRow, control) if published.exists() else None,
        )


Artefact = Rig | Identified | Diagnosed | Table | Rides | Report


class Manifest(Frozen):
    """What a stage was made from and what it made; the only file with timestamps."""

    stage: str
    key: str
    """Hash of all that the stage depends on."""
    config: str
    """Path of the config."""
    inputs: dict[str, str]
    """Hash of every input file."""
    outputs: dict[str, str]
    """Hash of every output file."""
    versions: dict[str, str]
    """Version of pzd, Python and the numerical libraries."""
    finished: str
    """When, in UTC."""
    seconds: float
    """How long it took."""
    marks: tuple[str, ...] = ()
    """Why the result is not to be trusted (exit 4); carried on by the stages behind."""


def base_of(rows: tuple[ParameterRow, ...], setting: str | None) -> Damper:
    """The plain damper of one setting, from its identified parameters.

    A value that the data do not determine is taken from the nearest condition that has it
    (by voltage, then temperature); where no condition has it, from `UNDETERMINED`.

    Raises
    ------
    ValueError : when the setting has no row
    """
    mine = [row for row in rows if row.setting == setting]
    if not mine:
        raise ValueError(f"no identified parameters for setting {setting!r}")
    return Damper(base=tuple(_filled(row, mine) for row in mine))


UNDETERMINED = {"T0_N": 0.0, "C_Ns_per_m": 1.0, "k_N_per_m": 1e8}
"""Stand-ins where no condition determines a parameter: no friction, hardly any damping, a rigid spring."""


def _filled(row: ParameterRow, rows: list[ParameterRow]) -> BaseRow:
    def distance(other: ParameterRow) -> tuple[float, float]:
        return (
            abs((other.voltage_V or 0.0) - (row.voltage_V or 0.0)),
            abs((other.temperature_degC or 0.0) - (row.temperature_degC or 0.0)),
        )

    def value(name: str) -> float:
        known = [(distance(other), float(getattr(other, name))) for other in rows if getattr(other, name) is not None]
        return min(known)[1] if known else UNDETERMINED[name]

    return BaseRow(
        voltage_V=row.voltage_V,
        temperature_degC=row.temperature_degC,
        T0_N=value("T0_N"),
        C_Ns_per_m=value("C_Ns_per_m"),
        k_N_per_m=value("k_N_per_m"),
    )
