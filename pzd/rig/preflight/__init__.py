"""Checks of a record before anything is fitted to it, in families of one file each.

A file declares `CHECKS`: functions of a record that yield findings. Where records have to be compared with each other
it also declares `COMPARISONS`: functions of all entries that return them with findings added, reworded or dropped.
Nothing here changes a record.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from importlib import import_module
from types import ModuleType

import numpy as np

from pzd.artefacts import Finding, IngestRow, RecordEntry, Rig
from pzd.parallel.on_disk import OnDisk
from pzd.parallel.processes import parallel_each
from pzd.quantities import DISPLACEMENT, FORCE, PRESSURE, TEMPERATURE, Control
from pzd.record import CONSTANT_SHARE, SAME_TEMPERATURE, Array, Record, is_constant, voltage_scale
from pzd.rig.config import Limits
from pzd.signals.cycles import Cycles, remember_cycles
from pzd.signals.kinematics import Kinematics, remember_clean_displacement
from pzd.signals.measures import one_record, reversals, work


@dataclass(frozen=True, eq=False)
class PreflightRecord:
    """A record with its cycles and clean motion, and what is known of its file."""

    record: Record
    cycles: Cycles | None
    """Periodic part of the record; None without one."""
    clean: Kinematics
    """Displacement without noise, and its derivatives."""
    limits: Limits
    removed: str | None = None
    """What a known fixture took out of the record."""
    control: Control = field(default_factory=Control)
    """The control signal, recorded as the voltage."""
    remarks: tuple[Finding, ...] = ()
    """Contradictions between the file and the config."""
    ingested: tuple[IngestRow, ...] = ()
    """Steps from the file to this record."""

    @cached_property
    def constant_control(self) -> bool:
        """Whether the control signal stands still: one element and one gain then hold for the whole record."""
        return is_constant(self.record, voltage_scale([self.record]))

    @property
    def cycle_count(self) -> float:
        """Number of cycles; of a motion that does not repeat one goes to either side and back."""
        return float(self.cycles.count) if self.cycles else 0.5 * len(reversals(self.record.displacement))

    def channels(self) -> tuple[Channel, ...]:
        """Return every recorded channel but the clock: force and motion first, then what labels the record."""
        record, signal = self.record, self.control.quantity
        labels = (
            (signal.name, signal.unit, record.voltage, 0.0),
            (TEMPERATURE.name, TEMPERATURE.unit, record.temperature, SAME_TEMPERATURE),
            (PRESSURE.name, PRESSURE.unit, record.pressure, 0.0),
        )
        return (
            Channel(FORCE.name, FORCE.unit, record.force),
            Channel(DISPLACEMENT.name, DISPLACEMENT.unit, record.displacement),
            *(
                Channel(name, unit, values, max(least, CONSTANT_SHARE * float(np.median(np.abs(values)))))
                for name, unit, values, least in labels
                if values is not None and np.ptp(values) > 0.0
            ),
        )


@dataclass(frozen=True, eq=False)
class Channel:
    """One recorded channel that is not constant."""

    name: str
    unit: str
    values: Array
    """(n,)"""
    same_condition: float | None = None
    """Largest change within one condition, of a control signal, temperature or pressure; None for x and F."""


Check = Callable[[PreflightRecord], Iterable[Finding]]


@lru_cache(maxsize=1)
def families() -> tuple[ModuleType, ...]:
    """Return the modules of this folder."""
    return tuple(import_module(f"{__name__}.{found.name}") for found in pkgutil.iter_modules(__path__))


@lru_cache(maxsize=1)
def checks() -> dict[str, Check]:
    """Return every check by its name, in alphabetical order: findings stand in this order in records.json."""
    return dict(sorted((check.__name__, check) for family in families() for check in family.CHECKS))


def findings(test: PreflightRecord) -> tuple[Finding, ...]:
    """Return the remarks of the file and the findings of every check."""
    return (*test.remarks, *(finding for check in checks().values() for finding in check(test)))


def examined(tests: Iterable[Callable[[], PreflightRecord]], jobs: int, preflight: bool = True) -> Rig:
    """Make and examine every record.

    Parameters
    ----------
    tests : each makes one record, and is let go then where nobody else keeps it
    jobs : records made and examined at the same time
    preflight : whether they are examined; an entry has no findings otherwise

    Returns
    -------
    the artefact of the rig: the records, and an entry with findings for each
    """

    def examine(
        make: Callable[[], PreflightRecord] | None,
    ) -> tuple[Record, Cycles | None, Array, RecordEntry, tuple[IngestRow, ...]]:
        if make is None:
            raise ValueError("this record was made already")
        with one_record():
            return examined_one(make())

    def examined_one(
        test: PreflightRecord,
    ) -> tuple[Record, Cycles | None, Array, RecordEntry, tuple[IngestRow, ...]]:
        record, run = test.record, test.cycles
        entry = RecordEntry(
            name=record.name,
            setting=record.setting,
            voltage_V=record.median_voltage(),
            temperature_degC=record.median_temperature(),
            rate_Hz=record.rate,
            cycles=test.cycle_count,
            control_moves=not test.constant_control,
            displacement_rms_m=float(np.std(record.displacement)),
            velocity_rms_m_per_s=float(np.std(record.velocity)),
            acceleration_rms_m_per_s2=float(np.std(record.acceleration)),
            force_rms_N=float(np.std(record.force)),
            force_peak_N=float(np.max(np.abs(record.force))),
            work_J=work(record.displacement, record.force),
            findings=findings(test) if preflight else (),
            removed=test.removed,
        )
        return record, run, test.clean.displacement, entry, test.ingested

    waiting: list[Callable[[], PreflightRecord] | None] = list(tests)
    del tests
    records: list[Record] = []
    listed: list[RecordEntry] = []
    ingested: list[IngestRow] = []
    store = OnDisk()
    for record, run, clean, entry, rows in parallel_each(examine, waiting, jobs, first_here=True):
        waiting[len(records)] = None
        one_clock = records and np.array_equal(record.time, records[-1].time)
        kept = replace(record, time=records[-1].time) if one_clock else record  # most tests of a rig have one clock
        kept = store.kept(kept)
        # A record was made in another process, whose memory of the cycles and the clean motion is lost here.
        remember_cycles(kept, run)
        remember_clean_displacement(kept, clean)
        records.append(kept)
        listed.append(entry)
        ingested.extend(rows)
    entries = tuple(listed)
    for family in families():
        for compare in getattr(family, "COMPARISONS", ()):
            entries = compare(entries)
    return Rig(tuple(records), entries, tuple(ingested))
