"""What a test engineer would ask of a record before trusting it, one file a check.

A check is `check(test) -> list[Finding]`; one that compares records has `compared(entries) -> entries` as well.
Nothing here changes a record.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from importlib import import_module
from types import ModuleType

import numpy as np

from pzd.artefacts import Finding, IngestRow, RecordEntry, Rig, extent
from pzd.parallel.processes import parallel_map
from pzd.quantities import DISPLACEMENT, FORCE, PRESSURE, TEMPERATURE, Control
from pzd.record import CONSTANT_SHARE, SAME_TEMPERATURE, Array, Record
from pzd.rig.config import Limits
from pzd.signals.cycles import Cycles, remember_cycles
from pzd.signals.kinematics import Kinematics


@dataclass(frozen=True, eq=False)
class Measured:
    """One record, its cycles and clean motion, and what a known fixture took out of it."""

    record: Record
    run: Cycles | None
    """Of the record's clock and displacement, as `cycles` finds it."""
    clean: Kinematics
    limits: Limits
    removed: str | None = None
    control: Control = field(default_factory=Control)
    """The control signal, recorded as the voltage."""
    remarks: tuple[Finding, ...] = ()
    """What the file itself says otherwise than the config."""
    ingested: tuple[IngestRow, ...] = ()
    """What was done to the file on the way to this record."""

    def channels(self) -> tuple[Channel, ...]:
        """Every recorded channel but the clock: what is sensed of the motion first, then what labels the record."""
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
    """One recorded channel that is not one constant."""

    name: str
    unit: str
    values: Array
    """(n,)"""
    least: float | None = None
    """Of a control signal, temperature or pressure: what is less is no other condition; None for x and F."""


@lru_cache(maxsize=1)
def checks() -> dict[str, ModuleType]:
    """Every check by its name, as found in this folder."""
    return {found.name: import_module(f"{__name__}.{found.name}") for found in pkgutil.iter_modules(__path__)}


def findings(test: Measured) -> tuple[Finding, ...]:
    """What the file remarks, and what every check found in one record, in the order of the checks' names."""
    return (*test.remarks, *(finding for module in checks().values() for finding in module.check(test)))


def examined(tests: Sequence[Callable[[], Measured]], jobs: int, preflight: bool = True) -> Rig:
    """The artefact of the rig: every record, and an entry about each with what the checks found.

    Parameters
    ----------
    tests : each makes one record
    jobs : records made and examined at the same time
    preflight : whether they are examined; an entry has no findings otherwise
    """

    def listed(given: Callable[[], Measured]) -> tuple[Record, Cycles | None, RecordEntry, tuple[IngestRow, ...]]:
        test = given()
        return test.record, test.run, _entry(test, findings(test) if preflight else ()), test.ingested

    found = parallel_map(listed, tests, jobs)
    for record, run, _, _ in found:
        remember_cycles(record, run)
    entries = tuple(entry for _, _, entry, _ in found)
    for module in checks().values():
        entries = module.compared(entries) if hasattr(module, "compared") else entries
    return Rig(tuple(record for record, *_ in found), entries, tuple(row for *_, rows in found for row in rows))


def _entry(test: Measured, found: tuple[Finding, ...]) -> RecordEntry:
    record = test.record
    return RecordEntry(
        name=record.name,
        setting=record.setting,
        findings=found,
        removed=test.removed,
        **extent(record, test.run),
    )
