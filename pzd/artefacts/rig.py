"""Artefact of rig: the records in canonical columns, with the findings of the preflight; and the look-up of tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, ClassVar, Literal, Self, TypeVar

import numpy as np

from pzd.artefacts.identified import Characteristics, GasAndFrictionRow, MeasureRow, ParameterRow
from pzd.parallel.on_disk import OnDisk
from pzd.parallel.processes import parallel_each, parallel_map
from pzd.quantities import CHANNELS, PRESSURE, TIME, Control
from pzd.record import CONSTANT_SHARE, SAME_TEMPERATURE, Record, clock_fault
from pzd.schema.csvfile import read_columns, write_columns
from pzd.schema.errors import DataError, at
from pzd.schema.model import Frozen
from pzd.schema.validate import read_json_list, write_json

INGEST = "ingest.json"
"""What was done to the files of a real rig."""


class Finding(Frozen):
    """One finding of the preflight: always reported, never corrected."""

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


ANOTHER_DAMPER = ("scale", "units", "sign", "clock", "level")
"""Checks whose findings make another damper of the fit, the gravest first; the others cost accuracy, or are marks."""


def worst(findings: Sequence[tuple[str, Finding]]) -> tuple[str, Finding]:
    """Return the name of a record and the gravest of the findings; of those as grave the first.

    Parameters
    ----------
    findings : each with the name of its record, at least one
    """

    def rank(found: tuple[str, Finding]) -> int:
        check = found[1].check
        return ANOTHER_DAMPER.index(check) if check in ANOTHER_DAMPER else len(ANOTHER_DAMPER)

    return min(findings, key=rank)


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
    control_moves: bool = False
    """Whether the control signal moves, so that no one T0, C and k describe the record."""
    displacement_rms_m: float | None = None
    """R.m.s. of the displacement about its mean."""
    velocity_rms_m_per_s: float | None = None
    """R.m.s. of the velocity about its mean."""
    acceleration_rms_m_per_s2: float | None = None
    """R.m.s. of the acceleration about its mean."""
    force_rms_N: float | None = None
    """R.m.s. of the force about its mean."""
    force_peak_N: float | None = None
    """Largest magnitude of the force."""
    work_J: float | None = None
    """Work done on the damper over the record; below zero where force and displacement have opposite signs."""
    findings: tuple[Finding, ...] = ()
    removed: str | None = None
    """What was subtracted from the force for a known fixture, in words."""


class IngestRow(Frozen):
    """One thing that was done on the way from a file to a record."""

    record: str
    file: str
    """Name of the file, without its folder."""
    step: Literal["read", "left out", "rename", "unit", "sign", "value", "cut", "clock", "fixture"]
    quantity: str | None
    """The quantity concerned; empty for the file as a whole."""
    was: str
    """What stands in the file or in the config."""
    became: str
    """What was made of it."""


@dataclass(frozen=True, eq=False)
class Rig:
    """The rig records in canonical columns, and what the preflight found."""

    folder: ClassVar[str] = "1-rig"

    records: tuple[Record, ...]
    entries: tuple[RecordEntry, ...]
    ingested: tuple[IngestRow, ...] = ()
    """What was done to the files of a real rig, in the order of the records."""

    def write(self, folder: Path, control: Control, jobs: int = 1) -> None:
        """Write records.json and one CSV a record, so many at the same time; of files also ingest.json."""

        def written(record: Record) -> None:
            columns = {q.column: getattr(record, q.name) for q in CHANNELS}
            if record.pressure is None:
                del columns[PRESSURE.column]
            write_columns(folder / f"{record.name}.csv", columns, control)

        write_json(folder / "records.json", self.entries, control)
        if self.ingested:
            write_json(folder / INGEST, self.ingested, control)
        parallel_map(written, self.records, jobs)

    def as_read(self) -> Self:
        """Return the rig as `read` makes it of the files: every channel 64 bits wide and contiguous."""
        return replace(self, records=tuple(_as_read(record) for record in self.records))

    @classmethod
    def read(cls, folder: Path, control: Control, jobs: int = 1) -> Self:
        """Read and check them again, so many at the same time."""
        entries = read_json_list(folder / "records.json", RecordEntry, control)
        store = OnDisk()
        each = parallel_each(lambda entry: _read_record(folder, entry, control), entries, jobs)
        records = [store.kept(record) for record in each]
        report = folder / INGEST
        return cls(tuple(records), entries, read_json_list(report, IngestRow, control) if report.is_file() else ())


def _as_read(record: Record) -> Record:
    """Return the record itself where its channels are so already, since caches go by the identity of a record."""
    given: list[Any] = [getattr(record, field.name) for field in fields(record)]
    read: list[Any] = [np.ascontiguousarray(v, np.float64) if isinstance(v, np.ndarray) else v for v in given]
    return record if all(a is b for a, b in zip(given, read, strict=True)) else Record(*read)


def _read_record(folder: Path, entry: RecordEntry, control: Control) -> Record:
    """Read the file of an entry as it stands, also where it was edited; its clock must run forwards."""
    path = folder / f"{entry.name}.csv"
    columns = read_columns(path, [q.column for q in CHANNELS], control, [q.column for q in CHANNELS[5:]])
    if fault := clock_fault(columns[TIME.column]):
        raise DataError(f"{at(path, fault[0] + 2)}: {fault[1]}")
    channels = {q.name: columns[q.column] for q in CHANNELS if q.column in columns}
    return Record(entry.name, entry.setting, **channels)


# --- Looking up the tests or conditions that a few stated numbers mean ---

SAME_SET_VALUE = 0.05
"""Frequencies, amplitudes and speeds that differ by less, relative, are the same: stands reach what they are set to
within a few per cent, and nobody tests at two values closer than that."""

Row = TypeVar("Row", MeasureRow, ParameterRow)


@dataclass(frozen=True)
class Conditions:
    """Conditions of a test; None where any will do."""

    setting: str | None = None
    voltage_V: float | None = None
    temperature_degC: float | None = None
    frequency_Hz: float | None = None
    amplitude_m: float | None = None

    def __str__(self) -> str:
        """Return the conditions in words."""
        units = {"voltage_V": "V", "temperature_degC": "°C", "frequency_Hz": "Hz", "amplitude_m": "m"}
        numbers = [(getattr(self, name), unit) for name, unit in units.items()]
        words = [self.setting] if self.setting else []
        words += [f"{value:g} {unit}" for value, unit in numbers if value is not None]
        return ", ".join(words) or "any condition"


ANY = Conditions()
"""No condition is stated."""


def same_motion(a: float, b: float) -> bool:
    """Return whether two frequencies, amplitudes or speeds are the same, within `SAME_SET_VALUE` of the larger."""
    return abs(a - b) <= SAME_SET_VALUE * max(abs(a), abs(b))


def slowest_test_force(found: Characteristics, row: GasAndFrictionRow) -> float:
    """Return the largest force of the slowest tests of a condition, which its gas force and friction come from [N].

    The two are a mean and half a difference of such forces, so no digit below the last one of these is significant.

    Parameters
    ----------
    found : with the tests
    row : gas force and friction of a condition
    """
    mine = [r for r in found.peak_velocity if r.condition == row.condition]
    slowest = [r for r in mine if same_motion(r.speed, row.velocity_m_per_s)]
    forces = [force for r in slowest for force in (r.rebound_force_N, r.compression_force_N) if force is not None]
    return max(map(abs, forces), default=0.0)


def voltage_margin(rows: Sequence[MeasureRow] | Sequence[ParameterRow]) -> float:
    """Return how far apart two voltages may be to count as one [V]: 2 % of the larger of span and magnitude."""
    voltages = [0.0, *(row.voltage_V for row in rows if row.voltage_V is not None)]
    return CONSTANT_SHARE * (max(voltages) - min(voltages))


def matching(rows: Sequence[Row], wanted: Conditions, margin: float | None = None) -> tuple[Row, ...]:
    """Select the tests, or the identified conditions, that meet every stated condition.

    A condition of the motion says nothing about rows that hold no motion: those of the identified parameters.

    Parameters
    ----------
    rows : of the rig
    wanted : the conditions
    margin : of the voltage [V]; None for that of the rows

    Returns
    -------
    the rows, nearest in temperature first, else in their own order; a row without a value does not meet a condition
    """
    within = voltage_margin(rows) if margin is None else margin
    found = [row for row in rows if _meets(row, wanted, within)]
    return tuple(sorted(found, key=lambda row: abs((row.temperature_degC or 0.0) - (wanted.temperature_degC or 0.0))))


def ambiguous_conditions(rows: Sequence[Row], found: Sequence[Row], wanted: Conditions) -> tuple[str, ...]:
    """Return the conditions that were left open and in which the rows found differ, so that no one of them is meant.

    Parameters
    ----------
    rows : all of the rig
    found : those that meet what was stated, at least one
    wanted : what was stated

    Returns
    -------
    names of columns; none where the rows found are one test and its repetitions
    """
    margin, first = voltage_margin(rows), found[0]
    names = [f.name for f in fields(wanted) if getattr(wanted, f.name) is None and hasattr(first, f.name)]
    return tuple(
        name for name in names if len(matching(found, Conditions(**{name: getattr(first, name)}), margin)) < len(found)
    )


def _meets(row: MeasureRow | ParameterRow, wanted: Conditions, margin: float) -> bool:
    return (
        wanted.setting in (None, row.setting)
        and _within(row.voltage_V, wanted.voltage_V, margin)
        and _within(row.temperature_degC, wanted.temperature_degC, SAME_TEMPERATURE)
        and (
            isinstance(row, ParameterRow)
            or (_moves(row.frequency_Hz, wanted.frequency_Hz) and _moves(row.amplitude_m, wanted.amplitude_m))
        )
    )


def _within(found: float | None, wanted: float | None, margin: float) -> bool:
    return wanted is None or (found is not None and abs(found - wanted) <= margin)


def _moves(found: float | None, wanted: float | None) -> bool:
    return wanted is None or (found is not None and same_motion(found, wanted))
