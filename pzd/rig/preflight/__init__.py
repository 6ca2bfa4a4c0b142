"""What a test engineer would ask of a record before trusting it, one file a check.

A check is `check(test) -> list[Finding]`. Nothing here changes a record.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from types import ModuleType

from pzd.artefacts import Finding, RecordEntry, Rig
from pzd.record import Record
from pzd.rig.config import Limits
from pzd.schema.processes import at_once
from pzd.signals.cycles import Cycles
from pzd.signals.kinematics import Kinematics
from pzd.signals.turning_points import reversal_count


@dataclass(frozen=True, eq=False)
class Measured:
    """One record, its cycles and clean motion, and what a known fixture took out of it."""

    record: Record
    run: Cycles | None
    clean: Kinematics
    limits: Limits
    removed: str | None = None


@lru_cache(maxsize=1)
def checks() -> dict[str, ModuleType]:
    """Every check by its name, as found in this folder."""
    return {found.name: import_module(f"{__name__}.{found.name}") for found in pkgutil.iter_modules(__path__)}


def findings(test: Measured) -> tuple[Finding, ...]:
    """What every check found in one record, in the order of the checks' names."""
    return tuple(finding for module in checks().values() for finding in module.check(test))


def examined(tests: Sequence[Callable[[], Measured]], jobs: int) -> Rig:
    """The artefact of the rig: every record, and an entry about each with what the checks found.

    Parameters
    ----------
    tests : each makes one record
    jobs : records made and examined at the same time
    """

    def listed(given: Callable[[], Measured]) -> tuple[Record, RecordEntry]:
        test = given()
        return test.record, _entry(test)

    found = at_once(listed, tests, jobs)
    return Rig(tuple(record for record, _ in found), tuple(entry for _, entry in found))


def _entry(test: Measured) -> RecordEntry:
    record = test.record
    return RecordEntry(
        name=record.name,
        setting=record.setting,
        voltage_V=record.median_voltage(),
        temperature_degC=record.median_temperature(),
        rate_Hz=record.rate,
        cycles=float(test.run.count) if test.run else 0.5 * reversal_count(record.displacement),
        findings=findings(test),
        removed=test.removed,
    )
